"""Where the robots of a layout are while places of its coordinated net are marked, and what they
hold then.

From one operation of its gear to the next a robot waits, and then is in the mode of that. Where it
goes ahead while it waits, and where it has to come past points (`Past`), its way is cut: in each
segment the places on both sides of the passes are marked beside the wait or the mode.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from factory.floor.geometry.pieces import cylinder_piece
from factory.floor.geometry.turning import fed_of, turning_pieces
from factory.floor.layout.coordinating import HOME, Coordinated
from factory.floor.layout.dimensions import ARMS, CARRIAGES, PAYLOAD, PAYLOADS
from factory.floor.layout.guidepath import Guidepath
from factory.floor.layout.hands.limbs import Limb, limbs, rises_first
from factory.floor.layout.layout import Layout
from factory.floor.layout.presence import (
    ROUNDING,
    MachineBodies,
    Presence,
    Span,
    corners_of,
)
from factory.support.arrays import Array
from factory.theory.nets.coordinated import Past
from factory.theory.problem.ids import end_of, is_end, start_of
from factory.theory.problem.pag import NOPART
from factory.theory.problem.robot_bodies import ARM_LOW, ARM_TOP, ARM_WIDTH, CARRIAGE_TOP, MAST

LATE = 0.005
"""So much further than a point an axis may be when its pass fires [m]: a tick at full speed."""

Places = tuple[int, ...]

Sweep = tuple[Span, Span]
"""From where to where a robot's carriage goes, and its lift [m]."""

Segment = tuple[Places, tuple[Sweep, ...]]
"""A part of a robot's way: what is marked there, and how its axes go, one sweep after another."""


@dataclass(frozen=True, slots=True)
class Chain:
    """The passes of one axis after one transition: the `points` that it comes past [m], each with
    the place that ends there, the place `after` all of them, nothing where there are none, and
    whether that ends with the end of the operation to come (`beyond`), not with its start."""

    points: tuple[tuple[float, int], ...] = ()
    after: Places = ()
    beyond: bool = False

    def legs(self, begin: float, end: float) -> Iterator[tuple[Places, Span]]:
        """The way between two points, place by place."""
        way = 1.0 if end >= begin else -1.0
        for at, place in self.points:
            if (begin - at) * way >= 0.0 and begin != end:
                continue
            if (end - at) * way < 0.0 or begin == end:
                yield (place,), (begin, end)
                return
            late = at + way * LATE
            yield (place,), (begin, late if (end - late) * way >= 0.0 else end)
            begin = at
        yield self.after, (begin, end)


NO_PASS = Chain()


class Staying:
    """The presences of a layout's robots in its coordinated net. `awaited`: where those go while
    they wait that go back by themselves, by index, arc lengths [m]."""

    def __init__(self, layout: Layout, net: Coordinated, awaited: Mapping[int, float]) -> None:
        self.layout, self.net, self._awaited = layout, net, awaited
        self._own = [layout.kept(_own, robot.index) for robot in layout.factory.robots]
        self.partners, self._carried = _partners(layout), carried_ahead(layout)

    def presences(self) -> Iterator[Presence]:
        """All presences, robot by robot."""
        for robot in self.layout.factory.robots:
            index, partners = robot.index, self.partners[robot.index]
            for step, number in enumerate(robot.operations):
                operation = self.layout.factory.operations[number]
                label = operation.before[operation.robots.index(index)]
                bodies = self._own[index]
                if label != NOPART:
                    bodies += self.held(index, number, label)
                for places, sweeps in (*self._waits(index, step), *self._works(index, step)):
                    held = "" if label == NOPART else label
                    since = end_of(robot.operations[step - 1]) if label == NOPART else -1
                    fields = robot.name, places, bodies, sweeps, partners, False, held, since
                    yield Presence(index, *fields)

    def own(self, robot: int) -> MachineBodies:
        """Carriage, mast, arm and hand of a robot, with its axes at 0."""
        return self._own[robot]

    def held(self, robot: int, operation: int, label: str) -> MachineBodies:
        """The payload of a robot on its tour with an operation, with its axes at 0."""
        layout, product = self.layout, self.layout.product
        parts = layout.factory.contents[label]
        visit = layout.visits[operation, robot]
        (x, y), (dx, dy) = layout.guidepaths[robot].middle(0.0), visit.shift
        up = PAYLOAD - float(product.low[2]) + visit.height
        origin = np.array([x + dx, y + dy, up]) - [*product.middle[:2], 0.0]
        pieces = {part: layout.product.solids[part].pieces for part in parts}
        boxes = np.concatenate([self._pieces[part] for part in parts]) + origin
        if fed_of(product, parts):
            pieces = {parts[0]: turning_pieces(product.solids[parts[0]])}
            ends = [[piece.min(axis=0), piece.max(axis=0)] for piece in pieces[parts[0]]]
            boxes = np.array(ends) + origin
        count = len(boxes)
        return MachineBodies(
            tuple(part for part in parts for _ in self._pieces[part]),
            boxes,
            tuple(piece for part in parts for piece in pieces[part]),
            np.tile(origin, (count, 1)),
            np.full(count, PAYLOADS),
            np.ones(count, bool),
            *_way(layout, robot),
        )

    @cached_property
    def _pieces(self) -> Mapping[str, Array]:
        """The boxes (n, 2, 3) of the convex bodies of each part, in the product."""
        return {
            part: np.array([[piece.min(axis=0), piece.max(axis=0)] for piece in solid.pieces])
            if solid.mesh is not None
            else np.array([[solid.low, solid.high]])
            for part, solid in self.layout.product.solids.items()
        }

    def _waits(self, robot: int, step: int) -> Iterator[Segment]:
        """Before a step of its gear."""
        layout = self.layout
        before, number, wait = self._steps(robot, step)
        since, visit = layout.ways[number, robot]
        begin, goal, low, high = since.at, self.goal(robot, step), since.lift, visit.lift
        carriage, lift = self._chains(end_of(before), robot)
        begins = layout.factory.begins(robot, number)
        if begins and rises_first(layout, robot):
            first, _ = next(iter(carriage.legs(begin, begin)))
            for places, span in lift.legs(low, high):
                yield (wait, *first, *places), (((begin, begin), span),)
            low = high
        for places, span in carriage.legs(begin, goal):
            sweeps: tuple[Sweep, ...] = ((span, (low, low)),)
            if robot in layout.factory.adjusted and span[1] == goal:
                sweeps += (((goal, goal), (low, high)),)
            yield (wait, *places, *lift.after), sweeps
        if begins and not comes_last(layout, robot, number):
            home = layout.guidepaths[robot].length
            yield (wait, *carriage.after, *lift.after), (((home, home), (low, high)),)

    def _works(self, robot: int, step: int) -> Iterator[Segment]:
        """In a step of its gear, from wherever it may be by then."""
        layout, factory = self.layout, self.layout.factory
        before, number, _ = self._steps(robot, step)
        since, visit = layout.ways[number, robot]
        begin, end, goal = since.at, visit.at, self.goal(robot, step)
        low, high = since.lift, visit.lift
        carriage, lift = self._chains(end_of(before), robot)
        within, _ = self._chains(start_of(number), robot)
        begins = factory.begins(robot, number)
        home = [layout.guidepaths[robot].length] * begins
        if not carriage.beyond and carriage.points:
            begin, carriage = carriage.points[-1][0], NO_PASS
        far = max(goal, end, *home)
        if within.points:
            legs = within.legs(max(begin, far), end)
        elif carriage.points:
            legs = carriage.legs(begin, far)
        else:
            legs = NO_PASS.legs(min(begin, goal, end), max(begin, far))
        if begins and rises_first(layout, robot):
            low = high
        lowers = factory.lowers(robot) and factory.delivers(robot, number)
        after = lift.after if lift.beyond else ()
        for places, span in legs:
            sweeps: tuple[Sweep, ...] = ((span, (low, low if lowers else high)),)
            if lowers and min(span) <= end <= max(span):
                sweeps += (((end, end), (low, high)),)
            yield (factory.operations[number].place, *places, *after), sweeps

    def _steps(self, robot: int, step: int) -> tuple[int, int, int]:
        """The operation before a step of a gear, that of the step, and the wait in between."""
        gear = self.layout.factory.robots[robot].operations
        return gear[step - 1], gear[step], self.layout.factory.net.gears[robot].waiting(step)

    def goal(self, robot: int, step: int) -> float:
        """Where a robot goes in the wait before a step of its gear, an arc length [m]."""
        layout, (_, number, _) = self.layout, self._steps(robot, step)
        operation = layout.factory.operations[number]
        since, visit = layout.ways[number, robot]
        if (number, robot) in self._carried:
            return visit.at + self._carried[number, robot]
        if robot not in self._awaited or operation.before[operation.robots.index(robot)] != NOPART:
            return since.at
        return self._awaited[robot] if goes_home(layout, robot, number) else visit.at

    def _chains(self, after: int, robot: int) -> tuple[Chain, Chain]:
        """The passes of a robot's carriage that follow a transition, and of its lift."""
        up, chains = self.layout.factory.up(robot), self._by_axis
        lift = NO_PASS if up is None else chains.get((after, up), NO_PASS)
        return chains.get((after, robot), NO_PASS), lift

    @cached_property
    def _by_axis(self) -> Mapping[tuple[int, int], Chain]:
        """The chains by the transition that they follow and their axis."""
        coordinated, passes = self.net, dict[tuple[int, int], list[Past]]()
        for past in sorted(coordinated.passes, key=lambda past: past.at * past.direction):
            passes.setdefault((past.after, past.axis), []).append(past)
        net, after = coordinated.net, {coordinated.net.left[p]: p for p in coordinated.beside}
        chains = dict[tuple[int, int], Chain]()
        for (start, axis), along in passes.items():
            points = [(self._home(axis, p.at), coordinated.passes[p][0]) for p in along]
            last = after[net.right[points[-1][1]]]
            chains[start, axis] = Chain(tuple(points), (last,), is_end(net.right[last]))
        return chains

    def _home(self, axis: int, at: float) -> float:
        """Where a robot is that has passed a point: at home if the point is as good as there."""
        if axis >= len(self.layout.guidepaths):
            return at
        length = self.layout.guidepaths[axis].length
        return length if abs(length - at) <= HOME + ROUNDING else at


def goes_home(layout: Layout, robot: int, operation: int) -> bool:
    """Whether a robot that goes ahead before an operation goes home, not to where its visit is: it
    takes a part there, its hand is tall, or it moves several joints."""
    hand, chains = layout.hand(robot), layout.chains
    if chains is not None and robot in chains.robots:
        return True
    return not layout.factory.operations[operation].inputs or (hand is not None and hand.kind.tall)


def carried_ahead(layout: Layout) -> dict[tuple[int, int], float]:
    """For robots that go ahead of an operation with what they bring, by operation and robot
    (index), how far short of their places there they wait [m]."""
    chains, ahead = layout.chains, dict[tuple[int, int], float]()
    if chains is None:
        return ahead
    for operation in layout.factory.operations:
        short = chains.waits(operation.index)
        for robot, label in zip(operation.robots, operation.before, strict=True):
            if short is not None and robot in chains.robots and label != NOPART:
                ahead[operation.index, robot] = short
    return ahead


def comes_last(layout: Layout, robot: int, operation: int) -> bool:
    """Whether a robot comes home when the part of its feeder is down, as it is at the start of a
    run."""
    hand = layout.hand(robot)
    is_above = hand is not None and hand.kind.hangs
    return is_above and not layout.factory.operations[operation].inputs


def _own(layout: Layout, robot: int) -> MachineBodies:
    """Carriage, mast, arm and hand of a robot, with its axes at 0."""
    path, half = layout.guidepaths[robot], layout.factory.carriage / 2
    mast, arm = MAST / 2, ARM_WIDTH / 2
    rim = max(path.reach - path.arm, mast)
    bodies_of = [
        (Limb("carriage", (-half, -half, 0.0), (half, half, CARRIAGE_TOP)), CARRIAGES),
        (Limb("mast", (-mast, -mast, CARRIAGE_TOP), (mast, mast, ARM_TOP)), ARMS),
        (Limb("arm", (0.0, -arm, ARM_LOW), (rim, arm, ARM_TOP)), ARMS),
        *((limb, PAYLOADS) for limb in limbs(layout, robot)),
    ]
    ends = np.array([[limb.low, limb.high] for limb, _ in bodies_of])
    boxes = in_world(ends, path.heading, path.carriage(0.0))
    return MachineBodies(
        tuple(limb.name for limb, _ in bodies_of),
        boxes,
        tuple(map(_shape, boxes, (limb.round for limb, _ in bodies_of))),
        np.zeros((len(bodies_of), 3)),
        np.array([layer for _, layer in bodies_of]),
        np.array([limb.lifted for limb, _ in bodies_of]),
        *_way(layout, robot),
    )


def _shape(box: Array, round_: str) -> Array:
    """The corners (n, 3) of a limb in a box: a box, or a cylinder that stands."""
    return upright(box) if round_ == "z" else corners_of(box[None])[0]


def upright(box: Array) -> Array:
    """The corners (n, 3) of the cylinder that stands in a box."""
    low, high = box
    half, middle = (high - low) / 2, (low + high) / 2
    return np.asarray(cylinder_piece(float(half[0]), float(half[2])) + middle)


def in_world(boxes: Array, heading: tuple[float, float], at: tuple[float, float]) -> Array:
    """Boxes (n, 2, 3) of a frame whose x is a heading, along an axis of the world, and whose origin
    is at a point of the floor."""
    (u, v), ends = heading, boxes[:, :, :1]
    plan = np.sort(ends * [u, v] + boxes[:, :, 1:2] * [-v, u] + at, axis=1)
    return np.asarray(np.concatenate([plan, boxes[:, :, 2:]], axis=2))


def _way(layout: Layout, robot: int) -> tuple[Array, Guidepath | None]:
    """How a robot moves with its arc length: against its heading, along its bent guidepath, or not
    at all if it turns."""
    path = layout.guidepaths[robot]
    ahead = -1.0 if path.travels else 0.0
    return np.array([*path.heading, 0.0]) * ahead, path if path.way else None


def station(operation: int) -> int:
    """The number that a robot shares with the machine that gives it a part, or takes its product,
    in an operation (index) which is its alone."""
    return ~operation


def _partners(layout: Layout) -> list[frozenset[int]]:
    """For each robot the carriers that it works with, itself among them; for those on one stem
    themselves, since they are no partners of each other; and the stations that it has alone."""
    partners = [{robot} for robot in range(len(layout.guidepaths))]
    for operation in layout.factory.operations:
        if len(operation.robots) == 1:
            partners[operation.carrier].add(station(operation.index))
        on_stem = (robot for robot in operation.robots if robot in layout.stems)
        met = next(on_stem, operation.carrier)
        for robot in operation.robots:
            partners[robot].add(met)
    return [*map(frozenset, partners)]
