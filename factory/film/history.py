"""The mode of each robot over time, from the firings alone: what the panels show."""

from __future__ import annotations

from bisect import bisect_right
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import inf

from factory.engine.record.failures import Death, Failing, Stood, deaths
from factory.engine.record.subject import MonitorSubject
from factory.floor.layout.durations import Pace
from factory.support.arrays import Array
from factory.theory.nets.undone import Entry, Undone
from factory.theory.plant.factory import Factory
from factory.theory.plant.operation import Operation

TIE = 1e-9
"""Times that are no further apart are the same [s]."""


@dataclass(frozen=True, slots=True)
class Spell:
    """A robot's stay at place `step` of its gear, from `start` to `end` [s]; `number` counts the
    places that the robot has passed, and goes back if operations are undone (`undone`: that time
    [s])."""

    number: int
    step: int
    start: float
    end: float = inf
    undone: float = inf

    @property
    def operation(self) -> bool:
        """Whether it is in an operation, not waiting before the next. The places of a gear
        alternate."""
        return self.step % 2 == 1


class History:
    """Grows entry by entry, in the order of time; it can be asked for any time up to now. What
    fires at a time shows after it, as in a log, whose state at a time is before what fires then.

    `events`: what has fired, each at one of `times` [s]; `undone`: what of that was undone, and
    when; `taken`: how many entries. `failings`: what failed; `standing`: from when on [s] which
    robots (index) stand.
    """

    def __init__(self, subject: MonitorSubject) -> None:
        self.subject, self.factory = subject, subject.factory
        gears = self.factory.net.gears
        self.spells: list[list[Spell]] = []
        for gear in gears:
            step = next(i for i, place in enumerate(gear.places) if place in subject.start)
            self.spells.append([Spell(0, step, 0.0)])
        self.times: list[float] = []
        self.events: list[int] = []
        self.undone: list[tuple[float, int]] = []
        self.fired = Counter(subject.counts)
        self.taken = 0
        self.failings: list[Failing] = []
        self.standing: list[tuple[float, frozenset[int]]] = []

    def add(self, time: float, entry: Entry) -> None:
        """The next entry of a record: a transition fires, or some are undone."""
        self.taken += 1
        number = self.factory.net.threaded.net.transition_index
        if isinstance(entry, Undone):
            self.undo(time - 2 * TIE, [number[name] for name in entry.transitions])
        else:
            self.fire(time, number[entry])

    def fire(self, time: float, event: int) -> None:
        """A transition fires: its robots go on to the next place of their gears."""
        for robot in self.factory.operations[event // 2].robots:
            self._go(robot, time, 1)
        self.times.append(time)
        self.events.append(event)
        self.fired[event] += 1

    def undo(self, time: float, events: Sequence[int]) -> None:
        """Transitions fire backwards, each as often as it is there: their robots go back to where
        they were before them, and what they have done since is undone."""
        back = Counter(r for e in events for r in self.factory.operations[e // 2].robots)
        for robot, places in back.items():
            self._go(robot, time, -places)
            spells, now = self.spells[robot], self.spells[robot][-1].number
            spells[:-1] = [
                replace(spell, undone=min(spell.undone, time)) if spell.number > now else spell
                for spell in spells[:-1]
            ]
        self.undone += [(time, event) for event in events]
        self.fired.subtract(events)

    def _go(self, robot: int, time: float, places: int) -> None:
        """Move a robot by a number of places in its gear at a time."""
        spells, length = self.spells[robot], len(self.factory.net.gears[robot].places)
        last = spells[-1]
        spells[-1] = replace(last, end=time)
        spells.append(Spell(last.number + places, (last.step + places) % length, time))

    def stand(self, stood: Sequence[Stood]) -> None:
        """Note the robots that stood still up to now."""
        for start, names in stood[len(self.standing) :]:
            self.standing.append((start, frozenset(self.index[name] for name in names)))

    @cached_property
    def index(self) -> Mapping[str, int]:
        """The number of each robot."""
        return {robot.name: robot.index for robot in self.factory.robots}

    def stood(self, robot: int, since: float, time: float) -> list[tuple[float, float]]:
        """Intervals in which a robot stood still, between two times [s]."""
        spans = list[tuple[float, float]]()
        for number, (start, robots) in enumerate(self.standing):
            end = self.standing[number + 1][0] if number + 1 < len(self.standing) else inf
            if robot in robots and start < time - TIE and end > since:
                spans.append((max(start, since), min(end, time)))
        return spans

    def stands(self, time: float) -> frozenset[int]:
        """The robots that stand still at a time."""
        before = bisect_right(self.standing, time - TIE, key=lambda pair: pair[0])
        return self.standing[before - 1][1] if before else frozenset()

    def deaths(self) -> list[Death]:
        """All known deaths."""
        return deaths(self.failings)

    def dead(self, time: float) -> frozenset[int]:
        """The robots that are known to be dead at a time, and not yet replaced."""
        return frozenset(
            self.index[one.robot] for one in self.deaths() if one.start < time - TIE < one.end
        )

    def failed(self, since: float, time: float) -> list[Failing]:
        """The failures from one time until before another."""
        return [one for one in self.failings if since <= one.t < time - TIE]

    def catch_up(self, entries: Sequence[tuple[float, Entry]], now: float) -> None:
        """Take over the entries of a record up to now. What is undone shows at its own time: a tick
        undoes it after the world has gone on."""
        while self.taken < len(entries):
            time, entry = entries[self.taken]
            if time >= now + (TIE if isinstance(entry, Undone) else -TIE):
                return
            self.add(time, entry)

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
        """The firings from one time until before another: time and transition."""
        first = bisect_right(self.times, since)
        last = bisect_right(self.times, time - TIE)
        return list(zip(self.times[first:last], self.events[first:last], strict=True))

    def counts(self, time: float) -> Counter[int]:
        """How often each transition has fired before a time, and was not undone."""
        counts = Counter(self.fired)
        for event in self.events[bisect_right(self.times, time - TIE) :]:
            counts[event] -= 1
        for when, event in self.undone:
            counts[event] += when > time - TIE
        return counts


class OperationProgress:
    """Progress of each operation, from the remaining paths of its robots.

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
        way, goals = self.ways[operation.index], self.subject.goals[operation.index]
        left = max(abs(goal - x[r]) for goal, r in zip(goals, operation.robots, strict=True))
        gone = 1.0 - min(left / way, 1.0) if way else 1.0
        travel = self.pace.rest(way)
        if not operation.dwell:
            return gone
        dwelt = min(max(elapsed - travel * gone, 0.0) / operation.dwell, 1.0) * (gone > 0.99)
        return (travel * gone + operation.dwell * dwelt) / (travel + operation.dwell)

    def expected(self, operation: Operation) -> float:
        """Approximate duration of an operation [s]."""
        return self.pace.rest(self.ways[operation.index]) + operation.dwell

    @cached_property
    def ways(self) -> tuple[float, ...]:
        """Longest path of a robot in each operation [m]."""
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
    """Number of operations between each operation and the dropoff."""
    depth = [0] * len(factory.operations)
    for operation in (*factory.dropoffs, *factory.making):
        parent = factory.parents[operation.index]
        depth[operation.index] = 0 if parent < 0 else depth[parent] + 1
    return tuple(depth)
