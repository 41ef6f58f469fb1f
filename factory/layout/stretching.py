"""Stretching: choose free lengths and directions of the guidepaths so that nothing meets that should not.

The guidepaths form a tree. A robot's path starts where it receives (B) and runs straight to where it
delivers (A); the paths of the robots that bring it something end on it, from its left or right. A subtree
takes a box beside its carrier's path; boxes on one side follow one another; a path is as long as it takes
to keep its own subtree clear of the path it ends on. Bottom-up, linear in the number of robots.

Frames: a robot's heading is u, its side t is the heading of the robot it delivers to. So a subtree's extent
in t is its extent along the path it ends on.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import ceil

from factory.errors import Diagnostic, InputError
from factory.factory import Factory, Operation
from factory.layout.dimensions import CARRIAGE, POST, TOOL_TRAVEL, Clearance
from factory.pag import NOPART

Extent = tuple[float, float, float, float]
"""(ulo, uhi, tlo, thi): a box in a robot's frame, about the product's middle [m]."""

Sides = dict[int, int]
"""For each robot but the first: +1 where it stands on the side t of its carrier's path, else -1."""


@dataclass(frozen=True, slots=True)
class Shape:
    """What the layout must know of a robot: the box of each pile it carries, by operation, and of the
    last one, how far its carriage line is to the side, and how far behind its arm ends."""

    piles: Mapping[int, Extent]
    last: Extent
    offset: float
    arm: float
    tool: bool

    def reach(self, c: Clearance) -> float:
        """2r: the carriage stands this far behind the product's middle."""
        return self.arm + CARRIAGE / 2 + c.c


@dataclass(slots=True)
class Subtree:
    """A robot with all that brings it something, in its own frame, origin at its B station.

    `front`: the farthest extent ahead; `back`: behind; `low`, `high`: to the side; `travel` [m].
    """

    front: float
    back: float
    low: float
    high: float
    travel: float = 0.0

    def include(self, ulo: float, uhi: float, tlo: float, thi: float) -> None:
        """Grow to contain a box."""
        self.back, self.front = min(self.back, ulo), max(self.front, uhi)
        self.low, self.high = min(self.low, tlo), max(self.high, thi)


@dataclass(frozen=True)
class Stretched:
    """The result: travel of each robot, station of each operation, side of each robot, and of each
    robot's subtree the extent behind its B station."""

    travel: list[float]
    stations: list[float]
    sides: Sides
    subtrees: list[Subtree]


def stretch(
    factory: Factory,
    shape: Callable[[int], Shape],
    clearance: Clearance,
    sides: Sides | None = None,
) -> Stretched:
    """Lengths and stations for given sides; chooses the sides where none are given: the longer of two
    inputs away from where the robot delivers, a later input on the side where its station comes sooner.
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
    travel[0] = up(subtrees[0].front - min(0.0, shape(0).last[0]) + clearance.c)
    return Stretched(travel, stations, chosen, subtrees)


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
        self.lane = CARRIAGE / 2 + self.half
        self.strip = {
            +1: max(shape.last[3] + self.half, shape.offset + self.lane),
            -1: max(-shape.last[2] + self.half, -shape.offset + self.lane),
        }
        self.frontier = {+1: float("-inf"), -1: float("-inf")}
        self.station = 0.0
        self.count = 0
        behind = -shape.reach(clearance) - CARRIAGE / 2 - self.half
        self.tree = Subtree(-shape.arm + self.half, behind, -self.strip[-1], self.strip[+1])

    def add(self, operation: Operation) -> float:
        """Places one operation; its distance from B [m]."""
        guests = [r for r in operation.robots if r != operation.carrier]
        _check_guests(operation, guests)
        if self.count == 0:
            self._choose_mates(guests)
            if not guests:
                self._feeder(operation.index)
        elif self.choose:
            self._choose_sides(guests)
        if self.count:
            self.station = up(max([self.station, *(self._earliest(g) for g in guests)]))
        for guest in guests:
            self._attach(guest)
        pile = self.shape.piles[operation.index]
        at = self.station
        self.tree.include(
            at + pile[0] - self.half, at + pile[1] + self.half, -self.strip[-1], self.strip[+1]
        )
        self.count += 1
        return at

    def finish(self) -> Subtree:
        """The subtree, ready to be attached; a tool comes a fixed way."""
        if self.shape.tool:
            self.tree.travel = TOOL_TRAVEL
        return self.tree

    def _feeder(self, operation: int) -> None:
        """A post behind the carriage's rear stop and behind the part."""
        post = self.c.post(self.shape.reach(self.c), self.shape.piles[operation][0]) + POST / 2
        self.tree.include(-post - self.half, 0.0, -self.strip[-1], self.strip[+1])

    def _earliest(self, guest: int) -> float:
        return self.frontier[self.sides[guest]] - self.subtrees[guest].low

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
            low = self.subtrees[guest].low
            left, right = self.frontier[-1] - low, self.frontier[+1] - low
            self.sides[guest] = -1 if max(left, self.station) <= max(right, self.station) else +1

    def _outward(self, guest: int, side: int) -> float:
        tree = self.subtrees[guest]
        return self._travel(guest, side) - tree.back

    def _travel(self, guest: int, side: int) -> float:
        """How far a guest must come so that, at its B end, its subtree is clear of this path."""
        tree = self.subtrees[guest]
        return up(max(tree.travel, tree.front + self.strip[side], self.c.c))

    def _attach(self, guest: int) -> None:
        side, tree = self.sides[guest], self.subtrees[guest]
        tree.travel = self._travel(guest, side)
        self.frontier[side] = self.station + tree.high
        far = tree.travel - tree.back
        low, high = (-far, 0.0) if side < 0 else (0.0, far)
        self.tree.include(self.station + tree.low, self.station + tree.high, low, high)


def _check_guests(operation: Operation, guests: list[int]) -> None:
    """Two guidepaths can end at one point of a third, one from each side; a third cannot."""
    goals = operation.template.law.goals
    wrong = [
        g for g in guests if goals[operation.robots.index(g)].end != "A"
    ]
    if len(guests) <= 2 and not wrong:
        return
    message = (
        f"'{operation.label}': {len(guests)} guidepaths would end at one point of the carrier's path"
        if not wrong
        else f"'{operation.label}': a robot that is not the carrier must have its goal at its A end"
    )
    hint = "give further inputs to another template (further = insert), two at a point at most"
    position = operation.template.position or operation.position
    raise InputError(Diagnostic("Layout", message, position, hint))


def is_tool(factory: Factory, robot: int) -> bool:
    """Whether a robot never carries anything: a tool of one operation."""
    numbers = factory.robots[robot].operations
    operation = factory.operations[numbers[0]]
    return len(numbers) == 1 and operation.before[operation.robots.index(robot)] == NOPART
