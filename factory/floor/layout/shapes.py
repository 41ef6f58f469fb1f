"""The shapes that stretching and packing work with: piles in the frame of the robot that carries
them, arms, lanes."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

from factory.floor.geometry.solids import Product
from factory.floor.layout.branches import carriers
from factory.floor.layout.dimensions import FINGER, PAYLOAD, Clearance
from factory.floor.layout.hands.choosing import Hands
from factory.floor.layout.hands.hand import Hand, Point3
from factory.floor.layout.hands.mounted import Mount, grip_of
from factory.floor.layout.stops import carried
from factory.floor.layout.sweeps import piles
from factory.support.boxes import Box, Extent, Point2, hull, moved, project
from factory.support.decimals import up
from factory.theory.plant.factory import Factory
from factory.theory.problem.pag import NOPART
from factory.theory.problem.robot_bodies import MAST

Frame = tuple[Point2, Point2]
"""(u, t): how a robot lies on the floor."""

OUTPUT: Frame = ((1.0, 0.0), (0.0, 1.0))
"""How the output robot does."""

Sides = dict[int, int]
"""For each robot but the first: +1 where it stands on the side t of its carrier's path, else -1."""

NONE: Point3 = (0.0, 0.0, 0.0)

NOWHERE: Extent = (0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Shape:
    """What the layout must know of a robot: the box of each pile it carries, by operation, and
    of the last one, how far its carriage line is to the side, how far behind the middle its arm
    ends and its carriage is (`reach`, 2r), how far ahead its finger goes (`nest`), how far its lane
    reaches to either side for relays (`spread`), and its `least` travel [m]; its `hand`, None
    where none is chosen, and the box `grip` of what of that is among the payloads; how far to the
    side the `post` of its feeder stands [m]; by operation how far the product's middle is ahead, to
    the side and above where the robot has it on its first tour (`shifts`), nothing where it is
    always there: boxes are about the latter; whether it `travels` along a guidepath."""

    piles: Mapping[int, Extent]
    last: Extent
    offset: float
    arm: float
    reach: float
    nest: float
    tool: bool
    spread: float = 0.0
    hand: Hand | None = None
    grip: Extent | None = None
    post: float = 0.0
    least: float = 0.0
    shifts: Mapping[int, Point3] = field(default_factory=dict)
    travels: bool = True

    def shift(self, operation: int) -> Point3:
        """Displacement of the product's middle, ahead, to the side and above, from where the
        guidepath has it, on the tour that contains an operation (index) [m]."""
        return self.shifts.get(operation, NONE)

    def laden(self, pile: Extent) -> Extent:
        """The box of a pile with the hand that holds it."""
        return hull([pile, self.grip]) if self.grip else pile


def turned(frame: Frame, side: int) -> Frame:
    """The frame of a robot on one side of a path with a frame: on side +1 it heads against t."""
    u, t = frame
    return (-side * t[0], -side * t[1]), u


def headings(factory: Factory, sides: Sides) -> list[Frame]:
    """The frame of each robot."""
    frames: list[Frame] = []
    for robot, carrier in enumerate(carriers(factory)):
        frames.append(turned(frames[carrier], sides[robot]) if carrier >= 0 else OUTPUT)
    return frames


def payload_boxes(factory: Factory, product: Product) -> dict[str, Box]:
    """The box of every sub-assembly about the product's middle [m], by label, from the geometry of
    its parts.

    Args:
        factory: the factory.
        product: its solids.
    """
    return {label: pile.box for label, pile in piles(factory, product).items()}


def symmetric_shapes(factory: Factory, payloads: Mapping[str, Box], c: Clearance) -> list[Shape]:
    """Shapes whose extents are the same in every direction, to choose the sides by."""
    shapes = []
    for robot in range(len(factory.robots)):
        halves = {
            number: max(map(abs, payloads[factory.operations[number].label]))
            for number in carried(factory, robot)
        }
        boxes = {number: (-half, half, -half, half) for number, half in halves.items()}
        tool = is_tool(factory, robot)
        last = _last(factory, robot, boxes)
        shapes.append(Shape(boxes, last, 0.0, c.rim, c.reach(c.rim), 0.0, tool))
    return shapes


def oriented_shape(
    factory: Factory,
    payloads: Mapping[str, Box],
    robot: int,
    carrier: int,
    frame: Frame,
    c: Clearance,
    wide: Collection[int] = (),
) -> Shape:
    """The shape of a robot that lies in a frame. Its arm ends beside the line of its carrier, which
    runs beside the product's middle as the carrier's last pile lies. `wide`: robots with room for
    relays, which run to either side of such a line."""

    def lies(number: int) -> Extent:
        return project(payloads[factory.operations[number].label], *frame)

    boxes = {number: lies(number) for number in carried(factory, robot)}
    tool = is_tool(factory, robot)
    if tool:
        shifts = _fronts_of_guests(factory, payloads, robot, frame)
    else:
        shifts = _fronts(factory, robot, boxes)
    boxes = {number: moved(box, shifts.get(number, NONE)[:2]) for number, box in boxes.items()}
    last = _last(factory, robot, boxes)
    lane, belt = 0.0, c.c - last[0]
    if carrier >= 0:
        delivered = (payloads[label] for label in factory.deliveries(carrier))
        along = hull([project(box, *frame) for box in delivered])
        lane, belt = -round((along[0] + along[1]) / 2, 3), 0.0
        lane += c.spread if carrier in wide else 0.0
    held = last
    if tool:
        under = factory.robots[robot].operations
        held = hull([moved(lies(n), shifts.get(n, NONE)[:2]) for n in under])
    back = up(max(0.0, *(-ahead for ahead, _, _ in shifts.values()), 0.0))
    arm = up(max(c.rim, c.rim + lane, belt) + back)
    offset, nest = round((held[2] + held[3]) / 2, 3), round((held[0] + held[1]) / 2, 3)
    spread = c.spread if robot in wide else 0.0
    reach = up(c.reach(arm, lane + back))
    return Shape(boxes, last, offset, arm, reach, nest, tool, spread, post=offset, shifts=shifts)


def _fronts(factory: Factory, robot: int, boxes: Mapping[int, Extent]) -> dict[int, Point3]:
    """By operation how far ahead a robot that brings several parts, one by one, and has no hand
    holds them: their front ends are in one place, so that it goes no further for one than it has
    to; nothing for others, nor for the output robot of a mix: the outfeed is in one place."""
    tours = factory.tours[robot]
    output = robot == 0 and factory.pag.mix is not None
    if output or len(tours) == 1 or any(len(tour) != 2 for tour in tours):
        return {}
    front = max(boxes[tour[0]][1] for tour in tours)
    ahead = {tour: round(front - boxes[tour[0]][1], 6) for tour in tours}
    return {number: (ahead[tour], 0.0, 0.0) for tour in tours for number in tour}


def _fronts_of_guests(
    factory: Factory, payloads: Mapping[str, Box], tool: int, frame: Frame
) -> dict[int, Point3]:
    """By operation how far ahead of a tool that has no hand the product is, since the robot that
    brings what the tool works on, from the other side, holds it there."""
    (x, y), t = frame
    shifts: dict[int, Point3] = {}
    for number, guest in guests_at(factory, tool).items():
        boxes = {
            n: project(payloads[factory.operations[n].label], (-x, -y), t)
            for n in carried(factory, guest)
        }
        ahead = _fronts(factory, guest, boxes).get(number, NONE)[0]
        if ahead:
            shifts[number] = (-ahead, 0.0, 0.0)
    return shifts


def guests_at(factory: Factory, tool: int) -> dict[int, int]:
    """By the operations of a tool the robot that brings what it works on, if there is one."""
    made: dict[int, int] = {}
    for number in factory.robots[tool].operations:
        operation = factory.operations[number]
        for robot, label in zip(operation.robots, operation.before, strict=True):
            if label != NOPART and robot != operation.carrier:
                made[number] = robot
    return made


def held_shape(
    hands: Hands,
    payloads: Mapping[str, Box],
    robot: int,
    carrier: int,
    frame: Frame,
    c: Clearance,
    wide: Collection[int] = (),
) -> Shape:
    """The shape of a robot with a hand that lies in a frame. Its guidepath runs under the line of
    its hand; its arm ends beside the line of its carrier. A tower stands behind all that its
    payload is joined to; that of a robot which holds a feeder's part from above passes beside the
    part too. `wide`: robots with room for relays, which run to either side of such a line."""
    factory, (u, t), moves = hands.factory, frame, _moves(hands, robot, carrier, frame)
    operations, shifts = factory.operations, moves[0]

    def lies(label: str, number: int) -> Extent:
        return moved(project(payloads[label], *frame), shifts.get(number, NONE)[:2])

    def line(robot: int, heading: Point2, side: Point2) -> float:
        across = 0 if side[0] else 1
        at = hands.line(robot, heading) - float(hands.holding.product.middle[across])
        return round(at * side[across], 3)

    boxes = {n: lies(operations[n].label, n) for n in carried(factory, robot)}
    last, hand = _last(factory, robot, boxes), hands.hand(robot, u, t)
    lane, belt = 0.0, c.c - last[0]
    if carrier >= 0:
        lane = -line(carrier, t, u) + (c.spread if carrier in wide else 0.0)
        belt = 0.0
    arm = up(max(c.rim, c.rim + lane, belt) + moves[1])
    reach = up(c.reach(arm, lane + moves[1]))
    spread = c.spread if robot in wide else 0.0
    if hand is None:
        held = hull([lies(operations[n].label, n) for n in factory.robots[robot].operations])
        offset, nest = round((held[2] + held[3]) / 2, 3), round((held[0] + held[1]) / 2, 3)
        return Shape(boxes, last, offset, arm, reach, nest, True, spread, shifts=shifts)
    x, y = (hands.holding.product.middle[:2]).tolist()
    pads = [(px - x, py - y) for px, py, _ in hand.places]
    ahead = [px * u[0] + py * u[1] for px, py in pads]
    offset = post = round(pads[0][0] * t[0] + pads[0][1] * t[1], 3)
    least = 0.0
    if hand.kind.tall:
        ends = [tour[-1] for tour in factory.tours[robot]]
        final = [last if factory.drops(n) else lies(operations[n].label, n) for n in ends]
        rear = min(joined[0] for joined in final)
        reach = arm = up(max(reach, c.c + MAST / 2 - rear))
        if hand.kind.hangs and hands.is_fed(robot):
            post, offset = round((last[2] + last[3]) / 2, 3), round(last[2] - c.c - MAST / 2, 3)
            if hand.wait and not factory.lowers(robot):
                thick = 2 * max(hand.radius, FINGER / 2)
                least = last[1] + max(ahead) - min(ahead) + thick - rear + 2 * c.c
    least = max(least, hands.travels.get(robot, 0.0))
    over = PAYLOAD - float(hands.holding.product.low[2])
    grip, nest = grip_of(hand, Mount(u, t, reach, arm, offset, (x, y), over)), round(max(ahead), 6)
    travels = factory.robots[robot].travels
    least, extents = up(least), (offset, arm, reach, nest, False, spread)
    return Shape(boxes, last, *extents, hand, grip, post, least, shifts, travels)


def _moves(hands: Hands, robot: int, carrier: int, frame: Frame) -> tuple[dict[int, Point3], float]:
    """By operation how far the product's middle is ahead of and beside where a robot's guidepath
    has it; and how much further behind it has to stay, since it delivers further ahead than that
    where its carrier's line is [m]."""
    (u, t), factory = frame, hands.factory
    if is_tool(factory, robot):
        of_robot = _shifts_of_guests(hands, robot, frame)
    else:
        of_robot = hands.shifts(robot, u, t)
    carriers = hands.shifts(carrier, t) if carrier >= 0 else ()
    if not any(map(any, (*of_robot, *carriers))):
        return {}, 0.0
    moves, back = dict[int, Point3](), 0.0
    for number, tour in enumerate(factory.tours[robot]):
        x, y, z = of_robot[number] if of_robot else NONE
        ahead = round(x * u[0] + y * u[1], 6)
        moves |= dict.fromkeys(tour, (ahead, round(x * t[0] + y * t[1], 6), z))
        if carriers:
            x, y, _ = carriers[factory.turns[tour[-1], carrier]]
            ahead -= x * u[0] + y * u[1]
        back = max(back, -ahead)
    return moves, up(back)


def _shifts_of_guests(hands: Hands, tool: int, frame: Frame) -> tuple[Point3, ...]:
    """For each tour of a tool the displacement of the product by the robot that brings what it
    works on, from the other side."""
    (x, y), t = frame
    factory, guests = hands.factory, guests_at(hands.factory, tool)
    shifts = []
    for number in (tour[-1] for tour in factory.tours[tool]):
        guest = guests.get(number)
        of_guest = () if guest is None else hands.shifts(guest, (-x, -y), t)
        turn = factory.turns[number, guest] if of_guest and guest is not None else 0
        shifts.append(of_guest[turn] if of_guest else NONE)
    return tuple(shifts)


def is_tool(factory: Factory, robot: int) -> bool:
    """Whether a robot is a tool: it never carries anything."""
    return robot > 0 and not factory.deliveries(robot)


def _last(factory: Factory, robot: int, boxes: Mapping[int, Extent]) -> Extent:
    """The box of everything that a robot delivers."""
    ends = [n for tour in factory.tours[robot] for n in [m for m in tour if m in boxes][-1:]]
    return hull([boxes[number] for number in ends]) if ends else NOWHERE
