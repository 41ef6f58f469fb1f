"""Lines: which robots of a factory are merged into one, for few robots and a cycle time.

`bundles.py` fills the lines. The cycle time of the resulting net is exact for its delays, which are
estimated from sizes.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf

import numpy as np

from factory.api import Catalogue, Factory, Finder, MarkedNet, Matings, Node, Pace, Plan, Product
from factory.apps.few_robots.bundles import BETWEEN, LANE, Filling, SizeTiming, bundled
from factory.apps.few_robots.folding import Line, count_of, fold, folded
from factory.support.allowance import Allowance
from factory.support.boxes import Box
from factory.theory.nets.cycle_ratio import max_cycle_ratio

SLACKS = (inf, 1.5, 0.6, 0.25, 0.0)
"""Waits of tours over their own work, from long to short."""


@dataclass(frozen=True)
class Shift:
    """A factory with one robot for each label, whose lines are to be chosen, with its `timing`; the
    estimated time of each robot in operations in a cycle, its `work` [s]. `forest`: the shift of
    the products of a mix, each made by robots of its own."""

    timing: SizeTiming
    catalogue: Catalogue
    work: tuple[float, ...]
    forest: Shift | None = None

    @classmethod
    def of(
        cls,
        factory: Factory,
        catalogue: Catalogue,
        boxes: Mapping[str, Box],
        pace: Pace,
        forest: Shift | None = None,
    ) -> Shift:
        """The shift of a factory, with the `boxes` of its sub-assemblies."""
        timing = SizeTiming.of(factory, boxes, pace)
        delays = estimated_delays(timing)
        work = tuple(sum(delays[n] for n in robot.operations) for robot in factory.robots)
        return cls(timing, catalogue, work, forest)

    def seconds(self, lines: Sequence[Line]) -> float:
        """The cycle time with these lines, by estimated delays: the mean of the units [s]."""
        if not lines:
            return max(self.work) / self.timing.factory.period
        made = folded(self.timing.factory, lines, self.catalogue)
        delays = estimated_delays(replace(self.timing, factory=made))
        net = MarkedNet.of(made.net)
        idle = [0.0] * (len(net.tokens) - len(delays))
        return max_cycle_ratio(net, [*delays, *idle]).seconds / made.period

    def count(self, lines: Sequence[Line]) -> int:
        """Number of robots with these lines, tools included."""
        return count_of(self.timing.factory, lines)

    def fillings(self, step: float, slacks: Sequence[float] = SLACKS) -> Iterator[Filling]:
        """Fillings to try: limits from the longest work of one robot, each `step` times the one
        before, until all could share one robot."""
        work = (self.forest or self).work
        limit, most = max(work), sum(work)
        while limit < most * step:
            for slack in slacks:
                yield Filling(limit, slack)
                yield Filling(limit, slack, onward=True)
            limit *= step

    def filled(
        self, step: float, slacks: Sequence[float] = SLACKS, briefly: bool = False
    ) -> Iterator[tuple[Filling, tuple[Line, ...]]]:
        """The `fillings` to try, each with its lines; `briefly`: limits no greater than the first
        that gives the lines of no limit at all."""
        unlimited, settled = dict[Filling, tuple[Line, ...]](), set[Filling]()
        for filling in self.fillings(step, slacks):
            Allowance.heed()
            without = replace(filling, limit=inf)
            if without in settled:
                continue
            lines = self.lines(filling)
            yield filling, lines
            if briefly:
                if without not in unlimited:
                    unlimited[without] = self.lines(without)
                if lines == unlimited[without]:
                    settled.add(without)

    def lines(self, filling: Filling) -> tuple[Line, ...]:
        """The lines for a filling. Robots of a mix are on one line where their tours for some
        product are."""
        if self.forest is not None:
            turns = self.timing.factory.plan.turns
            on = [max(robots) for robots in zip(*turns, strict=True)]
            return joined({*map(on.__getitem__, line)} for line in self.forest.lines(filling))
        return tuple(x for bundle in bundled(self.timing, filling) for x in bundle.lines())

    def plan(self, filling: Filling) -> Plan:
        """The plan with the lines for a filling."""
        return fold(self.timing.factory, self.lines(filling), self.catalogue)


def joined(sets: Iterable[set[int]]) -> tuple[Line, ...]:
    """The lines of robots that are in one of some sets together, or in a row of them."""
    lines = list[set[int]]()
    for one in sets:
        whole = one.union(*(other for other in lines if one & other))
        lines = [other for other in lines if not one & other] + [whole]
    return tuple(tuple(sorted(line)) for line in lines if len(line) > 1)


def _ways(timing: SizeTiming) -> tuple[list[float], list[float]]:
    """How far each robot goes to where it delivers [m], and where that is along the path of the
    robot that it delivers to [m]. A robot goes past what is joined, and its path has room for all
    that delivers to it, side by side from either side, with what delivers to those."""
    factory, count = timing.factory, len(timing.factory.robots)
    out, at, beside = [0.0] * count, [0.0] * count, [0.0] * count
    for robot in reversed(range(count)):
        taken = 0.0
        for guest in _guests(factory, robot):
            at[guest] = taken
            taken += max(LANE, 2 * beside[guest]) / 2
            beside[robot] = max(beside[robot], out[guest] + BETWEEN)
        past = max(timing.past(robot, tour) for tour in factory.tours[robot])
        out[robot] = max(past, BETWEEN + taken)
    return out, at


def _guests(factory: Factory, robot: int) -> list[int]:
    """The robots that deliver to a robot, or come to it with a tool, in the order of its
    program."""
    operations = (factory.operations[number] for number in factory.robots[robot].operations)
    guests = (r for o in operations if o.carrier == robot for r in o.robots if r != robot)
    return list(dict.fromkeys(guests))


def estimated_delays(timing: SizeTiming) -> list[float]:
    """Duration of each operation of a factory [s]: that of the robot with the longest way; the
    carrier's way begins at its previous stop."""
    factory, (out, at) = timing.factory, _ways(timing)
    stands = [0.0] * len(factory.operations)
    for robot in factory.robots:
        here = 0.0
        for number in robot.operations:
            operation = factory.operations[number]
            if operation.carrier != robot.index or len(operation.robots) == 1:
                here = 0.0
                continue
            there = max(at[guest] for guest in operation.robots if guest != robot.index)
            stands[number], here = abs(there - here), there
    delays = []
    for operation in factory.operations:
        guests = [robot for robot in operation.robots if robot != operation.carrier]
        longest = max(out[robot] for robot in guests or [operation.carrier])
        delays.append(timing.takes(operation.index, max(longest, stands[operation.index])))
    return delays


@dataclass(frozen=True, slots=True)
class Admitted:
    """The best levels (`findings`) of one operation: its inputs `slides` along x and y from the
    better side; the first, or the last of them is lowered (`lowers`)."""

    slides: tuple[int, int] = (Matings.LEVEL.STRICT, Matings.LEVEL.STRICT)
    lowers: tuple[int, int] = (Matings.LEVEL.STRICT, Matings.LEVEL.STRICT)


def admitted(nodes: Mapping[str, Node], product: Product) -> Mapping[str, Admitted]:
    """The levels of each operation with two inputs or more, by its label, whichever robot holds the
    pile: the choice of forms is made from them. As costly as `matings` twice."""
    finder = Finder.of(product, nodes)
    meetings = finder.meetings.all
    if not meetings:
        return {}
    count = len(meetings)
    every = np.ones(count, bool)
    slides = [finder.along(axis, every).levels(count)[0].max(axis=1) for axis in (0, 1)]
    lowers = finder.lowering(every).levels(count)[0]
    rows = zip(meetings, *(s.tolist() for s in slides), lowers.tolist(), strict=True)
    return {m.label: Admitted((x, y), (first, last)) for m, x, y, (first, last) in rows}
