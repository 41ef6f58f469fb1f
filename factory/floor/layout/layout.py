"""A layout: the embedding f of the quotient workspace W in the plane (paper, section 5.1)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType

from factory.floor.geometry.solids import Product
from factory.floor.layout.certificate import Certificate
from factory.floor.layout.chains import Chains, JointCurves
from factory.floor.layout.dimensions import BEHIND, BELT_GAP, PAYLOAD, PLAY, SIDE, TRAY, WALL
from factory.floor.layout.guidepath import Guidepath
from factory.floor.layout.hands.hand import Hand
from factory.floor.layout.hands.mounted import Mount, grip_of
from factory.floor.layout.visits import LEAST, Visit, Visits, beyond_station, stop_offset
from factory.floor.layout.way import Ways
from factory.support.boxes import Box, Extent, Point2, hull, moved
from factory.support.decimals import up
from factory.support.keeping import Keeping
from factory.support.showing import Pictured
from factory.theory.plant.approaches import Overlap
from factory.theory.plant.factory import Factory
from factory.theory.plant.operation import Operation
from factory.theory.problem.pag import NOPART

BESIDE = 0.001
"""What is to be lowered stays this far short of its meeting point until the others stand [m]."""


@dataclass(frozen=True)
class Layout(Keeping, Pictured):
    """A factory laid out: a guidepath for each robot, and its visit for each of its operations.

    Attributes:
        factory: the factory.
        product: its solids.
        clearance: least distance between machines that share no mode [m].
        guidepaths: of each robot.
        visits: by operation and robot, where the robot is.
        payloads: by label, the box of a sub-assembly about the product's middle [m].
        outfeed: the box of the conveyor in the world [m].
        hands: of each robot; None for tools, empty where they are not chosen.
        floor: the box of the floor that it takes [m].
        certificate: its clearance certificate.
        plain: the layout without relays; None where this is one.
        tile: size of the tiles of the platen over which robots go [m]; 0 where they go on rails.
        chains: the robots whose first axes move several joints; None where there are none.
    """

    factory: Factory
    product: Product
    clearance: float
    guidepaths: tuple[Guidepath, ...] = field(repr=False)
    visits: Visits = field(repr=False)
    payloads: Mapping[str, Box] = field(repr=False)
    outfeed: Box = (0.0, 0.0, 0.0, 0.0)
    hands: tuple[Hand | None, ...] = field(default=(), repr=False)
    floor: Box = (0.0, 0.0, 0.0, 0.0)
    certificate: Certificate | None = field(default=None, repr=False, compare=False)
    plain: Layout | None = field(default=None, repr=False, compare=False)
    tile: float = 0.0
    chains: Chains | None = field(default=None, repr=False, compare=False)

    def __post_init__(self) -> None:
        for name in ("visits", "payloads"):
            object.__setattr__(self, name, MappingProxyType({**getattr(self, name)}))

    def __repr__(self) -> str:
        return f"<Layout of {self.factory}: {self.area:.2f} m²>"

    def hand(self, robot: int) -> Hand | None:
        """The hand of a robot; None for a tool, and in a draft without hands."""
        return self.hands[robot] if self.hands else None

    def held(self, robot: int, operation: int, label: str) -> Box:
        """The box of a sub-assembly about the middle of a robot's guidepath, on the robot's tour
        that contains an operation (index)."""
        return moved(self.payloads[label], self.visits[operation, robot].shift)

    def stop_offset(self, operation: int, slot: int) -> Point2:
        """Offset (along, across) [m] of the robot in a slot of an operation from its nominal stop,
        and of the carrier from that (`factory.floor.layout.visits`)."""
        chosen = self.factory.operations[operation]
        robot, carrier = chosen.robots[slot], chosen.carrier
        shifts = [self.visits[operation, number].shift for number in (robot, carrier)]
        curved = self.chains is not None and carrier in self.chains.robots  # that is where it takes
        return (0.0, 0.0) if curved else stop_offset(self.guidepaths[robot], *shifts)

    def mount(self, robot: int) -> Mount:
        """Where a robot's hand is mounted."""
        path, (x, y, _) = self.guidepaths[robot], self.product.middle.tolist()
        first = self.factory.robots[robot].operations[0]
        over = PAYLOAD - float(self.product.low[2]) + self.visits[first, robot].height
        lies = path.heading, path.side, path.reach, path.arm, path.offset
        return Mount(*lies, (x, y), over, self.rise(robot), self.factory.goes_up(robot))

    def grip(self, robot: int) -> Extent | None:
        """The box about the product's middle, in a robot's frame (u, t), that its hand and mast
        take among the payloads; None for none. Computed once."""
        return self.kept(_grip, robot)

    @cached_property
    def guidepath_length(self) -> float:
        """Total length of the guidepaths [m]; fixed robots have none."""
        return float(sum(g.length for g in self.guidepaths if g.travels))

    @cached_property
    def curves(self) -> tuple[tuple[int, ...], JointCurves]:
        """The robots (index) whose first axes move several joints, and the curves of these."""
        if self.chains is not None:
            return self.chains.robots, self.chains.curves
        ways = {n: path.way for n, path in enumerate(self.guidepaths) if path.way}
        return (*ways,), Ways.bent(ways.values())

    @cached_property
    def stems(self) -> frozenset[int]:
        """The robots (index) whose guidepaths end at one point of a line with another's."""
        ends = [(path.a, path.heading, path.offset) for path in self.guidepaths]
        several = {end for end, count in Counter(ends).items() if count > 1}
        return frozenset(robot for robot, end in enumerate(ends) if end in several)

    def share_stem(self, one: int, other: int) -> bool:
        """Whether the guidepaths of two robots end at the same point of the same line."""
        first, second = self.guidepaths[one], self.guidepaths[other]
        return (first.a, first.heading, first.offset) == (second.a, second.heading, second.offset)

    @property
    def area(self) -> float:
        """Floor area [m²] of the bounding box."""
        xlo, xhi, ylo, yhi = self.floor
        return (xhi - xlo) * (yhi - ylo)

    def goals(self, operation: int) -> tuple[float, ...]:
        """Positions of an operation's axes at its end [m], in the order of `Factory.moves`."""
        return self._on_axes(operation, 1)

    def starts(self, operation: int) -> tuple[float, ...]:
        """Positions of an operation's axes at its start: at the visits before it."""
        return self._on_axes(operation, 0)

    def _on_axes(self, operation: int, end: int) -> tuple[float, ...]:
        """Positions of an operation's axes at one end of its ways, 0 or 1 [m]."""
        factory, moves = self.factory, self.factory.moves[operation]
        visits = [self.ways[operation, factory.robot_of(axis)][end] for axis in moves]
        return tuple(
            visit.at if axis < len(factory.robots) else visit.lift
            for axis, visit in zip(moves, visits, strict=True)
        )

    def station(self, operation: int) -> float:
        """Arc length of an operation's station on its carrier's guidepath [m]."""
        chosen = self.factory.operations[operation]
        beyond = beyond_station(chosen) * self.guidepaths[chosen.carrier].r
        return self.visits[operation, chosen.carrier].at - beyond

    def meeting(self, operation: Operation) -> Point2:
        """The product's middle when the carrier of an operation is at its goal."""
        visit = self.visits[operation.index, operation.carrier]
        at, (x, y) = self.guidepaths[operation.carrier].middle(visit.at), visit.shift
        return at[0] + x, at[1] + y

    def stops(self, robot: int) -> list[float]:
        """The arc lengths of a robot's goals, in the order of its gear."""
        return [self.visits[number, robot].at for number in self.factory.robots[robot].operations]

    def ends(self, robot: int) -> tuple[float, float]:
        """The least and the greatest arc length at which a robot ever stands."""
        path, stops = self.guidepaths[robot], self.stops(robot)
        return min(path.reach, *stops), max(path.length, *stops)

    @cached_property
    def ways(self) -> Mapping[tuple[int, int], tuple[Visit, Visit]]:
        """For each (operation, robot): the visits between which the robot moves."""
        ways: dict[tuple[int, int], tuple[Visit, Visit]] = {}
        for robot in self.factory.robots:
            visits = [self.visits[number, robot.index] for number in robot.operations]
            for step, number in enumerate(robot.operations):
                ways[number, robot.index] = visits[step - 1], visits[step]
        return MappingProxyType(ways)

    @cached_property
    def spans(self) -> tuple[tuple[float, float], ...]:
        """The least and the greatest coordinate of each axis, in the order of `Factory.axes` [m;
        rad where it turns]."""
        count = len(self.guidepaths)
        along = (self.ends(robot) for robot in range(count))
        up = ((0.0, self.rise(axis.robot.index)) for axis in self.factory.axes[count:])
        return (*along, *up)

    def rise(self, robot: int) -> float:
        """How far a robot (index) goes up at most [m]; 0 where it stays at its height."""
        return self._rises.get(robot, 0.0)

    @cached_property
    def _rises(self) -> Mapping[int, float]:
        up = (robot for robot in self.factory.robots if self.factory.goes_up(robot.index))
        return {
            robot.index: max((LEAST, *(self.visits[o, robot.index].up for o in robot.operations)))
            for robot in up
        }

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
        overlaps: list[Overlap] = []
        for operation in self.factory.making:
            approach = operation.approach
            if approach is not None and any(approach.overlaps):
                overlaps += approach.on(self.side(operation)).overlaps[0]
        return tuple(overlaps)

    def home(self, robot: int, operation: int) -> float:
        """Arc length at which a robot waits before an operation: the goal of the one before, or B
        where it waits with no part at the beginning of its cycle."""
        if self.factory.begins(robot, operation):
            return self.guidepaths[robot].length
        return self.ways[operation, robot][0].at

    def magazine(self, robot: int) -> tuple[str, ...]:
        """The parts that a robot's feeder presents, in the order of its program; empty without
        one."""
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
        robot = operation.robots[slot]
        if self.chains and robot in self.chains.robots and label != NOPART:
            return self.chains.standoff(operation.index)
        path = self.guidepaths[robot]
        if slot == operation.lowered and not path.travels:
            return min(BESIDE, path.travel)
        if slot == operation.lowered:
            return max(BESIDE, self._beside_hand(operation, slot) if pile == NOPART else 0.0)
        if slot == carrier or label == NOPART:
            return 0.0
        if pile == NOPART:
            lowered = operation.lowered  # that waits for this one, and so for the carrier
            chained = lowered >= 0 and self._beside_hand(operation, lowered) > 0
            return max(BESIDE * chained, self._beside_hand(operation, slot))
        ahead = path.frame(self.payloads[label])[1]
        towards = -path.frame(self.payloads[pile])[0]
        return max(0.0, ahead + towards + self.clearance)

    def _beside_hand(self, operation: Operation, slot: int) -> float:
        """Standoff at which an input is clear of the way of the carrier's hand and mast, if these
        must be there first [m]; else 0."""
        hand, grip = self.hand(operation.carrier), self.grip(operation.carrier)
        path, on = self.guidepaths[operation.robots[slot]], self.guidepaths[operation.carrier]
        if hand is None or grip is None or not on.travels or not hand.first:
            return 0.0
        x, y = self.visits[operation.index, operation.carrier].shift
        over = x * path.heading[0] + y * path.heading[1]
        ahead = path.frame(self.payloads[operation.before[slot]])[1]
        lines = [
            path.heading[0] * on.side[0] * line + path.heading[1] * on.side[1] * line
            for line in grip[2:]
        ]
        return round(max(0.0, ahead + over - min(lines) + self.clearance), 6)

    @cached_property
    def outgoing(self) -> Box:
        """The box of the finished product; in a mix, of all products."""
        return hull([self.payloads[product] for product in self.factory.products])

    @property
    def outfeed_way(self) -> float:
        """Travel of the outfeed's tray until a product is out of sight [m]."""
        return self.product_length + self.hand_ahead + self.clearance + WALL + BEHIND

    @property
    def hand_ahead(self) -> float:
        """Extent of the output robot's hand ahead of the product [m]."""
        grip, ahead = self.grip(0), self.outgoing[1]
        return 0.0 if grip is None else up(max(0.0, grip[1] - ahead))

    @property
    def shed(self) -> Box:
        """The shed that the outfeed takes products into, in the world: its shutter is a clearance
        ahead of a product that is dropped off, and of the hand that does so."""
        xlo, xhi, ylo, yhi = self.outgoing
        x, y = self.guidepaths[0].a
        start = x + xhi + self.hand_ahead + self.clearance
        return start, start + WALL + BEHIND + xhi - xlo + SIDE, y + ylo - SIDE, y + yhi + SIDE

    @property
    def shutter_stroke(self) -> float:
        """Stroke of the shed's shutter: from above any product to the belt [m]."""
        return float(self.product.high[2] - self.product.low[2]) + PLAY + BELT_GAP + TRAY

    @cached_property
    def product_length(self) -> float:
        """Length of the finished product along the output robot's heading [m]."""
        return self.outgoing[1] - self.outgoing[0]


def _grip(layout: Layout, robot: int) -> Extent | None:
    hand = layout.hand(robot)
    return None if hand is None else grip_of(hand, layout.mount(robot))
