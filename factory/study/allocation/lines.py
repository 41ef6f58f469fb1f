"""Lines: which robots of a factory become one, for few robots and a cycle time.

Lines are filled from the output robot's down. Those that deliver to one line are dealt out, in the
order in which it asks for them, to as few lines as have time for them: each to the one that has had
the least to do, so that one comes while another goes for its next part. What robots wait for is not
counted while lines are filled; the cycle time of the net that comes out is exact for the delays,
which are estimated from sizes.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import ceil

from factory.compiler.folding import Line, count_of, delivery, fold, kind_of, sides_of
from factory.layout.durations import Pace
from factory.layout.guidepath import Box
from factory.nets.cycle_ratio import max_cycle_ratio
from factory.nets.marked import marked
from factory.plant.factory import Factory
from factory.problem.pag import NOPART
from factory.problem.robot_types import Catalogue

BETWEEN = 0.08
"""What lies between two sub-assemblies at the ends of a guidepath, beside themselves [m]."""

TOOL_WAY = 0.12
"""How far a tool comes [m]."""


@dataclass(frozen=True)
class Shift:
    """A factory with a robot for each label, and what its lines are chosen by: the `pace` of its
    robots, how far each has to go, its `ways` [m], and what it has to do in a cycle, its `work`
    [s]."""

    factory: Factory
    catalogue: Catalogue
    pace: Pace
    ways: tuple[float, ...]
    work: tuple[float, ...]

    @classmethod
    def of(
        cls, factory: Factory, catalogue: Catalogue, boxes: Mapping[str, Box], pace: Pace
    ) -> Shift:
        """That of a factory whose sub-assemblies have some boxes."""
        ways = tuple(estimated_ways(factory, boxes))
        delays = [*estimated_delays(factory, ways, pace)]
        work = tuple(sum(delays[n] for n in robot.operations) for robot in factory.robots)
        return cls(factory, catalogue, pace, ways, work)

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
        net = marked(fold(self.factory, lines, self.catalogue).net)
        idle = [0.0] * (len(net.tokens) - len(delays))
        return max_cycle_ratio(net, [*delays, *idle]).seconds

    def count(self, lines: Sequence[Line]) -> int:
        """How many robots there are with these lines, tools included."""
        return count_of(self.factory, lines)

    def targets(self, step: float) -> Iterator[float]:
        """What lines may be filled for [s]: from the longest work of one robot until nothing more
        can share a robot, each so many times the one before."""
        target, most = max(self.work), sum(self.work)
        while target < most * step:
            yield target
            target *= step

    def lines(self, target: float) -> tuple[Line, ...]:
        """As few lines as have time for their robots' work within a `target` [s]."""
        found: list[Line] = []
        queue: deque[Line] = deque([(0,)])
        while queue:
            line = queue.popleft()
            for group in _groups(self.factory, line):
                dealt = self._dealt(group, target)
                queue.extend(dealt)
                found += [one for one in dealt if len(one) > 1]
        return tuple(found)

    def _dealt(self, group: Sequence[int], target: float) -> list[Line]:
        """The robots of a group on lines, in turns."""
        farthest = self.pace.rest(max(self.ways[robot] for robot in group))
        further = {r: 2 * (farthest - self.pace.rest(self.ways[r])) for r in group}
        total = sum(self.work[robot] + further[robot] for robot in group)
        count = min(len(group), max(1, ceil(total / target - 1e-9)))
        loads, dealt = [0.0] * count, [list[int]() for _ in range(count)]
        for robot in group:
            least = min(range(count), key=lambda n: (round(loads[n], 6), n))
            loads[least] += self.work[robot] + further[robot]
            dealt[least].append(robot)
        return [tuple(line) for line in dealt if line]


def _groups(factory: Factory, line: Line) -> Iterator[list[int]]:
    """The robots that deliver to a line, tools apart, in the order in which it asks for them: those
    of each group can all share a robot."""
    kids = [
        guest
        for robot in line
        for number in factory.robots[robot].operations
        if factory.operations[number].carrier == robot
        for guest in factory.operations[number].robots
        if guest != robot
    ]
    kinds: dict[tuple[object, ...], list[int]] = {}
    for kid in kids:
        kind = kind_of(factory, kid)
        if kind[0] != "tool":
            kinds.setdefault(kind, []).append(kid)
    for group in kinds.values():
        yield from _one_sided(factory, group)


def _one_sided(factory: Factory, group: Sequence[int]) -> Iterator[list[int]]:
    """The robots of a group by the side from which they can come: those that can come from either
    go with the more of the others."""
    sides = {robot: sides_of(factory, robot) for robot in group}
    only = {side: [r for r in group if sides[r] == {side}] for side in (-1, +1)}
    most = max((-1, +1), key=lambda side: len(only[side]))
    none = [[robot] for robot in group if not sides[robot]]
    first = [r for r in group if r not in only[-most] and sides[r]]
    yield from (part for part in (first, only[-most], *none) if part)


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
