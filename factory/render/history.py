"""The mode of each robot over time, from the firings alone: what the panels show."""

from __future__ import annotations

from bisect import bisect_right
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import inf

from factory.control.mode import Array
from factory.layout.durations import Pace
from factory.plant.factory import Factory, Operation
from factory.record.monitor.subject import MonitorSubject

TIE = 1e-9
"""Times that are no further apart are the same [s]."""


@dataclass(frozen=True, slots=True)
class Spell:
    """A robot's stay at place `step` of its gear, from `start` to `end` [s]; `number` counts the
    spells of the robot."""

    number: int
    step: int
    start: float
    end: float = inf

    @property
    def operation(self) -> bool:
        """Whether it is in an operation, not waiting before the next. The places of a gear
        alternate."""
        return self.step % 2 == 1


class History:
    """Grows firing by firing, in the order of time; it can be asked for any time up to now. What
    fires at a time shows after it, as in a log, whose state at a time is before what fires then."""

    def __init__(self, subject: MonitorSubject) -> None:
        self.subject, self.factory = subject, subject.factory
        gears = self.factory.net.gears
        self.spells: list[list[Spell]] = []
        for gear in gears:
            step = next(i for i, place in enumerate(gear.places) if place in subject.start)
            self.spells.append([Spell(0, step, 0.0)])
        self.times: list[float] = []
        self.events: list[int] = []
        self.fired = Counter(subject.counts)

    def fire(self, time: float, event: int) -> None:
        """A transition fires: its robots go on to the next place of their gears."""
        for robot in self.factory.operations[event // 2].robots:
            last = self.spells[robot][-1]
            step = (last.step + 1) % len(self.factory.net.gears[robot].places)
            self.spells[robot][-1] = Spell(last.number, last.step, last.start, time)
            self.spells[robot].append(Spell(last.number + 1, step, time))
        self.times.append(time)
        self.events.append(event)
        self.fired[event] += 1

    def catch_up(self, firings: Sequence[tuple[float, int]], now: float) -> None:
        """Fire what has fired before now."""
        while len(self.events) < len(firings) and firings[len(self.events)][0] < now - TIE:
            self.fire(*firings[len(self.events)])

    def at(self, robot: int, time: float) -> Spell:
        """The spell that a robot is in at a time."""
        spells = self.spells[robot]
        after = bisect_right(spells, time - TIE, key=lambda spell: spell.start)
        return spells[max(after, 1) - 1]

    def since(self, robot: int, time: float) -> list[Spell]:
        """The spells of a robot that had not ended by a time."""
        spells = self.spells[robot]
        first = bisect_right(spells, time, key=lambda spell: spell.end)
        return spells[first:]

    def recent(self, since: float, time: float) -> list[tuple[float, int]]:
        """What fired from one time and before another: when, and which transition."""
        first = bisect_right(self.times, since)
        last = bisect_right(self.times, time - TIE)
        return list(zip(self.times[first:last], self.events[first:last], strict=True))

    def counts(self, time: float) -> Counter[int]:
        """How often each transition has fired before a time."""
        found = Counter(self.fired)
        for event in self.events[bisect_right(self.times, time - TIE) :]:
            found[event] -= 1
        return found


class OperationProgress:
    """How far each operation is, by the way its robots have still to go.

    An operation with a dwell takes the time it would take to get there, then the dwell; what its
    robots still have to go shows the one, the clock the other. Goes up to 1, and never back in a
    run that goes straight to its goals.
    """

    def __init__(self, subject: MonitorSubject) -> None:
        self.subject, self.factory = subject, subject.factory
        self.pace = Pace.of(subject.settings)

    def of(self, operation: Operation, x: Array, elapsed: float) -> float:
        """The share of an operation that is done, with robots at `x` [m] so long after its start
        [s]."""
        way = self.ways[operation.index]
        left = max(abs(self.subject.goal(operation, r) - x[r]) for r in operation.robots)
        gone = 1.0 - min(left / way, 1.0) if way else 1.0
        travel = self.pace.rest(way)
        if not operation.dwell:
            return gone
        dwelt = min(max(elapsed - travel * gone, 0.0) / operation.dwell, 1.0) * (gone > 0.99)
        return (travel * gone + operation.dwell * dwelt) / (travel + operation.dwell)

    def expected(self, operation: Operation) -> float:
        """About how long an operation takes [s]."""
        return self.pace.rest(self.ways[operation.index]) + operation.dwell

    @cached_property
    def ways(self) -> tuple[float, ...]:
        """For each operation how far the robot with the longest way goes [m]."""
        return tuple(
            max(abs(self.subject.goal(o, r) - self._from(o, r)) for r in o.robots)
            for o in self.factory.operations
        )

    def _from(self, operation: Operation, robot: int) -> float:
        """The goal of the robot's operation before [m]."""
        gear = self.factory.robots[robot].operations
        before = self.factory.operations[gear[gear.index(operation.index) - 1]]
        return self.subject.goal(before, robot)


def followed(factory: Factory, counts: Mapping[int, int]) -> Operation:
    """The operation nearest to the end in which the product furthest on its way is, or was
    last."""
    over = [counts.get(dropoff.end, 0) for dropoff in factory.dropoffs]
    begun = [o for o in factory.operations if counts.get(o.start, 0) > over[o.turn]]
    depth = depths(factory)
    return min(begun or factory.leaves, key=lambda o: (depth[o.index], o.index))


def depths(factory: Factory) -> tuple[int, ...]:
    """For each operation how many come after it up to the dropoff."""
    found = [0] * len(factory.operations)
    for operation in (*factory.dropoffs, *factory.making):
        parent = factory.parents[operation.index]
        found[operation.index] = 0 if parent < 0 else found[parent] + 1
    return tuple(found)
