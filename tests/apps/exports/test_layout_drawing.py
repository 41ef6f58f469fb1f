"""The floor plan: valid, self-contained, to scale, and complete."""

from __future__ import annotations

import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from factory.apps.drawing.canvas import LONGEST, Canvas, clean, hull, number
from factory.apps.exports.floor_sheet import write_svg
from factory.floor.geometry.product import product_geometry
from factory.floor.layout.embedding import lay_out
from factory.floor.layout.layout import Layout
from tests.layout_values import many_layouts, paper_layout, random_layout, row_of_inserts, table_pag
from tests.pag_values import factory_of

SVG = "{http://www.w3.org/2000/svg}"


def drawn(layout: Layout) -> ElementTree.Element:
    return ElementTree.fromstring(write_svg(layout).encode())


def group(root: ElementTree.Element, name: str) -> ElementTree.Element:
    return next(g for g in root.iter(f"{SVG}g") if g.get("id") == name)


def texts(element: ElementTree.Element) -> list[str]:
    return [t.text or "" for t in element.iter(f"{SVG}text")]


@pytest.mark.parametrize("seed", [None, *range(3)])
def test_everything_is_drawn(seed: int | None) -> None:
    layout = paper_layout() if seed is None else many_layouts(25, range(seed, seed + 1))[0]
    root, factory = drawn(layout), layout.factory
    shown = texts(group(root, "labels"))
    assert {robot.name for robot in factory.robots} <= set(shown)
    assert {leaf.label for leaf in factory.leaves} <= set(shown)
    joined = {o.label for o in factory.operations if len(o.robots) > 1}
    assert joined <= set(shown)
    paths = [p for p in group(root, "guidepaths") if p.get("class") == "path"]
    assert len(paths) == len(factory.robots)
    assert len(group(root, "parts")) == len(factory.leaves)
    outlines = [p for p in group(root, "outfeed") if p.get("class") == "product"]
    assert len(outlines) == len(factory.leaves)


def test_it_is_to_scale() -> None:
    layout = paper_layout()
    root = drawn(layout)
    floor = next(r for r in root.iter(f"{SVG}rect") if r.get("class") == "floor")
    assert float(floor.get("width", 0)) == pytest.approx(627.2, abs=0.11)
    assert float(floor.get("height", 0)) == pytest.approx(530, abs=0.11)
    dots = [r for r in group(root, "robots") if r.get("class") in ("dot", "tool")]
    assert all(float(dot.get("width", 0)) == 60 for dot in dots)
    assert "0.627 m" in texts(group(root, "sheet"))
    assert "0.530 m" in texts(group(root, "sheet"))
    assert "6 robots, 3 parts, floor 0.33 m²" in texts(group(root, "sheet"))


def test_nothing_sticks_out_of_the_page() -> None:
    for layout in many_layouts(20, range(6)):
        root = drawn(layout)
        x, y, wide, tall = map(float, root.get("viewBox", "").split())
        for element in root.iter():
            for key, low, high in (("x", x, x + wide), ("y", y, y + tall)):
                if (
                    element.tag != f"{SVG}g"
                    and element.get(key)
                    and "translate" not in str(element.get("transform"))
                ):
                    if element.get(key) == "0":
                        continue
                    assert low - 1 <= float(element.get(key, 0)) <= high + 1


def test_bytes_are_the_same_and_refer_to_nothing_outside() -> None:
    first = write_svg(random_layout(40, 6, "any", "mixed"))
    assert first == write_svg(random_layout.__wrapped__(40, 6, "any", "mixed"))
    assert "href" not in first and "url(" not in first and "@import" not in first
    assert re.findall(r"https?://[^\"' ]+", first) == ["http://www.w3.org/2000/svg"]
    assert (
        "nan" not in first.lower().replace("lanan", "") and "e-" not in first.split("</style>")[1]
    )


def test_labels_are_escaped_and_long_ones_cut() -> None:
    long = "a-very-long-label-indeed.part"
    pag = table_pag(
        "x", ("x", "mate", f"{long} q", {}), (long, "atomic", "", {}), ("q", "atomic", "", {})
    )
    pag = replace(pag, file="dir/a<&>\x00\x07b.pag")
    svg = write_svg(lay_out(factory_of(pag), product_geometry(pag)))
    root = ElementTree.fromstring(svg.encode())
    assert "a<&>  b" in texts(group(root, "sheet"))
    assert f"{long[: LONGEST - 1]}…" in texts(group(root, "labels"))
    assert any(t.text == long for t in root.iter(f"{SVG}title"))


def test_a_tall_floor_has_its_legend_beside_it() -> None:
    layout = paper_layout()
    tall = replace(layout, floor=(-0.5, 0.5, -3.0, 3.0))
    for shown, beside in ((layout, False), (tall, True)):
        root = drawn(shown)
        floor = next(r for r in root.iter(f"{SVG}rect") if r.get("class") == "floor")
        words = next(t for t in root.iter(f"{SVG}text") if t.text == "outfeed")
        right = float(floor.get("x", 0)) + float(floor.get("width", 0))
        assert (float(words.get("x", 0)) > right) == beside
    assert "tool" in texts(group(drawn(layout), "sheet"))
    assert "tool" not in texts(group(drawn(row_of_inserts()), "sheet"))


def test_labels_make_room_for_each_other() -> None:
    canvas = Canvas()
    places = {canvas.place((0.0, 0.0), "word", 10.0, 5.0, "j") for _ in range(8)}
    assert len(places) == 8


def test_numbers_and_texts() -> None:
    assert [number(v) for v in (0.0, -0.01, 1.0, -2.25, 1200.04)] == ["0", "0", "1", "-2.2", "1200"]
    assert clean("a<b>&\n") == "a&lt;b&gt;&amp; "
    canvas = Canvas()
    canvas.label((0, 0), "short", 10, "j")
    canvas.label((0, 0), "so long that it is cut", 10, "j")
    short, long = canvas.elements
    assert "<title>" not in short and "<title>so long that it is cut</title>" in long


def test_outlines_are_convex_hulls() -> None:
    layout = random_layout(20, 3, "any", "medium")
    for solid in layout.product.solids.values():
        found = np.array(hull(np.round(solid.corners[:, :2], 6)))
        low, high = solid.corners[:, :2].min(axis=0), solid.corners[:, :2].max(axis=0)
        assert found.min(axis=0) == pytest.approx(low, abs=1e-5)
        assert found.max(axis=0) == pytest.approx(high, abs=1e-5)
        step = np.roll(found, -1, axis=0) - found
        after = np.roll(step, -1, axis=0)
        assert (step[:, 0] * after[:, 1] - step[:, 1] * after[:, 0] > 0).all()


def test_the_drawing_grows_with_the_number_of_robots() -> None:
    sizes = [len(write_svg(random_layout(n, 1, "balanced", "plain"))) for n in (40, 160)]
    assert sizes[1] < 4.6 * sizes[0]


def test_chevrons_point_along_the_belt() -> None:
    belt = group(drawn(paper_layout()), "outfeed")
    ways = [p.get("d", "") for p in belt if p.get("class") == "chevron"]
    assert ways
    for way in ways:
        (x, y), (tip, middle), (back, down) = (
            map(float, corner.split()) for corner in way.removeprefix("M").split("L")
        )
        assert x == back < tip and y < middle < down
