"""The ways on which a robot can be relayed, and where.

A robot carries each label along one *way*, from the goal of the operation that makes it to the goal
of the next. A cut of the way is where the robot hands over to another, in line with it, which waits
there with what it has taken over. So cuts and goals are so far apart that what stands at one is
clear of what comes to the one before, carriages of every second robot, which run in one lane, are
clear of each other, and what stands at the last cut is clear of all that the robot it is brought to
carries past.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import accumulate, pairwise
from math import floor, inf

from factory.api import NOPART, Dimensions, Layout
from factory.support.decimals import up


@dataclass(frozen=True, slots=True)
class Way:
    """The way on which `robot` carries `label`: from `start` (or the farthest point reached before)
    to `end`, distances from its B end [m]. A cut is at least `step` after the start or the cut
    before, and `last` before the end."""

    label: str
    robot: int
    start: float
    end: float
    step: float
    last: float

    @property
    def most(self) -> int:
        """Largest number of cuts."""
        return max(0, floor((self.end - self.start - self.last) / self.step + 1e-9))

    def longest(self, number: int) -> float:
        """The longest piece for a number of cuts [m]."""
        at = (self.start, *self.cuts(number), self.end)
        return max(after - before for before, after in pairwise(at))

    def cuts(self, number: int) -> tuple[float, ...]:
        """A number of cuts, as even as possible, in whole millimetres."""
        length = self.end - self.start
        if not number:
            return ()
        even = min(length / (number + 1), (length - self.last) / number)
        piece = max(self.step, floor(even * 1000 + 1e-6) / 1000)
        return tuple(round(self.start + piece * (n + 1), 3) for n in range(number))


def ways(layout: Layout) -> dict[str, Way]:
    """The way of every label, of those that can be cut. A robot that is fixed goes none."""
    along = (robot for robot, path in enumerate(layout.guidepaths) if path.travels)
    every = (way for robot in along for way in _ways(layout, robot))
    return {way.label: way for way in every if way.most}


def _ways(layout: Layout, robot: int) -> Iterator[Way]:
    path, c = layout.guidepaths[robot], layout.clearance
    lanes = max(layout.factory.carriage, path.reach - path.arm + Dimensions.MAST / 2)
    at = [round(path.length - stop, 3) for stop in layout.stops(robot)]
    piles = _piles(layout, robot)
    fronts = [-inf, *(front for _, _, front in piles)]
    ends = (at[n] + max(front, before) for n, (before, front) in enumerate(pairwise(fronts)))
    reached = list(accumulate(ends, max))
    beyond = path.travel + _beyond(layout, robot)
    backwards = []
    for step in reversed(range(len(piles))):
        label, rear, front = piles[step]
        if label != NOPART:
            last = max(0.0, at[step + 1] + front - beyond) + c
            apart = max(front - rear, lanes) + c
            start = max(at[step], reached[step] - front)
            backwards.append(Way(label, robot, up(start), at[step + 1], up(apart), up(last)))
        beyond = min(beyond, at[step] + rear)
    yield from reversed(backwards)


def _piles(layout: Layout, robot: int) -> list[tuple[str, float, float]]:
    """The labels that a robot carries after each operation but the last, with their extents behind
    and ahead of the product's middle [m]."""
    extents, path = [], layout.guidepaths[robot]
    for number in layout.factory.robots[robot].operations[:-1]:
        operation = layout.factory.operations[number]
        label = operation.after[operation.robots.index(robot)]
        box = layout.payloads.get(label, (0.0, 0.0, 0.0, 0.0))
        extents.append((label, *path.frame(box)[:2]))
    return extents


def _beyond(layout: Layout, robot: int) -> float:
    """Distance ahead of A at which the place of delivery begins: the way of the carrier's payload,
    or the outfeed. A payload at a cut, with carriage and arm, is clear of it [m]."""
    path, factory, c = layout.guidepaths[robot], layout.factory, layout.clearance
    operation = factory.last(robot)
    (delivered,) = factory.deliveries(operation.carrier)
    beside = path.frame(layout.payloads[delivered])[0]
    if operation.index != factory.dropoff.index:
        return beside
    front = path.frame(layout.outgoing)[1]
    return beside - c + min(0.0, front + path.arm, front + path.reach - layout.factory.carriage / 2)
