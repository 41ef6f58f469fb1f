"""Lines: which robots of a factory become one, for few robots and a cycle time.

Lines are filled as `bundles.py` says. The cycle time of the net that comes out is exact for the
delays, which are estimated from sizes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import inf

from factory.compiler.folding import Line, count_of, delivery, folded
from factory.layout.durations import Pace
from factory.layout.guidepath import Box
from factory.nets.cycle_ratio import max_cycle_ratio
from factory.nets.marked import marked
from factory.plant.factory import Factory
from factory.problem.pag import NOPART
from factory.problem.robot_types import Catalogue
from factory.study.allocation.bundles import Filling, bundled

BETWEEN = 0.08
"""What lies between two sub-assemblies at the ends of a guidepath, beside themselves [m]."""

SLACKS = (inf, 1.5, 0.6, 0.25, 0.0)
"""By which shares of their own work tours may be longer."""

TOOL_WAY = 0.12
"""How far a tool comes [m]."""


@dataclass(frozen=True)
class Shift:
    """A factory with a robot for each label, and what its lines are chosen by: the `pace` of its
    robots, how far each has to go, its `ways` [m], how long operations take then, their `delays`
    [s], and what each robot has to do in a cycle, its `work` [s]."""

    factory: Factory
    catalogue: Catalogue
    pace: Pace
    ways: tuple[float, ...]
    delays: tuple[float, ...]
    work: tuple[float, ...]

    @classmethod
    def of(
        cls, factory: Factory, catalogue: Catalogue, boxes: Mapping[str, Box], pace: Pace
    ) -> Shift:
        """That of a factory whose sub-assemblies have some boxes."""
        ways = tuple(estimated_ways(factory, boxes))
        delays = tuple(estimated_delays(factory, ways, pace))
        work = tuple(sum(delays[n] for n in robot.operations) for robot in factory.robots)
        return cls(factory, catalogue, pace, ways, delays, work)

    def seconds(self, lines: Sequence[Line]) -> float:
        """The cycle time with these lines, by estimated delays [s]. Where robots share a line, all
        go as far as the one that has to go farthest."""
        if not lines:
            return max(self.work)
        ways = list(self.ways)
        for line in lines:
            farthest = max(self.ways[robot] for robot in line)
            for robot in line:
                ways[robot] = farthest
        delays = [*estimated_delays(self.factory, ways, self.pace)]
        net = marked(folded(self.factory, lines, self.catalogue).net)
        idle = [0.0] * (len(net.tokens) - len(delays))
        return max_cycle_ratio(net, [*delays, *idle]).seconds

    def count(self, lines: Sequence[Line]) -> int:
        """How many robots there are with these lines, tools included."""
        return count_of(self.factory, lines)

    def fillings(self, step: float, slacks: Sequence[float] = SLACKS) -> Iterator[Filling]:
        """What lines may be filled for: from the longest work of one robot until nothing more can
        share a robot, each so many times the one before."""
        limit, most = max(self.work), sum(self.work)
        while limit < most * step:
            for slack in slacks:
                yield Filling(limit, slack)
            limit *= step

    def lines(self, filling: Filling) -> tuple[Line, ...]:
        """The lines that are filled so."""
        return tuple(bundled(self.factory, self.delays, filling).lines())


def estimated_ways(factory: Factory, boxes: Mapping[str, Box]) -> list[float]:
    """How far each robot of a factory with one for each label has to go to where it delivers, from
    the sizes of sub-assemblies [m]: past what is joined there, and as far as it takes for what
    delivers to those that deliver to it, which lies along its own way."""

    def size(label: str) -> float:
        xlo, xhi, ylo, yhi = boxes[label]
        return max(xhi - xlo, yhi - ylo)

    ways = [TOOL_WAY] * len(factory.robots)
    beside = [0.0] * len(factory.robots)
    before = [0.0] * len(factory.robots)
    for robot in reversed(range(len(factory.robots))):
        last = delivery(factory, robot)
        label = last.before[last.robots.index(robot)]
        if label != NOPART:
            made = label if last.index == factory.dropoff.index else last.label
            past = (size(label) + size(made)) / 2 + BETWEEN
            ways[robot] = max(past, before[robot] + size(made) / 2)
        carrier = last.carrier
        beside[carrier] = max(beside[carrier], ways[robot] + BETWEEN)
        before[carrier] = max(before[carrier], beside[robot])
    return ways


def estimated_delays(factory: Factory, ways: Sequence[float], pace: Pace) -> Iterator[float]:
    """How long each operation takes [s] if its robots (of a factory with one for each label) have
    to go so far [m]: as long as the one that goes farthest."""
    for operation in factory.operations:
        guests = [robot for robot in operation.robots if robot != operation.carrier]
        longest = max(ways[robot] for robot in guests or [operation.carrier])
        stroke = operation.approach.stroke if operation.approach and operation.lowered >= 0 else 0.0
        yield pace.rest(longest) + pace.rest(stroke) + operation.dwell + pace.lost


def labels_on(factory: Factory, lines: Sequence[Line]) -> tuple[tuple[str, ...], ...]:
    """Lines by the labels that their robots bring."""
    found = []
    for line in lines:
        ends = ((delivery(factory, robot), robot) for robot in line)
        found.append(tuple(last.before[last.robots.index(robot)] for last, robot in ends))
    return tuple(found)
