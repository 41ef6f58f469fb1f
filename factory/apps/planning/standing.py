"""Stability: a body on the floor tips over if its centre of mass is outside its support."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from factory.apps.planning.parts import PlacedPart
from factory.support.arrays import Array

LEVEL = 5e-4
"""The height above the lowest point [m], or the share LOW of the total height, up to which points
rest on the floor."""

LOW = 1e-2

TIPS = 1e-5
"""The tolerance of the centre of mass outside the support [m]."""

STEADY = 0.15
"""A product stands steadily if it still stands on a floor of this slope."""

AROUND = np.linspace(0, 2 * np.pi, 32, endpoint=False)
ROUND = np.column_stack([np.cos(AROUND), np.sin(AROUND)])
"""The horizontal directions (32, 2) in which tipping is tested."""


@dataclass(frozen=True)
class Feet:
    """The support of units: their `mass` (n,) [kg], their `centre` of mass (n, 2) on the floor,
    their `low` point (n,), and the `reach` (n, 32) of their lowest points in each of the directions
    ROUND [m]."""

    mass: Array = field(repr=False)
    centre: Array = field(repr=False)
    low: Array = field(repr=False)
    reach: Array = field(repr=False)

    def __len__(self) -> int:
        return len(self.mass)

    def joined(self, members: Sequence[int]) -> Feet:
        """Some units as one body."""
        rows = list(members)
        mass = self.mass[rows].sum()
        centre = self.mass[rows] @ self.centre[rows] / mass
        low = self.low[rows].min()
        stands = self.low[rows] <= low + LEVEL
        reach = self.reach[rows][stands].max(axis=0)
        return Feet(np.array([mass]), centre[None], np.array([low]), reach[None])

    @property
    def tips(self) -> NDArray[np.bool_]:
        """Which units (n,) tip over by themselves."""
        return np.asarray((self.centre @ ROUND.T > self.reach + TIPS).any(axis=1))

    def grouped(self, groups: Sequence[Sequence[int]]) -> Feet:
        """Groups of units, each as one body."""
        made = [self.joined(group) for group in groups]
        tables = ((f.mass for f in made), (f.centre for f in made), (f.low for f in made))
        mass, centre, low = (np.concatenate([*table]) for table in tables)
        return Feet(mass, centre, low, np.concatenate([f.reach for f in made]))

    def subsets(self) -> NDArray[np.bool_]:
        """Which subsets of the units, as bit masks, tip over (2**n,)."""
        size = 1 << len(self)
        mass, moment = np.zeros(size), np.zeros((size, 2))
        low, reach = np.full(size, np.inf), np.full((size, len(ROUND)), -np.inf)
        for unit in range(len(self)):
            here, before = slice(1 << unit, 2 << unit), slice(0, 1 << unit)
            mass[here] = mass[before] + self.mass[unit]
            moment[here] = moment[before] + self.mass[unit] * self.centre[unit]
            low[here] = np.minimum(low[before], self.low[unit])
        for unit in range(len(self)):
            stands = (np.arange(size) >> unit & 1 == 1) & (self.low[unit] <= low + LEVEL)
            reach[stands] = np.maximum(reach[stands], self.reach[unit])
        mass[0], reach[0] = 1.0, 0.0
        return Feet(mass, moment / mass[:, None], low, reach).tips


def feet(units: Sequence[Sequence[PlacedPart]], up: Array) -> Feet:
    """The support of units if a direction (3,) of the product is up."""
    across = np.linalg.svd(up[None])[2][1:]
    mass, centre, low, reach = [], [], [], []
    for parts in units:
        masses = np.array([part.solid.mass for part in parts])
        points = np.concatenate([part.vertices for part in parts])
        heights = points @ up
        stands = points[heights <= heights.min() + LEVEL] @ across.T
        mass.append(masses.sum())
        middle = masses @ np.array([part.solid.centre for part in parts]) / masses.sum()
        centre.append(middle @ across.T)
        low.append(heights.min())
        reach.append((stands @ ROUND.T).max(axis=0))
    return Feet(np.array(mass), np.array(centre), np.array(low), np.array(reach))


def overhang(parts: Sequence[PlacedPart], up: Array, slope: float = 0.0) -> float:
    """The distance [m] of the centre of mass of some parts outside their support polygon if a
    direction (3,) of the product is up, and the floor falls by a slope in any direction; negative
    inside it."""
    mass = np.array([part.solid.mass for part in parts])
    centre = mass @ np.array([part.solid.centre for part in parts]) / mass.sum()
    points = np.concatenate([part.vertices for part in parts])
    heights = points @ up
    level = min(LEVEL, LOW * float(np.ptp(heights)))
    across = np.linalg.svd(up[None])[2][1:]
    off = outside((points[heights <= heights.min() + level]) @ across.T, centre @ across.T)
    return off + slope * float(centre @ up - heights.min())


def outside(points: Array, at: Array) -> float:
    """The distance [m] of a point (2,) outside the convex hull of points (n, 2); negative inside
    it."""
    from shapely import MultiPoint, Point

    hull, point = MultiPoint(points).convex_hull, Point(at)
    return float(hull.distance(point) or -hull.boundary.distance(point))
