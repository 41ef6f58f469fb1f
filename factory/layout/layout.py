"""A layout: the embedding f of the quotient workspace W in the plane (paper, section 5.1)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType

from factory.geometry.solids import Product
from factory.layout.certificate import Certificate
from factory.layout.dimensions import (
    BEHIND,
    BELT_GAP,
    PAYLOAD,
    PLAY,
    SIDE,
    TRAY,
    WALL,
    up,
)
from factory.layout.guidepath import Box, Extent, Feeder, Guidepath, Point2, moved
from factory.layout.hands.hand import Hand, Point3
from factory.layout.hands.mounted import Mount, grip_of
from factory.layout.level import LEAST, Level
from factory.plant.approaches import Overlap
from factory.plant.factory import Factory, Operation
from factory.problem.pag import NOPART
from factory.support.showing import Pictured

BESIDE = 0.001
"""What is to be lowered stays this far short of its meeting point until the others stand [m]."""


@dataclass(frozen=True)
class Layout(Pictured):
    """A factory laid out: a guidepath for each robot, and for each operation the arc length at
    which each of its robots has its goal.

    `stations[i]`: distance [m] of operation i from its carrier's B end; `payloads[label]`: the box
    of a sub-assembly about the product's middle; `outfeed`: the box of the conveyor in the world;
    `hands`: those of the robots, None for tools, nothing where they are not chosen; `shifts`: for
    each robot and each of its tours how far the product's middle is, in the robot's frame (u, t)
    and upwards, from where it is on the first of them [m], nothing for no shifts
    (docs/decisions/hands.md, Lines);
    `given`: the levels of robots on their tours, None where they follow from these;
    `plain`: the layout without relays, None where this is one; `standby`: that of which this is a
    part, so that deputies can take over, None where none may.
    """

    factory: Factory
    product: Product
    clearance: float
    guidepaths: tuple[Guidepath, ...] = field(repr=False)
    stations: tuple[float, ...] = field(repr=False)
    payloads: Mapping[str, Box] = field(repr=False)
    outfeed: Box = (0.0, 0.0, 0.0, 0.0)
    hands: tuple[Hand | None, ...] = field(default=(), repr=False)
    shifts: tuple[tuple[Point3, ...], ...] = field(default=(), repr=False)
    given: tuple[tuple[Level, ...], ...] | None = field(default=None, repr=False)
    floor: Box = (0.0, 0.0, 0.0, 0.0)
    certificate: Certificate | None = field(default=None, repr=False, compare=False)
    plain: Layout | None = field(default=None, repr=False, compare=False)
    standby: Layout | None = field(default=None, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "payloads", MappingProxyType(dict(self.payloads)))

    def __repr__(self) -> str:
        return f"<Layout of {self.factory}: {self.area:.2f} m²>"

    def hand(self, robot: int) -> Hand | None:
        """The hand of a robot; None for a tool, and where hands are not chosen."""
        return self.hands[robot] if self.hands else None

    def shift(self, robot: int, operation: int) -> Point2:
        """How far the product's middle is from where a robot's guidepath has it, in the world, on
        the robot's tour that an operation (index) is in."""
        if not self.shifts:
            return 0.0, 0.0
        ahead, aside, _ = self.shifts[robot][self.factory.turns[operation, robot]]
        (u, v), (s, t) = self.guidepaths[robot].heading, self.guidepaths[robot].side
        return u * ahead + s * aside, v * ahead + t * aside

    def held(self, robot: int, operation: int, label: str) -> Box:
        """The box of a sub-assembly about the middle that a robot's guidepath tells, on the robot's
        tour that an operation (index) is in."""
        return moved(self.payloads[label], self.shift(robot, operation))

    def apart(self, operation: int, slot: int) -> Point2:
        """Where the robot in a slot of an operation and the carrier of it stand, which hold what
        they bring in other places than for other operations: how much earlier than at the end of
        its guidepath the robot delivers, and how much further than where that ends the carrier
        stands [m]."""
        chosen = self.factory.operations[operation]
        robot, carrier = chosen.robots[slot], chosen.carrier
        if not self.shifts or robot == carrier:
            return 0.0, 0.0
        (x, y), (a, b) = self.shift(robot, operation), self.shift(carrier, operation)
        (u, v), (s, t) = self.guidepaths[robot].heading, self.guidepaths[robot].side
        ahead, aside = (x - a) * u + (y - b) * v, (x - a) * s + (y - b) * t
        return round(ahead, 6), round(aside, 6)

    def held_at(self, robot: int, operation: int) -> float:
        """How far above its place in the product a robot holds its payload with its lift down, on
        the tour that an operation (index) is in [m]."""
        level = self.level(robot, operation)
        return level.elevation - level.up

    def mount(self, robot: int) -> Mount:
        """Where a robot's hand is mounted."""
        path, (x, y, _) = self.guidepaths[robot], self.product.middle.tolist()
        first = self.factory.robots[robot].operations[0]
        over = PAYLOAD - float(self.product.low[2]) + self.held_at(robot, first)
        lies = path.heading, path.side, path.reach, path.arm, path.offset
        stroke = self.strokes.get(robot)
        return Mount(*lies, (x, y), over, stroke or 0.0, stroke is not None)

    def grip(self, robot: int) -> Extent | None:
        """The box about the product's middle, in a robot's frame (u, t), of what its hand and mast
        take among the payloads; None for nothing."""
        hand = self.hand(robot)
        return None if hand is None else grip_of(hand, self.mount(robot))

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

        A non-carrier delivers at A + 2r, or short of that (`apart`); a carrier stands
        `stations[operation]` from its B end. A lift is up but for the operation it delivers to.
        """
        chosen = self.factory.operations[operation]
        if slot >= len(chosen.robots):
            robot = self.factory.robot_of(self.factory.axes[operation][slot])
            level = self.level(robot, operation)
            return level.down if self.factory.delivers(robot, operation) else level.up
        path = self.guidepaths[chosen.robots[slot]]
        point = chosen.template.law.goals[slot]
        if slot != chosen.template.carrier - 1 or point.end == "A":
            return point.multiple * path.r + self.apart(operation, slot)[0]
        exact = {"B": 0.0, "S": 2.0}[point.end]
        return path.length - self.stations[operation] + (point.multiple - exact) * path.r

    def meeting(self, operation: Operation) -> Point2:
        """The product's middle where the carrier of an operation has its goal."""
        path, (x, y) = (
            self.guidepaths[operation.carrier],
            self.shift(operation.carrier, operation.index),
        )
        at = path.middle(self.goal(operation.index, operation.template.carrier - 1))
        return at[0] + x, at[1] + y

    def stops(self, robot: int) -> list[float]:
        """The arc lengths at which a robot has its goals, in the order of its gear."""
        operations = self.factory.operations
        return [
            self.goal(number, operations[number].robots.index(robot))
            for number in self.factory.robots[robot].operations
        ]

    def ends(self, robot: int) -> tuple[float, float]:
        """The least and the greatest arc length at which a robot ever stands."""
        path, stops = self.guidepaths[robot], self.stops(robot)
        return min(path.reach, *stops), max(path.length, *stops)

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
    def levels(self) -> Sequence[Sequence[Level]]:
        """For each robot those of its tours, as `given` if they are."""
        factory, found = self.factory, list[list[Level]]()
        if self.given is not None:
            return self.given
        for robot, tours in enumerate(factory.tours):
            ends = [factory.operations[tour[-1]] for tour in tours]
            below = [0.0] * len(ends)
            if robot:
                turns = ((o.carrier, factory.turns[o.index, o.carrier]) for o in ends)
                below = [found[carrier][turn].elevation for carrier, turn in turns]
            stroke, downs = factory.strokes.get(robot, 0.0), [0.0] * len(ends)
            if robot in factory.strokes and len(ends) > 1 and self.shifts:
                over = [d - z for d, (_, _, z) in zip(below, self.shifts[robot], strict=True)]
                downs = [round(at - min(over), 6) for at in over]
                own = (o.approach.stroke if o.approach else 0.0 for o in ends)
                stroke = max(at + far for at, far in zip(downs, own, strict=True))
            ups = downs if robot in factory.adjusted else [stroke] * len(ends)
            levels = zip(downs, ups, below, strict=True)
            found.append([Level(down, up, d + (up - down)) for down, up, d in levels])
        return found

    def level(self, robot: int, operation: int) -> Level:
        """How high a robot holds what it brings, on the tour that an operation (index) is in."""
        return self.levels[robot][self.factory.turns[operation, robot]]

    @cached_property
    def strokes(self) -> Mapping[int, float]:
        """How far up the lift of each robot that has one goes (index) [m]."""
        highest = {r: max((level.up for level in self.levels[r]), default=0.0) for r in self.lifts}
        return MappingProxyType({robot: max(up, LEAST) for robot, up in highest.items()})

    def elevation(self, robot: int, operation: int) -> float:
        """How far above its place in the product a robot carries what it brings, on the tour that
        an operation (index) is in [m]: what its own lift has to lower it, over the height at which
        the robot that it delivers to carries it."""
        return self.level(robot, operation).elevation

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
        for operation in self.factory.making:
            approach = operation.approach
            if approach is not None and any(approach.overlaps):
                found += approach.overlaps[approach.sides.index(self.side(operation))]
        return tuple(found)

    def home(self, robot: int, operation: int) -> float:
        """Arc length at which a robot waits before an operation: the goal of the one before, or B
        where it waits with no part at the beginning of its cycle."""
        if self.factory.begins(robot, operation):
            return self.guidepaths[robot].length
        return self.legs[operation, robot][0]

    @cached_property
    def fed(self) -> Mapping[tuple[str, str], Operation]:
        """The first operation in which each robot takes each part from its feeder, by what the part
        is written as and the robot's name."""
        robots, leaves = self.factory.robots, reversed(self.factory.leaves)
        return {(leaf.written, robots[leaf.carrier].name): leaf for leaf in leaves}

    def magazine(self, robot: int) -> tuple[str, ...]:
        """The parts that the feeder of a robot shows, in the order of its program; none without."""
        firsts = (self.factory.operations[tour[0]] for tour in self.factory.tours[robot])
        return tuple(operation.label for operation in firsts if not operation.inputs)

    def standoff(self, operation: Operation, slot: int) -> float:
        """How far short of the meeting point the robot in `slot` waits until the carrier stands
        [m].

        Where the carrier brings a pile too, both would meet diagonally; from here on the payload is
        clear of the pile wherever that is on its way. What is lowered comes above the pile, and
        waits just beside its place.
        """
        carrier = operation.template.carrier - 1
        pile, label = operation.before[carrier], operation.before[slot]
        if slot == operation.lowered:
            return max(BESIDE, self._beside_hand(operation, slot) if pile == NOPART else 0.0)
        if slot == carrier or label == NOPART:
            return 0.0
        if pile == NOPART:
            lowered = operation.lowered  # that waits for this one, and so for the carrier
            chained = lowered >= 0 and self._beside_hand(operation, lowered) > 0
            return max(BESIDE * chained, self._beside_hand(operation, slot))
        path = self.guidepaths[operation.robots[slot]]
        ahead = path.frame(self.payloads[label])[1]
        towards = -path.frame(self.payloads[pile])[0]
        return max(0.0, ahead + towards + self.clearance)

    def _beside_hand(self, operation: Operation, slot: int) -> float:
        """How far short of the meeting point what is brought is clear of the way of the carrier's
        hand and mast, where that has to be there first [m]; else 0."""
        hand, grip = self.hand(operation.carrier), self.grip(operation.carrier)
        if hand is None or grip is None or not hand.first:
            return 0.0
        path, on = self.guidepaths[operation.robots[slot]], self.guidepaths[operation.carrier]
        x, y = self.shift(operation.carrier, operation.index)
        over = x * path.heading[0] + y * path.heading[1]
        ahead = path.frame(self.payloads[operation.before[slot]])[1]
        lines = [
            path.heading[0] * on.side[0] * line + path.heading[1] * on.side[1] * line
            for line in grip[2:]
        ]
        return round(max(0.0, ahead + over - min(lines) + self.clearance), 6)

    @property
    def outfeed_way(self) -> float:
        """How far the outfeed takes a product until it is out of sight [m]."""
        return self.product_length + self.hand_ahead + self.clearance + WALL + BEHIND

    @property
    def hand_ahead(self) -> float:
        """How far the hand of the output robot reaches ahead of the product [m]."""
        grip, ahead = self.grip(0), self.payloads[self.factory.products[0]][1]
        return 0.0 if grip is None else up(max(0.0, grip[1] - ahead))

    @property
    def shed(self) -> Box:
        """The shed that the outfeed takes products into, in the world: its shutter is a clearance
        ahead of a product that is dropped off, and of the hand that does so."""
        xlo, xhi, ylo, yhi = self.payloads[self.factory.products[0]]
        x, y = self.guidepaths[0].a
        start = x + xhi + self.hand_ahead + self.clearance
        return start, start + WALL + BEHIND + xhi - xlo + SIDE, y + ylo - SIDE, y + yhi + SIDE

    @property
    def shutter_stroke(self) -> float:
        """How far the shed's shutter comes down: from above any product to the belt [m]."""
        tall = float(self.product.high[2] - self.product.low[2])
        return tall + PLAY + BELT_GAP + TRAY

    @cached_property
    def product_length(self) -> float:
        """Length of the finished product along the output robot's heading [m]."""
        xlo, xhi, _, _ = self.payloads[self.factory.products[0]]
        return xhi - xlo


def carriers(factory: Factory) -> list[int]:
    """For each robot the carrier it delivers to; -1 for the output robot."""
    last = [robot.operations[-1] for robot in factory.robots]
    return [-1 if factory.drops(n) else factory.operations[n].carrier for n in last]


__all__ = ["BESIDE", "Box", "Extent", "Feeder", "Guidepath", "Layout", "Point2", "carriers"]
