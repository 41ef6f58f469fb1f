"""Whether what stands on the floor would tip: its centre of mass beyond what it stands on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from factory.geometry.meshes import Array
from factory.planning.parts import PlacedPart

LEVEL = 5e-4
"""What is no higher than this above the lowest point [m], or LOW of the height, stands on the
floor."""

LOW = 1e-2

TIPS = 1e-5
"""A centre of mass that is no further outside than this [m] does not tip anything."""

AROUND = np.linspace(0, 2 * np.pi, 32, endpoint=False)
ROUND = np.column_stack([np.cos(AROUND), np.sin(AROUND)])
"""The directions on the floor (32, 2) in which it is asked whether units tip."""


@dataclass(frozen=True)
class Feet:
    """What units stand on: their `mass` (n,) [kg], their `centre` of mass (n, 2) on the floor, how
    `low` (n,) they reach, and how far what reaches that low does in each of the directions ROUND
    (n, 32) [m]."""

    mass: Array = field(repr=False)
    centre: Array = field(repr=False)
    low: Array = field(repr=False)
    reach: Array = field(repr=False)

    def __len__(self) -> int:
        return len(self.mass)

    def joined(self, members: Sequence[int]) -> Feet:
        """Some units as one."""
        rows = list(members)
        mass = self.mass[rows].sum()
        centre = self.mass[rows] @ self.centre[rows] / mass
        low = self.low[rows].min()
        stands = self.low[rows] <= low + LEVEL
        reach = self.reach[rows][stands].max(axis=0)
        return Feet(np.array([mass]), centre[None], np.array([low]), reach[None])

    @property
    def tips(self) -> NDArray[np.bool_]:
        """Which of them (n,) tip over if they stand by themselves."""
        return np.asarray((self.centre @ ROUND.T > self.reach + TIPS).any(axis=1))

    def grouped(self, groups: Sequence[Sequence[int]]) -> Feet:
        """Groups of units, each as one."""
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
    """What units stand on where a direction (3,) of the product is up."""
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


def overhang(parts: Sequence[PlacedPart], up: Array) -> float:
    """How far the centre of mass of some parts is outside the polygon on which they stand where a
    direction (3,) of the product is up [m]; less than 0 inside it."""
    mass = np.array([part.solid.mass for part in parts])
    centre = mass @ np.array([part.solid.centre for part in parts]) / mass.sum()
    points = np.concatenate([part.vertices for part in parts])
    heights = points @ up
    level = min(LEVEL, LOW * float(np.ptp(heights)))
    across = np.linalg.svd(up[None])[2][1:]
    return outside((points[heights <= heights.min() + level]) @ across.T, centre @ across.T)


def outside(points: Array, at: Array) -> float:
    """How far a point (2,) is outside the convex hull of points (n, 2) [m]; less than 0 in it."""
    from shapely import MultiPoint, Point

    hull, point = MultiPoint(points).convex_hull, Point(at)
    return float(hull.distance(point) or -hull.boundary.distance(point))
