"""The floor plan: valid, self-contained, to scale, and complete."""

from __future__ import annotations

from xml.etree import ElementTree

from factory.apps.exports.floor_sheet import write_svg
from factory.floor.layout.layout import Layout
from tests.layout_values import paper_layout

SVG = "{http://www.w3.org/2000/svg}"


def drawn(layout: Layout) -> ElementTree.Element:
    return ElementTree.fromstring(write_svg(layout).encode())


def group(root: ElementTree.Element, name: str) -> ElementTree.Element:
    return next(g for g in root.iter(f"{SVG}g") if g.get("id") == name)


def test_chevrons_point_along_the_belt() -> None:
    belt = group(drawn(paper_layout()), "outfeed")
    ways = [p.get("d", "") for p in belt if p.get("class") == "chevron"]
    assert ways
    for way in ways:
        (x, y), (tip, middle), (back, down) = (
            map(float, corner.split()) for corner in way.removeprefix("M").split("L")
        )
        assert x == back < tip and y < middle < down
