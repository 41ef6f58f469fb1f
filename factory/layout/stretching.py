"""Stretching: choose free lengths and directions of the guidepaths so that nothing meets that
should not.

The guidepaths form a tree. A robot's path starts where it receives (B) and runs straight to where
it delivers (A); the paths of the robots that bring it something end on it, from its left or right.
A subtree takes a box in each layer beside its carrier's path; boxes on one side follow one another;
a path is as long as it takes to keep its own subtree clear of the path it ends on, layer by layer.
Bottom-up, linear in the number of robots.

Frames: a robot's heading is u, its side t is the heading of the robot it delivers to. So a
subtree's extent in t is its extent along the path it ends on. Every box has half a clearance around
it.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import accumulate
from math import ceil

from factory.layout.dimensions import (
    ARMS,
    CARRIAGE,
    CARRIAGES,
    LAYERS,
    MAST,
    PAYLOADS,
    POST,
    TOOL_TRAVEL,
    Clearance,
)
from factory.layout.layout import Extent
from factory.plant.factory import Factory, Operation
from factory.problem.pag import NOPART
from factory.support.errors import Diagnostic, InputError

NOTHING = float("-inf")

Sides = dict[int, int]
"""For each robot but the first: +1 where it stands on the side t of its carrier's path, else -1."""


@dataclass(frozen=True, slots=True)
class Shape:
    """What the layout must know of a robot: the box of each pile it carries, by operation, and
    of the last one, how far its carriage line is to the side, how far behind the middle its arm
    ends and its carriage is (`reach`, 2r), how far ahead its finger goes (`nest`), and how far its
    lane reaches to either side for relays (`spread`) [m]."""

    piles: Mapping[int, Extent]
    last: Extent
    offset: float
    arm: float
    reach: float
    nest: float
    tool: bool
    spread: float = 0.0


class Subtree:
    """A robot with all that brings it something, in its own frame, origin at its B station.

    By layer: `front`, the farthest extent ahead; `back`, behind; `low`, `high`, to the side;
    `travel` [m].
    """

    __slots__ = ("back", "front", "high", "low", "travel")

    def __init__(self) -> None:
        self.front, self.back = [NOTHING] * 3, [-NOTHING] * 3
        self.low, self.high = [-NOTHING] * 3, [NOTHING] * 3
        self.travel = 0.0

    def include(self, layer: int, ulo: float, uhi: float, tlo: float, thi: float) -> None:
        """Grow to contain a box in one layer."""
        self.back[layer] = min(self.back[layer], ulo)
        self.front[layer] = max(self.front[layer], uhi)
        self.low[layer] = min(self.low[layer], tlo)
        self.high[layer] = max(self.high[layer], thi)


@dataclass(frozen=True)
class Stretched:
    """The result: travel of each robot, station of each operation, side of each robot."""

    travel: list[float]
    stations: list[float]
    sides: Sides


def stretch(
    factory: Factory,
    shape: Callable[[int], Shape],
    clearance: Clearance,
    sides: Sides | None = None,
) -> Stretched:
    """Lengths and stations for given sides; chooses the sides where none are given: the longer of
    two inputs away from where the robot delivers, a later input on the side where its station comes
    sooner.
    """
    travel = [0.0] * len(factory.robots)
    stations = [0.0] * len(factory.operations)
    chosen: Sides = {} if sides is None else sides
    subtrees: list[Subtree] = [None] * len(factory.robots)  # type: ignore[list-item]
    for robot in reversed(factory.robots):
        builder = _Builder(shape(robot.index), clearance, subtrees, chosen, sides is None)
        for number in robot.operations:
            operation = factory.operations[number]
            if operation.carrier == robot.index and number != factory.dropoff.index:
                stations[number] = builder.add(operation)
        subtrees[robot.index] = builder.finish()
    for robot in factory.robots:
        travel[robot.index] = subtrees[robot.index].travel
    last = shape(0).last
    travel[0] = up(max(subtrees[0].front) - min(0.0, last[0]) + clearance.c)
    return Stretched(travel, stations, chosen)


def up(length: float) -> float:
    """The next whole millimetre: rounding up keeps things apart."""
    return round(ceil(length * 1000 - 1e-6) / 1000, 3)


class _Builder:
    """Adds the operations of one robot from its B end forward."""

    def __init__(
        self,
        shape: Shape,
        clearance: Clearance,
        subtrees: Sequence[Subtree],
        sides: Sides,
        choose: bool,
    ) -> None:
        self.shape, self.subtrees, self.sides, self.choose = shape, subtrees, sides, choose
        self.c, self.half = clearance, clearance.c / 2
        self.post = {-1: NOTHING, +1: NOTHING}
        self.strip = {side: self._strip(side) for side in (-1, +1)}
        self.frontier = {side: [NOTHING] * 3 for side in (-1, +1)}
        self.boom = NOTHING
        self.station = 0.0
        self.piles: list[tuple[float, Extent]] = []
        self.guests: list[tuple[int, float]] = []
        self.tree = Subtree()
        for layer, half in ((CARRIAGES, CARRIAGE / 2), (ARMS, MAST / 2)):
            behind = -shape.reach - half - self.half
            self._include(layer, behind, -shape.arm + self.half)

    def _strip(self, side: int) -> list[float]:
        """How far to a side the robot's own path takes the floor, by layer."""
        lane = side * self.shape.offset + self.half + self.shape.spread
        payload = NOTHING if self.shape.tool else self._payload_strip(side, self.shape.last)
        return [lane + CARRIAGE / 2, lane + MAST / 2, payload]

    def _payload_strip(self, side: int, pile: Extent) -> float:
        """How far to a side a pile reaches, and its feeder's post if there is one."""
        width = pile[3] if side > 0 else -pile[2]
        return max(width, self.post[side]) + self.half

    def _include(self, layer: int, ulo: float, uhi: float) -> None:
        """Something on the robot's own path."""
        if self.strip[1][layer] > NOTHING:
            self.tree.include(layer, ulo, uhi, -self.strip[-1][layer], self.strip[+1][layer])

    def add(self, operation: Operation) -> float:
        """Places one operation; the distance of its station from B [m]."""
        guests = [r for r in operation.robots if r != operation.carrier]
        check_guests(operation, guests)
        if not self.piles:
            self._choose_mates(guests)
            if not guests:
                self._feeder(self.shape.piles[operation.index])
        elif self.choose:
            self._choose_sides(guests)
        pile = self.shape.piles[operation.index]
        if self.piles:
            wanted = [self.station, *(self._earliest(guest) for guest in guests)]
            if len(operation.inputs) > 1:
                wanted.append(self.boom + self.c.c - pile[0])
            self.station = up(max(wanted))
        for guest in guests:
            self._take_up(guest)
        at = self.station + ahead_of(operation, self.shape.reach)
        self._include(PAYLOADS, at + pile[0] - self.half, at + pile[1] + self.half)
        self.piles.append((at, pile))
        return self.station

    def finish(self) -> Subtree:
        """The subtree, ready to be attached; a tool comes a fixed way."""
        starts = [at + pile[0] - self.half for at, pile in self.piles]
        starts = list(accumulate(reversed(starts), min))[::-1]
        for guest, station in self.guests:
            self._attach(guest, station, starts)
        if self.shape.tool:
            self.tree.travel = TOOL_TRAVEL
        return self.tree

    def _feeder(self, part: Extent) -> None:
        """A post behind the carriage's rear stop and behind the part, and a boom over the part,
        which what is put on the part later has to be clear of."""
        post = -self.c.post(self.shape.reach, part[0])
        room = POST / 2 + self.half
        for side in (-1, +1):
            self.post[side] = side * self.shape.offset + POST / 2
            self.strip[side] = [max(self.post[side] + self.half, w) for w in self._strip(side)]
        for layer in LAYERS:
            self._include(layer, post - room, post + room)
        self.boom = round((part[0] + part[1]) / 2, 3)
        self._include(PAYLOADS, post, self.boom + self.half)
        for side in (-1, +1):
            self.frontier[side][PAYLOADS] = self.boom + self.half

    def _earliest(self, guest: int) -> float:
        return self._free(guest, self.sides[guest])

    def _free(self, guest: int, side: int) -> float:
        """The least station for a guest on one side."""
        low, frontier = self.subtrees[guest].low, self.frontier[side]
        return max(frontier[layer] - low[layer] for layer in LAYERS)

    def _choose_mates(self, guests: list[int]) -> None:
        """Of two that meet here, the longer goes away from where this robot delivers."""
        if self.choose:
            ordered = sorted(guests, key=lambda g: (self._outward(g, -1), g), reverse=True)
            for guest, side in zip(ordered, (-1, +1), strict=False):
                self.sides[guest] = side

    def _choose_sides(self, guests: list[int]) -> None:
        for guest, other in zip(guests, (None, *guests), strict=False):
            if other is not None:
                self.sides[guest] = -self.sides[other]
                continue
            left, right = (max(self._free(guest, side), self.station) for side in (-1, +1))
            self.sides[guest] = -1 if left <= right else +1

    def _outward(self, guest: int, side: int) -> float:
        return self._travel(guest, self.strip[side]) - min(self.subtrees[guest].back)

    def _travel(self, guest: int, strip: Sequence[float]) -> float:
        """How far a guest must come so that, at its B end, its subtree is clear of this path."""
        tree = self.subtrees[guest]
        clear = max(tree.front[layer] + strip[layer] for layer in LAYERS)
        return up(max(tree.travel, clear, self.c.c))

    def _take_up(self, guest: int) -> None:
        """The floor along this path that a guest's subtree needs, beginning at its station."""
        frontier, tree = self.frontier[self.sides[guest]], self.subtrees[guest]
        self.guests.append((guest, self.station))
        for layer in LAYERS:
            frontier[layer] = max(frontier[layer], self.station + tree.high[layer])

    def _attach(self, guest: int, station: float, starts: Sequence[float]) -> None:
        """Fixes a guest's travel. Only the piles that come so far back are beside its subtree:
        the last of them is the widest, and `starts` are the least starts of each pile and those
        after it."""
        side, tree = self.sides[guest], self.subtrees[guest]
        strip = list(self.strip[side])
        beside = bisect_left(starts, station + tree.high[PAYLOADS])
        if not self.shape.tool:
            strip[PAYLOADS] = self._payload_strip(side, self.piles[max(beside, 1) - 1][1])
        tree.travel = self._travel(guest, strip)
        for layer in LAYERS:
            if tree.low[layer] > tree.high[layer]:
                continue
            far = tree.travel - tree.back[layer]
            across = (-far, 0.0) if side < 0 else (0.0, far)
            self.tree.include(layer, station + tree.low[layer], station + tree.high[layer], *across)


def ahead_of(operation: Operation, reach: float) -> float:
    """How far ahead of its station a carrier has its goal [m]; 0 where it meets what is brought."""
    point = operation.template.law.goals[operation.template.carrier - 1]
    exact = {"B": 0.0, "S": 2.0}.get(point.end, point.multiple)
    return (exact - point.multiple) * reach / 2


def check_guests(operation: Operation, guests: list[int]) -> None:
    """Two guidepaths can end at one point of a third, one from each side; a third cannot."""
    goals = operation.template.law.goals
    wrong = [g for g in guests if goals[operation.robots.index(g)].end != "A"]
    if len(guests) <= 2 and not wrong:
        return
    message = (
        f"'{operation.label}': {len(guests)} guidepaths would end at one point of the carrier's"
    )
    if wrong:
        message = f"'{operation.label}': a robot that is not the carrier has its goal away from A"
    hint = "give further inputs to another template (further = insert), two at a point at most"
    if wrong:
        hint = "write its goal as A + 2r: its guidepath ends where it meets the carrier"
    position = operation.template.position or operation.position
    raise InputError(Diagnostic("Layout", message, position, hint))


def is_tool(factory: Factory, robot: int) -> bool:
    """Whether a robot never carries anything: a tool of one operation."""
    numbers = factory.robots[robot].operations
    operation = factory.operations[numbers[0]]
    return len(numbers) == 1 and operation.before[operation.robots.index(robot)] == NOPART
