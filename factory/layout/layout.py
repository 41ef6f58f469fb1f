"""A layout: the embedding f of the quotient workspace W in the plane (paper, section 5.1)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType

from factory.geometry.solids import Product
from factory.layout.certificate import Certificate
from factory.layout.dimensions import BOOM, PAYLOAD, POST, Clearance
from factory.layout.guidepath import Box, Extent, Feeder, Guidepath, Point2
from factory.plant.approaches import Overlap
from factory.plant.factory import Factory, Operation
from factory.problem.pag import NOPART

BESIDE = 0.005
"""What is to be lowered stays this far short of its meeting point until the others stand [m]."""


@dataclass(frozen=True)
class Layout:
    """A factory laid out: a guidepath for each robot, and for each operation the arc length at
    which each of its robots has its goal.

    `stations[i]`: distance [m] of operation i from its carrier's B end; `payloads[label]`: the box
    of a sub-assembly about the product's middle; `outfeed`: the box of the conveyor in the world;
    `plain`: the layout without relays, None where this is one; `ground`: what it was made for, by
    the names that `request.Ground` has.
    """

    factory: Factory
    product: Product
    clearance: float
    guidepaths: tuple[Guidepath, ...] = field(repr=False)
    stations: tuple[float, ...] = field(repr=False)
    payloads: Mapping[str, Box] = field(repr=False)
    outfeed: Box = (0.0, 0.0, 0.0, 0.0)
    floor: Box = (0.0, 0.0, 0.0, 0.0)
    certificate: Certificate | None = field(default=None, repr=False, compare=False)
    plain: Layout | None = field(default=None, repr=False, compare=False)
    ground: Mapping[str, object] = field(default_factory=dict, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "payloads", MappingProxyType(dict(self.payloads)))
        object.__setattr__(self, "ground", MappingProxyType(dict(self.ground)))

    @cached_property
    def guidepath_length(self) -> float:
        """Total length of the guidepaths [m]."""
        return float(sum(g.length for g in self.guidepaths))

    @property
    def area(self) -> float:
        """Floor area [m²] of the bounding box."""
        xlo, xhi, ylo, yhi = self.floor
        return (xhi - xlo) * (yhi - ylo)

    def goal(self, operation: int, slot: int) -> float:
        """Arc length of the goal of the robot in `slot` of an operation; beyond its robots, height
        of the goal of a lift (see `Factory.axes`).

        A non-carrier delivers at A + 2r; a carrier stands `stations[operation]` from its B end. A
        lift is up but for the operation it delivers to.
        """
        chosen = self.factory.operations[operation]
        if slot >= len(chosen.robots):
            robot = self.lifts[self.factory.axes[operation][slot] - len(self.guidepaths)]
            last = self.factory.robots[robot].operations[-1]
            return 0.0 if operation == last else self.factory.strokes[robot]
        path = self.guidepaths[chosen.robots[slot]]
        point = chosen.template.law.goals[slot]
        if slot != chosen.template.carrier - 1 or point.end == "A":
            return point.multiple * path.r
        exact = {"B": 0.0, "S": 2.0}[point.end]
        return path.length - self.stations[operation] + (point.multiple - exact) * path.r

    def meeting(self, operation: Operation) -> Point2:
        """The product's middle where the carrier of an operation has its goal."""
        path = self.guidepaths[operation.carrier]
        return path.middle(self.goal(operation.index, operation.template.carrier - 1))

    def stops(self, robot: int) -> list[float]:
        """The arc lengths at which a robot has its goals, in the order of its gear."""
        operations = self.factory.operations
        return [
            self.goal(number, operations[number].robots.index(robot))
            for number in self.factory.robots[robot].operations
        ]

    @cached_property
    def legs(self) -> Mapping[tuple[int, int], tuple[float, float]]:
        """For each (operation, robot of it): from where to where it goes (arc lengths)."""
        found: dict[tuple[int, int], tuple[float, float]] = {}
        for robot in self.factory.robots:
            stops = self.stops(robot.index)
            for step, number in enumerate(robot.operations):
                found[number, robot.index] = stops[step - 1], stops[step]
        return MappingProxyType(found)

    @cached_property
    def lifts(self) -> tuple[int, ...]:
        """The robots that have a lift, in the order of their axes."""
        return tuple(self.factory.strokes)

    @cached_property
    def elevations(self) -> tuple[float, ...]:
        """How far above its place in the product each robot carries what it brings [m]: the stroke
        of its own lift over the height at which the robot it delivers to carries it."""
        strokes, operations = self.factory.strokes, self.factory.operations
        found: list[float] = []
        for robot in self.factory.robots:
            below = 0.0
            if robot.index:
                below = found[operations[robot.operations[-1]].carrier]
            found.append(below + strokes.get(robot.index, 0.0))
        return tuple(found)

    def side(self, operation: Operation) -> int:
        """From which side, +1 or -1, of the axis of its approach the last input of an operation
        comes, in the directions of the product."""
        carrier = operation.template.carrier - 1
        last = operation.last
        guests = (s for s, label in enumerate(operation.before) if label != NOPART and s != carrier)
        guest = operation.robots[next(guests) if last == carrier else last]
        heading = self.guidepaths[guest].heading
        side = -1 if heading[0] + heading[1] > 0 else +1
        return -side if last == carrier else side

    @cached_property
    def overlaps(self) -> tuple[Overlap, ...]:
        """The parts that overlap or scrape as their operations join them from the sides chosen, or
        overlap in the finished product."""
        found: list[Overlap] = []
        for operation in self.factory.operations[:-1]:
            approach = operation.approach
            if approach is not None and any(approach.overlaps):
                found += approach.overlaps[approach.sides.index(self.side(operation))]
        return tuple(found)

    def home(self, robot: int, operation: int) -> float:
        """Arc length at which a robot waits before an operation: the goal of the one before, or B
        where it waits with no part at the beginning of its cycle."""
        if self.factory.robots[robot].operations[0] == operation:
            return self.guidepaths[robot].length
        return self.legs[operation, robot][0]

    def feeder(self, label: str) -> Feeder:
        """The feeder of a part, behind the rear stop of the robot that it serves."""
        operation = self.factory.by_label[label]
        path = self.guidepaths[operation.carrier]
        middle = self.meeting(operation)
        rear, front, _, _ = path.frame(self.payloads[label])
        back = -Clearance(self.clearance).post(path.reach, rear)
        ahead = round((rear + front) / 2, 3)
        across, half = path.offset + path.aside, POST / 2
        solid = self.product.solids[label]
        return Feeder(
            back,
            ahead,
            across,
            path.world((back - half, back + half, across - half, across + half), middle),
            path.world((back, ahead, across - BOOM / 2, across + BOOM / 2), middle),
            PAYLOAD
            + self.elevations[operation.carrier]
            + float(solid.high[2] - self.product.low[2])
            + self.clearance,
        )

    def standoff(self, operation: Operation, slot: int) -> float:
        """How far short of the meeting point the robot in `slot` waits until the carrier stands
        [m].

        Where the carrier brings a pile too, both would meet diagonally; from here on the payload is
        clear of the pile wherever that is on its way. What is lowered comes above the pile, and
        waits just beside its place.
        """
        if slot == operation.lowered:
            return BESIDE
        carrier = operation.template.carrier - 1
        pile, label = operation.before[carrier], operation.before[slot]
        if slot == carrier or NOPART in (pile, label):
            return 0.0
        path = self.guidepaths[operation.robots[slot]]
        ahead = path.frame(self.payloads[label])[1]
        towards = -path.frame(self.payloads[pile])[0]
        return max(0.0, ahead + towards + self.clearance)

    @property
    def outfeed_way(self) -> float:
        """How far the outfeed takes a product until it is out of sight [m]."""
        return self.product_length + 0.12

    @cached_property
    def product_length(self) -> float:
        """Length of the finished product along the output robot's heading [m]."""
        xlo, xhi, _, _ = self.payloads[self.factory.pag.root]
        return xhi - xlo


def carriers(factory: Factory) -> list[int]:
    """For each robot the carrier it delivers to; -1 for the output robot."""
    return [
        -1 if robot.index == 0 else factory.operations[robot.operations[-1]].carrier
        for robot in factory.robots
    ]


__all__ = ["BESIDE", "Box", "Extent", "Feeder", "Guidepath", "Layout", "Point2", "carriers"]
