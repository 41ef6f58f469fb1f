"""The places of a layout's branches as its guidepaths are bent, and which come too near.

A branch moves as a whole, with all its regions (`sweeps`). So the regions of a robot are computed
once for each of its detours, and those of two robots are compared again only if one of them has
moved.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace

import numpy as np

from factory.api import Detour, Layout, LayoutMachines, LayoutSearch, Region
from factory.support.arrays import Array, Index, Truth
from factory.support.boxes import Point2


@dataclass(frozen=True, eq=False, slots=True)
class Swept:
    """The regions of a robot with a detour: their `boxes` (n, 4), the `kinds` (n,) of region that
    they are, and how far the branch behind it is `moved` [m]."""

    boxes: Array
    kinds: Index
    moved: Point2


Bends = dict[int, Detour]
"""Detours, by robot (index)."""


class Floor:
    """The regions of a layout as its guidepaths are bent, branch by branch."""

    def __init__(self, layout: Layout) -> None:
        self.layout, self.search = layout, LayoutSearch(layout.factory, layout.product)
        self.on = self.search.carriers
        self._machines = LayoutMachines(layout)
        self._crowding = self._machines.crowding
        self._kinds, self._regions = dict[Region, int](), list[Region]()
        self._may = np.zeros((0, 0), np.int8)
        self._known = dict[tuple[int, Detour | None], Swept]()

    def swept(self, robot: int, detour: Detour | None = None) -> Swept:
        """The regions of a robot whose carrier has not moved."""
        key = robot, detour
        if key not in self._known:
            layout, swept_regions = self._machines.bent_regions(robot, detour)
            kinds = [replace(region, box=(0.0, 0.0, 0.0, 0.0)) for region in swept_regions]
            numbers = [self._kinds.setdefault(kind, len(self._kinds)) for kind in kinds]
            self._regions[:] = self._kinds
            old, new = self.layout.guidepaths[robot], layout.guidepaths[robot]
            (x, y), (x0, y0) = new.middle(new.length), old.middle(old.length)
            boxes = np.array([region.box for region in swept_regions]).reshape(-1, 4)
            self._known[key] = Swept(boxes, np.array(numbers, np.intp), (x - x0, y - y0))
        return self._known[key]

    def bent(self, bends: Bends) -> Layout:
        """The layout with bends; not certified."""
        return self._machines.bent(bends)

    def overlap(self, one: Swept, other: Swept, apart: Array) -> float:
        """By how much the regions of two robots are nearer than they may be [m], the second moved
        by a vector (2,)."""
        a, b = one.boxes[:, None], other.boxes[None] + apart[[0, 0, 1, 1]]
        depth = np.minimum(a[..., 1] - b[..., 0], b[..., 1] - a[..., 0])
        depth = np.minimum(depth, np.minimum(a[..., 3] - b[..., 2], b[..., 3] - a[..., 2]))
        depth += self._crowding.least
        i, j = np.nonzero(depth > 0.0)
        if not len(i):
            return 0.0
        kinds = one.kinds[i], other.kinds[j]
        return float(np.where(self._allowed(*kinds), 0.0, depth[i, j]).max())

    def _allowed(self, one: Index, other: Index) -> Truth:
        """Whether regions of some kinds may be near others in plan (n,)."""
        count = len(self._regions)
        if len(self._may) < count:
            grown = np.full((2 * count, 2 * count), -1, np.int8)
            grown[: len(self._may), : len(self._may)] = self._may
            self._may = grown
        for pair in {
            *zip(*(k[self._may[one, other] < 0].tolist() for k in (one, other)), strict=True)
        }:
            a, b = (self._regions[kind] for kind in pair)
            is_one_robot = a.robot == b.robot and a.stands == b.stands
            self._may[pair] = self._may[pair[::-1]] = (
                a.layer != b.layer or is_one_robot or self._crowding.may_meet(a, b)
            )
        return self._may[one, other] > 0


class Placing:
    """Where the branches of a layout are, with bends: `at` (robots, 2), how far each robot has been
    moved [m]; `swept`, its regions; `deep` (robots, robots): by how much nearer they are than they
    may be [m]; `hulls` (robots, 4): the boxes of all their regions [m]."""

    def __init__(self, ground: Floor, bends: Bends) -> None:
        self.ground, self.detours = ground, bends
        count = len(ground.on)
        self.at, self.deep = np.zeros((count, 2)), np.zeros((count, count))
        self.swept, self.hulls = list[Swept](), np.zeros((count, 4))
        for robot in range(count):
            self.swept.append(ground.swept(robot, bends.get(robot)))
            self._place(robot)
        self.look([*range(count)])

    def changed(self, robot: int, detour: Detour | None, under: list[int]) -> Placing:
        """The same with another detour of a robot, with all robots that are `under` it."""
        made = copy(self)
        made.detours = {number: bend for number, bend in self.detours.items() if number != robot}
        if detour is not None:
            made.detours[robot] = detour
        made.at, made.deep, made.hulls = self.at.copy(), self.deep.copy(), self.hulls.copy()
        made.swept = self.swept.copy()
        made.swept[robot] = self.ground.swept(robot, detour)
        for number in under:
            made._place(number)
        return made

    def _place(self, robot: int) -> None:
        carrier = self.ground.on[robot]
        if carrier >= 0:
            self.at[robot] = self.at[carrier] + self.swept[carrier].moved
        boxes, by = self.swept[robot].boxes, self.at[robot][[0, 0, 1, 1]]
        low, high = boxes[:, [0, 2]].min(axis=0), boxes[:, [1, 3]].max(axis=0)
        self.hulls[robot] = by + np.stack([low, high], axis=1).ravel()

    def look(self, robots: list[int]) -> None:
        """Compare the regions of some robots, the first of which is changed, with all others."""
        c = self.ground.layout.clearance
        a, b = self.hulls[robots][:, None], self.hulls[None]
        close = (a[..., 0] < b[..., 1] + c) & (b[..., 0] < a[..., 1] + c)
        close &= (a[..., 2] < b[..., 3] + c) & (b[..., 2] < a[..., 3] + c)
        inner = np.isin(np.arange(len(self.at)), robots[1:])
        close[1:, inner] = False
        fresh = np.ones_like(close)
        fresh[1:, inner] = False
        for row, robot in enumerate(robots):
            for other in np.flatnonzero(fresh[row]).tolist():
                deep = 0.0
                if close[row, other]:
                    apart = self.at[other] - self.at[robot]
                    deep = self.ground.overlap(self.swept[robot], self.swept[other], apart)
                self.deep[robot, other] = self.deep[other, robot] = deep

    @property
    def area(self) -> float:
        """The floor that regions take, without what is around them [m²]."""
        low, high = self.hulls.min(axis=0), self.hulls.max(axis=0)
        return float((high[1] - low[0]) * (high[3] - low[2]))
