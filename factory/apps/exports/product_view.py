"""Drawings of a product's parts as SVG: a sheet with rows of two views, all at one scale. The same
product gives the same bytes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from factory.api import Product, Solid
from factory.apps.drawing.canvas import Box, Canvas, Point
from factory.apps.exports.subject import file_name
from factory.support.arrays import Array

WIDTH, TALL, EDGE, BETWEEN, ROW = 560.0, 330.0, 50.0, 40.0, 36.0
"""Layout of a sheet: width and greatest height of a view, margin, distance between the two views of
a row, distance below a row."""

UNIT = 21.4
"""Unit of the legend's dimensions."""

STYLE = """
.view { fill: #fbfbfa; stroke: #cbd2d9; stroke-width: 1.5; }
path { stroke-linejoin: round; fill-rule: evenodd; }
.shaft { fill: none; stroke: #1f2933; stroke-width: 3; }
.name { stroke: #ffffff; stroke-width: 4; paint-order: stroke; font-weight: bold; }
"""


@dataclass(frozen=True, slots=True)
class PartView:
    """A projection `axes` (2, 3) onto a `box` of the sheet, at a scale [1/m], with (x, y) `low` at
    the lower left and `high` at the upper right [m]."""

    name: str
    axes: Array
    low: Array
    high: Array
    scale: float
    box: Box

    def points(self, flat: Array) -> list[Point]:
        """Projected points (n, 2) on the sheet."""
        x = self.box[0] + (flat[:, 0] - self.low[0]) * self.scale
        y = self.box[3] - (flat[:, 1] - self.low[1]) * self.scale
        return list(zip(x.tolist(), y.tolist(), strict=True))

    def inside(self, shape: Any) -> Any:
        """The portion of a geometry that lies in the view."""
        from shapely import box

        return shape.intersection(box(*self.low, *self.high))

    def nearness(self, solid: Solid) -> float:
        """Twice the height of a part's middle above the plane of projection [m]."""
        return float(np.cross(*self.axes) @ (solid.low + solid.high))


class ViewSheet:
    """A sheet for views of the box from `low` to `high` (3,) [m], with a margin of `room` times its
    longest side."""

    def __init__(self, product: Product, low: Array, high: Array, room: float) -> None:
        self.product, self.canvas = product, Canvas()
        self.middle, span = (low + high) / 2, high - low
        self.half = span / 2 + room * float(span.max())
        level = 2 * float(self.half[:2].max())
        self.scale = min(WIDTH / level, TALL / max(2 * float(self.half[2]), level))

    def view(self, name: str, axes: tuple[Array, Array], column: int, top: float) -> PartView:
        """A view in the left (0) or right (1) column, with its frame and its name above."""
        both = np.stack(axes)
        middle, half = both @ self.middle, np.abs(both) @ self.half
        half[0] = WIDTH / 2 / self.scale
        left = EDGE + column * (WIDTH + BETWEEN)
        box = left, left + WIDTH, top, top + 2 * float(half[1]) * self.scale
        self.canvas.rectangle(box, "view")
        self.canvas.text((left, top - 16), name, 16, "grey")
        return PartView(name, both, middle - half, middle + half, self.scale, box)

    def nearest_last(self, view: PartView, labels: Iterable[str]) -> list[str]:
        """Parts in the order in which they are drawn: the most distant first."""
        return sorted(labels, key=lambda label: view.nearness(self.product.solids[label]))

    def outline(self, view: PartView, label: str, shift: Array | None = None) -> Any:
        """The projection of a part, displaced by a shift (3,) [m], as a shapely geometry [m]."""
        from shapely import MultiPoint, union_all

        moved = np.zeros(3) if shift is None else shift
        bodies = bodies_of(self.product, label)
        return union_all([MultiPoint((body + moved) @ view.axes.T).convex_hull for body in bodies])

    def area(self, view: PartView, shape: Any, style: str, name: str = "") -> None:
        """Draw the visible portion of a geometry as one element."""
        if rings := [view.points(ring) for ring in _rings(view.inside(shape))]:
            self.canvas.loops(rings, style, name)

    def name(self, view: PartView, shape: Any, label: str) -> None:
        """Write a label near a geometry."""
        (at,) = view.points(np.array(shape.representative_point().coords))
        self.canvas.place(at, label, 17.0, 14.0, "name")

    def arrow(self, view: PartView, toward: int, words: str) -> None:
        """An arrow above a view, to the right (1) or to the left (-1), with words before it."""
        right, y = view.box[1], view.box[2] - 16
        left_end, right_end = (right - 60.0, y), (right, y)
        start, end = (left_end, right_end) if toward > 0 else (right_end, left_end)
        self.canvas.arrow(start, end, ("shaft", "black"), (14.0, 6.0))
        self.canvas.text((right - 72, y), words, 16, "grey", "end")

    def document(self, title: str, y: float, entries: Sequence[tuple[str, str]], style: str) -> str:
        """The sheet as a file, with scale bar and legend from height y on."""
        right = EDGE + 2 * WIDTH + BETWEEN
        self.canvas.scale_bar((EDGE, y), WIDTH / 3, 15, self.scale / 1e3)
        below = self.canvas.legend(entries, (EDGE, y + 48), right, UNIT)
        return self.canvas.document(title, (0.0, EDGE + right, 0.0, below + 2), STYLE + style)


def picture_names(kind: str, labels: Iterable[str]) -> list[str]:
    """File names of the pictures of some labels: numbered, so that no two are the same, with the
    characters of the label that are safe in a name."""
    safe = (file_name(label, set())[:40] for label in labels)
    return [f"{kind}-{n:03d}-{name}.svg" for n, name in enumerate(safe, start=1)]


def bodies_of(product: Product, label: str) -> tuple[Array, ...]:
    """The convex bodies of a part, as points (n, 3) each."""
    solid = product.solids[label]
    return solid.pieces or (solid.corners,)


def _rings(shape: Any) -> Iterator[Array]:
    """The rings (n, 2) of all polygons of a geometry."""
    from shapely import get_coordinates, get_parts

    for area in get_parts(shape):
        if area.geom_type == "Polygon" and not area.is_empty:
            for ring in (area.exterior, *area.interiors):
                yield get_coordinates(ring)[:-1]
