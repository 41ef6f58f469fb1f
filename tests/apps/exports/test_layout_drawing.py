"""The floor plan: valid, self-contained, to scale, and complete."""

from __future__ import annotations

from dataclasses import replace
from xml.etree import ElementTree

import pytest

from factory.apps.exports.floor_sheet import write_svg
from factory.floor.layout.layout import Layout
from tests.layout_values import many_layouts, paper_layout, row_of_inserts

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
