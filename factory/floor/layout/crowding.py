"""Which regions of a layout are too near in plan, and can be taken at once.

Searches look at that before a layout is certified, and what robots do beside their programs, as
they throw things away, is kept apart so. Regions are near if they are less than a clearance apart
in one layer. They are never taken at once where one robot has both in its program, since they are
those of what it brings together. Near linear.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

import numpy as np
import shapely

from factory.floor.layout.branches import delivery
from factory.floor.layout.certificate import (
    ALWAYS,
    HAND_BODY,
    LOADS,
    NAMES,
    OUTFEED,
    RAISED,
    STATIONS,
    Fault,
    Region,
    fault,
)
from factory.floor.layout.clearance import MOST
from factory.floor.layout.crossings import embedding_faults, near
from factory.floor.layout.layout import Layout
from factory.floor.layout.meeting import TOLERANCE, meeting_faults
from factory.floor.layout.sweeps import piles_of, regions
from factory.support.boxes import Box
from factory.theory.problem.ids import OperationId


def separation(one: Box, other: Box) -> float:
    """The distance of two boxes [m]; negative: their depth of overlap."""
    x = max(other[0] - one[1], one[0] - other[1])
    y = max(other[2] - one[3], one[2] - other[3])
    if max(x, y) <= 0:
        return float(max(x, y))
    return float(np.hypot(max(x, 0.0), max(y, 0.0)))


def crowding_faults(layout: Layout) -> list[Fault]:
    """What is wrong with a layout as far as can be told without its net."""
    by_label, crowding = piles_of(layout), Crowding(layout)
    pairs = crowding.crowded(regions(layout))
    return [
        *islice(embedding_faults(layout), MOST),
        *islice((crowding.fault(*pair) for pair in pairs), MOST),
        *islice(meeting_faults(layout, by_label), MOST),
    ]


class Crowding:
    """Compares the regions of a layout, which are near within the `least` distance [m]."""

    def __init__(self, layout: Layout) -> None:
        self.layout = layout
        self.least = max(layout.clearance - TOLERANCE, 0.0)
        self._gears = [frozenset(o.robots) for o in layout.factory.operations]

    def crowded(self, swept: list[Region]) -> Iterator[tuple[Region, Region]]:
        """Pairs of regions that are too near."""
        for layer in range(len(NAMES)):
            for one, other in self.near([region for region in swept if region.layer == layer]):
                if not self.may_meet(one, other):
                    yield one, other

    def near(self, here: list[Region]) -> Iterator[tuple[Region, Region]]:
        """Pairs of one layer less than a clearance apart in plan: of different robots, or of a
        station and its own robot."""
        corners = np.array([region.box for region in here], float).reshape(-1, 4)
        cells = shapely.box(corners[:, 0], corners[:, 2], corners[:, 1], corners[:, 3])
        robot = np.array([region.robot for region in here])
        stands = np.isin([region.kind for region in here], STATIONS)
        for first, second in near(cells, "dwithin", self.least):
            kept = (robot[first] != robot[second]) | (stands[first] != stands[second])
            for i, j in zip(first[kept].tolist(), second[kept].tolist(), strict=True):
                yield here[i], here[j]

    def may_meet(self, one: Region, other: Region) -> bool:
        """Whether two regions near in plan are never taken together, or are apart in height."""
        kinds = {one.kind, other.kind}
        if one.robot == other.robot and OUTFEED in kinds:
            return self._serves(one) and self._serves(other)
        if one.robot == other.robot and HAND_BODY in kinds and not kinds.isdisjoint(RAISED):
            return True  # a feeder leaves room for the hand that takes its part (Layout.feeder)
        if not kinds.isdisjoint(RAISED) and kinds <= {*RAISED, *LOADS}:
            return max(one.z[0] - other.z[1], other.z[0] - one.z[1]) >= self.least
        together = self._over(one) == other.robot or self._over(other) == one.robot
        return kinds <= {*LOADS} and (together or not self._in(one).isdisjoint(self._in(other)))

    def _in(self, region: Region) -> frozenset[int]:
        """The robots in whose programs it is that a payload is in a region."""
        return frozenset([region.robot]) if region.mode == ALWAYS else self._gears[region.mode]

    def _over(self, region: Region) -> int:
        """The robot over whose station that of a region stands, -1 if it does not."""
        end = delivery(self.layout.factory, region.robot)
        return -1 if self.layout.factory.robots[region.robot].travels else end.carrier

    def _serves(self, region: Region) -> bool:
        """Whether the outfeed may take a region in: itself, the robot under it, the released
        product."""
        return region.kind not in LOADS or self.layout.factory.drops(OperationId(region.mode))

    def fault(self, one: Region, other: Region) -> Fault:
        """The fault of two regions that are too near."""
        c, gap = self.layout.clearance, separation(one.box, other.box)
        names = [region.named(self.layout.factory) for region in (one, other)]
        measured = (
            f"are {gap * 1000:.1f} mm apart" if gap > 0 else f"overlap by {-gap * 1000:.1f} mm"
        )
        message = (
            f"{names[0]} and {names[1]} {measured} in the layer of {NAMES[one.layer]};"
            f" {c * 1000:g} mm are needed"
        )
        return fault(self.layout.factory, message, one.robot, other.robot, lacking=c - gap)
