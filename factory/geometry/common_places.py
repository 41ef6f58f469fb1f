"""Where one suction pad takes several parts, one after the other: on the top of each.

A part leaves sideways from under a pad on its top, and what hangs with its top at the height of
other pads, which are up, is below them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from factory.geometry.meshes import Array
from factory.geometry.solids import Solid
from factory.geometry.suction import EVEN, NARROWEST, SHARE, WIDEST, Corner, drawn_triangles

SPACED = 24
"""Along each side of what parts cover in plan so many places are looked at, evenly spaced; those at
the sides of parts; and those in the middle between two of these that follow each other."""

APART = 5e-4
"""Pads are at least so far from each other [m]."""

RIM = 1e-6
"""A pad touches what is no further from its rim [m]."""

FLAT = 1e-12
"""A triangle of less than half this area in plan is none [m²]."""

Rectangle = tuple[Corner, Corner]
"""The least and the greatest corner of a rectangle in plan, (2,) each [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Top:
    """What of a part is level with its highest point, in plan: `triangles` (n, 3, 2), or where it
    is nowhere flat there `edges` (k, 2, 2), which may be points; from `low` to `high` (2,) the part
    itself; its `centre` of mass (2,) [m]."""

    triangles: Array = field(repr=False)
    edges: Array = field(repr=False)
    low: Corner
    high: Corner
    centre: Corner

    @classmethod
    def of(cls, solid: Solid, by: Corner) -> Top:
        """That of a part that is moved in plan (2,) [m]."""
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
        """Whether a pad with its middle at places (n, 2) is on this top and stands out over no side
        of the part. What is flat is under its middle."""
        within = (places - radius >= self.low) & (places + radius <= self.high)
        found = np.asarray(within.all(axis=1))
        on = self._over if len(self.triangles) else self._beside
        found[found] = on(places[found], radius)
        return found

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
    """The middle of a pad in plan (2,), its radius [m], and the parts that it takes, by number."""

    at: Corner
    radius: float
    parts: tuple[int, ...]


def common_places(tops: Sequence[Top], taken: Rectangle) -> list[CommonPlace]:
    """As few places as found, a pad's breadth apart and out of the rectangle that is `taken`, at
    one of which each part can be taken; of as many those of the largest pads. Nothing where there
    are none."""
    sizes = np.array([top.high - top.low for top in tops])
    widest = max(min(WIDEST, SHARE * float(sizes.min())), NARROWEST)
    found = (_chosen(tops, taken, radius) for radius in (widest, widest / 2, widest / 4))
    return min((places for places in found if places), key=len, default=[])


def _chosen(tops: Sequence[Top], taken: Rectangle, radius: float) -> list[CommonPlace]:
    """Places of pads with a radius: each takes as many of the parts that are left as any can, as
    near to their centres of mass as can be."""
    places = _looked_at(tops, radius)
    free = ((places + radius <= taken[0]) | (places - radius >= taken[1])).any(axis=1)
    places = places[free]
    takes = np.array([top.takes(places, radius) for top in tops])
    off = np.array([np.linalg.norm(places - top.centre, axis=1) for top in tops])
    left, found = np.ones(len(tops), bool), list[CommonPlace]()
    while left.any() and takes.size:
        count = (takes & left[:, None]).sum(axis=0)
        best = int(np.lexsort(((off * (takes & left[:, None])).sum(axis=0), -count))[0])
        if not count[best]:
            return []
        chosen = np.flatnonzero(takes[:, best] & left)
        found.append(CommonPlace(places[best], radius, tuple(chosen.tolist())))
        left[chosen] = False
        takes[:, np.linalg.norm(places - places[best], axis=1) < 2 * radius + APART] = False
    return [] if left.any() else found


def _looked_at(tops: Sequence[Top], radius: float) -> Array:
    """Places (n, 2) that are looked at for pads of a radius."""
    axes = []
    for axis in (0, 1):
        ends = [top.low[axis] + radius for top in tops] + [top.high[axis] - radius for top in tops]
        ends += [float(top.edges[:, :, axis].mean()) for top in tops if len(top.edges)]
        sides = np.unique(np.round(ends, 6))
        between = (sides[:-1] + sides[1:]) / 2
        axes.append(np.concatenate([sides, between, np.linspace(sides[0], sides[-1], SPACED)]))
    return np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
