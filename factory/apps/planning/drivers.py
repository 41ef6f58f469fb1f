"""The reach of drivers: whether one gets at a screw past the walls beside it."""

from __future__ import annotations

from collections.abc import Collection
from functools import cache

import numpy as np
from manifold3d import Manifold

from factory.api import DrawnSolids
from factory.apps.planning.cannot import Direction
from factory.apps.planning.parts import InPlace

DRIVER = ((0.05, 0.006), (0.15, 0.02))
"""The radius of a driver from so far above a screw's head on [m]: a bit as wide as the head, its
holder, and the body of the tool."""

LEAST = 1e-12
"""The volume that a driver may have in common with a part [m³]."""


class Drivers:
    """Drivers at the screws of a source."""

    def __init__(self, source: InPlace) -> None:
        self.units = [parts for _, parts in source.units()]
        self.far = float(np.linalg.norm(source.product.high - source.product.low))
        self._reaches = cache(self._is_clear)

    def reach(self, screw: int, way: Direction, others: Collection[int]) -> bool:
        """Whether a driver gets at a screw along the way on which it would leave, past others."""
        return all(self._reaches(screw, way, other) for other in others)

    def _is_clear(self, screw: int, way: Direction, other: int) -> bool:
        bodies = [DrawnSolids.body(part.solid) for part in self.units[other]]
        column = self._driver(screw, way)
        volumes = ((column ^ body).volume() for body in bodies if body is not None)
        return column.is_empty() or all(volume <= LEAST for volume in volumes)

    @cache  # noqa: B019 - as long as its planner
    def _driver(self, screw: int, way: Direction) -> Manifold:
        axis, side = way
        points = np.concatenate([part.vertices for part in self.units[screw]])
        low, high = points.min(axis=0), points.max(axis=0)
        middle, head = (low + high) / 2, float(np.delete(high - low, axis).max()) / 2
        middle[axis] = high[axis] if side > 0 else low[axis]
        made = Manifold()
        for first, radius in DRIVER:
            if radius > head and first < self.far:
                made = made + Manifold.cylinder(self.far, radius, radius, 24).translate(
                    (0, 0, first)
                )
        turns = {(0, 1): (0, 90, 0), (0, -1): (0, -90, 0), (1, 1): (-90, 0, 0), (1, -1): (90, 0, 0)}
        turned = made.rotate(turns.get(way, (0, 0, 0) if side > 0 else (180, 0, 0)))
        return turned.translate(tuple(middle.tolist()))
