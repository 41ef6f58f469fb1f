"""Places at which one suction pad takes several parts one after the other, on the top of each.

A part leaves sideways from under the pad on its top. A part that hangs with its top at the height
of other pads, which are raised, is below them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from factory.floor.geometry.solids import Solid
from factory.floor.geometry.suction import EVEN, NARROWEST, SHARE, WIDEST, Corner, drawn_triangles
from factory.support.arrays import Array

SPACED = 24
"""The number of evenly spaced candidates along each side of the area of the parts; further
candidates are at the sides of parts, and midway between two adjacent ones."""

APART = 5e-4
"""The least gap between pads [m]."""

RIM = 1e-6
"""The tolerance at the rim of a pad [m]."""

FLAT = 1e-12
"""Triangles with less than half this area in plan are ignored [m²]."""

Rectangle = tuple[Corner, Corner]
"""The least and the greatest corner of a rectangle in plan, (2,) each [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Top:
    """The top of a part in plan: the `triangles` (n, 3, 2) that are level with its highest point
    or, if there are none, the `edges` (k, 2, 2), which may be points; the box of the part from
    `low` to `high` (2,), and its `centre` of mass (2,) [m]."""

    triangles: Array = field(repr=False)
    edges: Array = field(repr=False)
    low: Corner
    high: Corner
    centre: Corner

    @classmethod
    def of(cls, solid: Solid, by: Corner) -> Top:
        """The top of a part that is displaced in plan (2,) [m]."""
        every = drawn_triangles(solid)
        level = every[:, :, 2] >= every[:, :, 2].max() - EVEN
        plan = every[:, :, :2] + by
        (ux, uy), (vx, vy) = (plan[:, 1] - plan[:, 0]).T, (plan[:, 2] - plan[:, 0]).T
        flat = level.all(axis=1) & (np.abs(ux * vy - uy * vx) > FLAT)
        edges = np.zeros((0, 2, 2))
        if not flat.any():
            row, corner = level.nonzero()
            after = (corner + 1) % 3
            other = np.where(level[row, after], after, corner)
            edges = np.stack((plan[row, corner], plan[row, other]), axis=1)
        low, high, centre = (v[:2] + by for v in (solid.low, solid.high, solid.centre))
        return cls(plan[flat], edges, low, high, centre)

    def takes(self, places: Array, radius: float) -> NDArray[np.bool_]:
        """Whether pads with their middles at places (n, 2) are on this top, level under the middle,
        and do not protrude from the box of the part."""
        within = (places - radius >= self.low) & (places + radius <= self.high)
        takes = np.asarray(within.all(axis=1))
        on = self._over if len(self.triangles) else self._beside
        takes[takes] = on(places[takes], radius)
        return takes

    def _over(self, places: Array, _: float) -> NDArray[np.bool_]:
        """Whether places are within one of the triangles."""
        x, y = places.T[:, :, None]
        corners = [self.triangles[:, k] for k in range(3)]
        turns = [
            (b[:, 0] - a[:, 0]) * (y - a[:, 1]) - (b[:, 1] - a[:, 1]) * (x - a[:, 0])
            for a, b in zip(corners, corners[1:] + corners[:1], strict=True)
        ]
        within = (np.minimum.reduce(turns) >= 0) | (np.maximum.reduce(turns) <= 0)
        return np.asarray(within.any(axis=1))

    def _beside(self, places: Array, radius: float) -> NDArray[np.bool_]:
        """Whether edges are within a radius of places."""
        begin, way = self.edges[:, 0], self.edges[:, 1] - self.edges[:, 0]
        long = np.maximum((way**2).sum(axis=1), FLAT)
        since = places[:, None] - begin
        share = np.clip((since * way).sum(axis=2) / long, 0.0, 1.0)
        off = np.linalg.norm(since - share[:, :, None] * way, axis=2)
        return np.asarray((off <= radius + RIM).any(axis=1))


@dataclass(frozen=True, slots=True, eq=False)
class CommonPlace:
    """The middle of a pad in plan (2,), its radius [m], and the indices of the parts that it
    takes."""

    at: Corner
    radius: float
    parts: tuple[int, ...]


def common_places(tops: Sequence[Top], taken: Rectangle) -> list[CommonPlace]:
    """As few places as possible at which each part can be taken by some pad; pads do not overlap
    each other or the rectangle that is `taken`. Among equals, the larger pads. Empty if there are
    none."""
    sizes = np.array([top.high - top.low for top in tops])
    widest = max(min(WIDEST, SHARE * float(sizes.min())), NARROWEST)
    choices = (_chosen(tops, taken, radius) for radius in (widest, widest / 2, widest / 4))
    return min((places for places in choices if places), key=len, default=[])


def _chosen(tops: Sequence[Top], taken: Rectangle, radius: float) -> list[CommonPlace]:
    """Places of pads with a radius, chosen greedily: each takes as many of the remaining parts as
    possible, as near to their centres of mass as possible."""
    places = _looked_at(tops, radius)
    free = ((places + radius <= taken[0]) | (places - radius >= taken[1])).any(axis=1)
    places = places[free]
    takes = np.array([top.takes(places, radius) for top in tops])
    off = np.array([np.linalg.norm(places - top.centre, axis=1) for top in tops])
    left, chosen_places = np.ones(len(tops), bool), list[CommonPlace]()
    while left.any() and takes.size:
        count = (takes & left[:, None]).sum(axis=0)
        best = int(np.lexsort(((off * (takes & left[:, None])).sum(axis=0), -count))[0])
        if not count[best]:
            return []
        chosen = np.flatnonzero(takes[:, best] & left)
        chosen_places.append(CommonPlace(places[best], radius, tuple(chosen.tolist())))
        left[chosen] = False
        takes[:, np.linalg.norm(places - places[best], axis=1) < 2 * radius + APART] = False
    return [] if left.any() else chosen_places


def _looked_at(tops: Sequence[Top], radius: float) -> Array:
    """Candidate places (n, 2) for pads of a radius."""
    axes = []
    for axis in (0, 1):
        ends = [top.low[axis] + radius for top in tops] + [top.high[axis] - radius for top in tops]
        ends += [float(top.edges[:, :, axis].mean()) for top in tops if len(top.edges)]
        sides = np.unique(np.round(ends, 6))
        between = (sides[:-1] + sides[1:]) / 2
        axes.append(np.concatenate([sides, between, np.linspace(sides[0], sides[-1], SPACED)]))
    return np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
