"""A layout: the embedding f of the quotient workspace W in the plane (paper, section 5.1).

Every part is carried in its place in the finished product, relative to the product's middle. Where
that middle is in the world is the robot's *station*: at a mate the middles of all robots coincide,
so the parts are assembled when they meet. A guidepath is the straight line of that point.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING

from factory.geometry.solids import Product
from factory.layout.dimensions import BOOM, PAYLOAD, POST, Clearance
from factory.plant.approaches import Pair
from factory.plant.factory import Factory, Operation
from factory.problem.pag import NOPART

if TYPE_CHECKING:
    from factory.layout.clearance import Certificate

Box = tuple[float, float, float, float]
"""(xlo, xhi, ylo, yhi) [m]."""

Extent = tuple[float, float, float, float]
"""(ulo, uhi, tlo, thi): a box in a robot's frame, about the product's middle [m]."""

Point2 = tuple[float, float]

BESIDE = 0.005
"""What is to be lowered stays this far short of its meeting point until the others stand [m]."""


@dataclass(frozen=True, slots=True)
class Guidepath:
    """The guidepath of one robot and how the robot is stretched to its payload.

    `heading` u, a unit vector towards A, and `side` t, to the left or right of it; `a`: the
    product's middle when the robot delivers (x, y); `travel`: how far before that it receives (the
    station at its B end); `reach` = 2r: how far the carriage stays behind the product's middle;
    `offset`: how far the carriage's line is to the side t; `arm`: how far behind the middle the arm
    ends; `nest`: where ahead of the middle the payload's own middle is, reached by the finger;
    `aside`: how far to the side t of the carriage's line that is, in a lane beside another's. All
    lengths in [m].

    Arc length x of the carriage runs from A = 0; delivering at x = reach, receiving at B = reach +
    travel.
    """

    heading: Point2
    side: Point2
    a: Point2
    travel: float
    reach: float
    offset: float
    arm: float
    nest: float
    aside: float = 0.0

    @property
    def length(self) -> float:
        """B - A [m]."""
        return self.reach + self.travel

    @property
    def r(self) -> float:
        """The robot's width r [m], of which the templates' goals are multiples."""
        return self.reach / 2

    def middle(self, x: float) -> Point2:
        """Where the product's middle is when the carriage is at arc length x."""
        back = x - self.reach
        return self.a[0] - self.heading[0] * back, self.a[1] - self.heading[1] * back

    def carriage(self, x: float) -> Point2:
        """f: where the carriage's centre is at arc length x."""
        return (
            self.a[0] - self.heading[0] * x + self.side[0] * self.offset,
            self.a[1] - self.heading[1] * x + self.side[1] * self.offset,
        )

    def world(self, extent: Extent, middle: Point2) -> Box:
        """A box given in the robot's frame (u, t), as it lies in the world about `middle`."""
        ulo, uhi, tlo, thi = extent
        u, t = self.heading, self.side
        x = sorted((u[0] * ulo + t[0] * tlo, u[0] * uhi + t[0] * thi))
        y = sorted((u[1] * ulo + t[1] * tlo, u[1] * uhi + t[1] * thi))
        return middle[0] + x[0], middle[0] + x[1], middle[1] + y[0], middle[1] + y[1]

    def frame(self, box: Box) -> Extent:
        """A box about the product's middle, in the world's directions, in the robot's frame (u,
        t)."""
        u, t = self.heading, self.side
        along = sorted((box[0] * u[0] + box[2] * u[1], box[1] * u[0] + box[3] * u[1]))
        across = sorted((box[0] * t[0] + box[2] * t[1], box[1] * t[0] + box[3] * t[1]))
        return along[0], along[1], across[0], across[1]


@dataclass(frozen=True, slots=True)
class Feeder:
    """Where a part is presented: the boxes of its post and of the boom above the part, in the
    world, and the height of the boom's lower edge [m]."""

    post: Box
    boom: Box
    height: float


@dataclass(frozen=True)
class Layout:
    """A factory laid out: a guidepath for each robot, and for each operation the arc length at
    which each of its robots has its goal.

    `stations[i]`: distance [m] of operation i from its carrier's B end; `payloads[label]`: the box
    of a sub-assembly about the product's middle; `outfeed`: the box of the conveyor in the world;
    `plain`: the layout without relays, None where this is one; `ground`: what it was made for, by
    the names that `planning.Ground` has.
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
    def excluded(self) -> tuple[Pair, ...]:
        """The pairs of parts that pass through each other as their operations join them, or overlap
        in the finished product; contact between them is off."""
        found: dict[Pair, None] = {}
        for operation in self.factory.operations[:-1]:
            approach = operation.approach
            if approach is not None and any(approach.excluded):
                which = approach.sides.index(self.side(operation))
                found.update(dict.fromkeys(approach.excluded[which]))
        return tuple(found)

    def home(self, robot: int, operation: int) -> float:
        """Arc length at which a robot waits before an operation: the goal of the one before, or B
        where it waits with no part at the beginning of its cycle."""
        gear = self.factory.robots[robot].operations
        step = gear.index(operation)
        if step == 0:
            return self.guidepaths[robot].length
        before = self.factory.operations[gear[step - 1]]
        return self.goal(before.index, before.robots.index(robot))

    def feeder(self, label: str) -> Feeder:
        """The feeder of a part, behind the rear stop of the robot that it serves."""
        operation = self.factory.by_label[label]
        path = self.guidepaths[operation.carrier]
        middle = path.middle(self.goal(operation.index, operation.template.carrier - 1))
        rear, front, _, _ = path.frame(self.payloads[label])
        back = -Clearance(self.clearance).post(path.reach, rear)
        ahead = round((rear + front) / 2, 3)
        across, half = path.offset + path.aside, POST / 2
        solid = self.product.solids[label]
        return Feeder(
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
