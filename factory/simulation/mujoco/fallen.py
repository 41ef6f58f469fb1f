"""What has fallen: bodies that no robot holds, where they lie, and which robots could touch them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from factory.control.mode import Array, Index
from factory.layout.layout import Layout
from factory.layout.sweeps import piles, regions

APART = 0.02
"""Robots keep so far from what lies about [m]."""


@dataclass(frozen=True, slots=True)
class Heap:
    """The `bodies` of something that has fallen, by label, which count for a `unit` of scrap, and
    `until` when they lie [s]; `what` it was."""

    what: str
    unit: int
    bodies: Mapping[str, int]
    until: float


@dataclass(frozen=True, eq=False, slots=True)
class Ground:
    """The rectangles (n, 4) [m] that robots (n,) and what they carry sweep, seen from above: least
    and greatest x, least and greatest y."""

    boxes: Array = field(repr=False)
    robots: Index = field(repr=False)

    @classmethod
    def of(cls, layout: Layout) -> Ground:
        """That of a layout."""
        found = regions(layout, piles(layout.factory, layout.product))
        return cls(
            np.array([region.box for region in found]),
            np.array([region.robot for region in found], np.intp),
        )

    def near(self, places: Array, radii: Array) -> frozenset[int]:
        """The robots that come near to balls of some `radii` (k,) about `places` (k, 2) [m]."""
        reach = radii + APART
        (x, y), low = places.T[:, :, None], self.boxes[None]
        away = np.maximum(np.maximum(low[..., 0] - x, x - low[..., 1]), 0.0) ** 2
        away += np.maximum(np.maximum(low[..., 2] - y, y - low[..., 3]), 0.0) ** 2
        hit = (away < reach[:, None] ** 2).any(axis=0)
        return frozenset(self.robots[hit].tolist())
