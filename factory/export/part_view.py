"""A view of a product's parts on a sheet: what a projection shows of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from factory.geometry.meshes import Array
from factory.geometry.solids import Product, Solid
from factory.support.canvas import Box, Canvas, Point


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

    def seen(self, product: Product, label: str, shift: Array | None = None) -> Any:
        """A part as it is seen, moved by a shift (3,) [m] (shapely geometry) [m]."""
        from shapely import MultiPoint, union_all

        moved = np.zeros(3) if shift is None else shift
        bodies = bodies_of(product, label)
        return union_all([MultiPoint((body + moved) @ self.axes.T).convex_hull for body in bodies])

    def area(self, canvas: Canvas, shape: Any, style: str, name: str = "") -> None:
        """Draw a geometry as one element, as far as it is in view."""
        from shapely import box

        inside = shape.intersection(box(*self.low, *self.high))
        if rings := [self.points(ring) for ring in _rings(inside)]:
            canvas.loops(rings, style, name)

    def nearness(self, solid: Solid) -> float:
        """How near the middle of a part is to the eye, times two [m]."""
        return float(np.cross(*self.axes) @ (solid.low + solid.high))


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
