"""Hands that would meet at a station, where robots come to one carrier from either side, one after
the other: how far the one goes back before the other comes.

What robots that come at once have to do with each other is settled where hands are chosen
(`apart.py`), and so is what a hand has to do with the parts that come later, but for its tower,
which stands behind what it has delivered to then. One that is lifted goes up, and stays there over
the station, unless something here makes it go back.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from factory.control.mode import Index
from factory.geometry.meshes import Array
from factory.layout.dimensions import PAYLOAD
from factory.layout.guidepath import Box, hull
from factory.layout.hands.apart import BESIDE
from factory.layout.hands.limbs import limbs, rises_first
from factory.layout.layout import Layout
from factory.layout.stops import stops_of
from factory.plant.factory import Operation
from factory.problem.pag import NOPART

FAR = 100.0
"""As far as anything comes from [m]."""


@dataclass(frozen=True, slots=True)
class Back:
    """A robot (index) that has delivered in an operation (index) has gone back by `far` [m] before
    another operation of the same carrier starts (index)."""

    robot: int
    delivers: int
    starts: int
    far: float


def meetings(layout: Layout, carrier: int) -> Iterator[Back]:
    """The robots that have to go back after they have delivered to a carrier, and by how much."""
    axis = 0 if layout.guidepaths[carrier].heading[0] else 1
    coming_here = [
        (
            layout.guidepaths[robot].a[axis],
            operation,
            robot,
            _boxes(layout, robot, _goal(layout, operation, robot)),
        )
        for operation, robot in guests(layout, carrier)
        if layout.hand(robot) is not None
    ]
    coming_here.sort(key=lambda guest: guest[0])
    places = [at for at, _, _, _ in coming_here]
    breadths = (_breadth(layout, robot, own, axis) for _, _, robot, own in coming_here)
    beside, added = max(breadths, default=0.0), [*_added(layout, carrier)]
    for at, operation, robot, own in coming_here:
        heading, lifted = layout.guidepaths[robot].heading, rises_first(layout, robot)
        near = slice(bisect_left(places, at - beside), bisect_right(places, at + beside))
        for _, later, other, _ in coming_here[near]:
            if later is not operation and layout.guidepaths[other].heading != heading:
                back = _back(own, _coming(layout, other), heading)
                if lifted:
                    back = max(back, _back(own, _brought(layout, other, carrier), heading))
                if back:
                    yield Back(robot, operation.index, later.index, back)
        if lifted and (back := _back(own, _going(layout, carrier, operation), heading)):
            after = following(layout, carrier, operation.index)
            yield Back(robot, operation.index, after, back)
        yield from _past(layout, carrier, (operation, robot, own), added)


def following(layout: Layout, robot: int, operation: int) -> int:
    """The operation (index) of a robot after one of its own."""
    gear = layout.factory.robots[robot].operations
    return gear[(gear.index(operation) + 1) % len(gear)]


def guests(layout: Layout, carrier: int) -> Iterator[tuple[Operation, int]]:
    """The robots that deliver to a carrier, each with the operation in which it does."""
    for number in layout.factory.robots[carrier].operations:
        operation = layout.factory.operations[number]
        if operation.carrier == carrier:
            for robot, label in zip(operation.robots, operation.before, strict=True):
                if robot != carrier and label != NOPART:
                    yield operation, robot


def _breadth(layout: Layout, robot: int, boxes: Array, axis: int) -> float:
    """How broad a robot's hand, in `boxes` (n, 2, 3), and payload are together along an axis across
    its way [m]."""
    box = hull([*_delivered(layout, robot)])
    hand = boxes[:, :, axis] - layout.guidepaths[robot].a[axis]
    return 2 * float(max(abs(hand).max(initial=0.0), -box[2 * axis], box[2 * axis + 1]))


def _delivered(layout: Layout, robot: int) -> Iterator[Box]:
    """The boxes of what a robot delivers, about the middle that its guidepath tells."""
    for tour, label in zip(
        layout.factory.tours[robot], layout.factory.deliveries(robot), strict=True
    ):
        yield layout.held(robot, tour[-1], label)


def delivered_at(layout: Layout, robot: int) -> list[float]:
    """Where a robot delivers on each of its tours, arc lengths [m]."""
    operations = (layout.factory.operations[tour[-1]] for tour in layout.factory.tours[robot])
    return [_goal(layout, operation, robot) for operation in operations]


def _goal(layout: Layout, operation: Operation, robot: int) -> float:
    """Where a robot has its goal in an operation, an arc length [m]."""
    path = layout.guidepaths[robot]
    return path.reach + layout.apart(operation.index, operation.robots.index(robot))[0]


def _boxes(layout: Layout, robot: int, at: float | None = None, up: float | None = None) -> Array:
    """The boxes (n, 2, 3) of a robot's hand in the world, where it delivers or `at` an arc length
    [m], and with its lift `up`, all the way if that is not said."""
    path = layout.guidepaths[robot]
    (x, y), (u, v) = path.carriage(path.reach if at is None else at), path.heading
    stroke = layout.strokes.get(robot, 0.0) if up is None else up
    found = []
    for limb in limbs(layout, robot):
        ends = np.array([limb.low, limb.high])
        rise = stroke * limb.lifted
        plan = np.array([x, y]) + ends[:, :1] * [u, v] + ends[:, 1:2] * [-v, u]
        low, high = plan.min(axis=0), plan.max(axis=0)
        found.append([[*low, ends[0, 2] + rise], [*high, ends[1, 2] + rise]])
    return np.array(found).reshape(-1, 2, 3)


def _coming(layout: Layout, robot: int) -> Array:
    """What the hand of a robot sweeps as it comes to its station, up or down."""
    down, raised = _boxes(layout, robot, up=0.0), _boxes(layout, robot)
    (u, v), swept = layout.guidepaths[robot].heading, np.stack([down[:, 0], raised[:, 1]], axis=1)
    return _onward(swept, (-u, -v))


def _brought(layout: Layout, robot: int, carrier: int) -> Array:
    """What the parts sweep that a robot brings to be added on a carrier."""
    path, labels = layout.guidepaths[robot], layout.factory.deliveries(robot)
    tours = zip(layout.factory.tours[robot], labels, strict=True)
    contents = layout.factory.contents
    boxes = np.concatenate(
        [_parts(layout, contents[label], (robot, carrier), tour[-1]) for tour, label in tours]
    )
    boxes[:, :, :2] += path.a
    boxes[:, 1, 2] += layout.strokes.get(robot, 0.0)
    return _onward(boxes, (-path.heading[0], -path.heading[1]))


def _past(
    layout: Layout,
    carrier: int,
    guest: tuple[Operation, int, Array],
    added: Iterable[tuple[tuple[int, ...], Array, Index]],
) -> Iterator[Back]:
    """How far a robot that has delivered to a carrier in an operation, with a hand in some boxes
    there, goes back from what the carrier then takes past it: its tower from what is added on the
    same tour, or all of it, which is up, from all that is there; and from what comes from home on
    another. As `meetings`."""
    (operation, robot, own), path = guest, layout.guidepaths[carrier]
    x, y = path.middle(layout.goal(operation.index, operation.robots.index(carrier)))
    tower = own[[limb.name == "tower" for limb in limbs(layout, robot)]]
    heading, back = layout.guidepaths[robot].heading, (-path.heading[0], -path.heading[1])
    _, returns = stops_of(layout.factory, carrier)
    for tour, boxes, step in added:
        swept = _onward(boxes + np.array([x, y, 0.0]), path.heading)
        if returns:
            swept = _onward(swept, back)
        if operation.index not in tour:
            if not returns and any(robot in layout.factory.operations[n].robots for n in tour):
                continue  # it comes again before that, so it has been at home
            begins = tour[min(1, len(tour) - 1)]
            if far := _back(own, swept, heading, 0.0):
                yield Back(robot, operation.index, begins, far)
            continue
        at = tour.index(operation.index)
        if rises_first(layout, robot):
            ways, then = _ways(own, swept, heading, 0.0), np.maximum(step, at + 1)
        else:
            ways, then = _ways(tower, swept, heading, 0.0) * (step > at), step
        for later in np.unique(then[ways > 0]).tolist():
            begins = tour[later] if later < len(tour) else following(layout, carrier, tour[-1])
            far = round(float(ways[then == later].max()), 6)
            yield Back(robot, operation.index, begins, far)


def _added(layout: Layout, carrier: int) -> Iterator[tuple[tuple[int, ...], Array, Index]]:
    """The tours of a carrier on which it takes something, with the boxes (n, 2, 3) of the parts
    that it has in the end, about its middle, and for each in which step of the tour it comes
    (n,)."""
    factory = layout.factory
    for tour in factory.tours[carrier]:
        comes = dict[str, int]()
        for step, number in enumerate(tour):
            operation = factory.operations[number]
            if operation.carrier == carrier and not factory.drops(number):
                for part in factory.contents[operation.label]:
                    comes.setdefault(part, step)
        if comes:
            boxes = _parts(layout, comes, (carrier, carrier), tour[0])
            yield tour, boxes, np.array([*comes.values()])


def _parts(layout: Layout, parts: Iterable[str], robots: tuple[int, int], operation: int) -> Array:
    """The boxes (n, 2, 3) of parts about the middle that the guidepath of the first of two robots
    tells, on its tour with an operation (index), as high as the second has them there."""
    product, (robot, carrier) = layout.product, robots
    solids = [product.solids[part] for part in parts]
    boxes = np.array([[solid.low, solid.high] for solid in solids]) - product.middle
    boxes[:, :, :2] += layout.shift(robot, operation)
    boxes[:, :, 2] += PAYLOAD + product.middle[2] - product.low[2]
    boxes[:, :, 2] += layout.elevation(carrier, operation)
    return boxes


def _going(layout: Layout, carrier: int, operation: Operation) -> Array:
    """What the tall hand of a carrier sweeps as it goes on from an operation."""
    hand = layout.hand(carrier)
    if hand is None or not hand.tall:
        return np.zeros((0, 2, 3))
    at = layout.goal(operation.index, operation.robots.index(carrier))
    down, raised = (_boxes(layout, carrier, at, up) for up in (0.0, None))
    swept = np.stack([down[:, 0], raised[:, 1]], axis=1)
    return _onward(swept, layout.guidepaths[carrier].heading)


def _onward(boxes: Array, way: tuple[float, float]) -> Array:
    """Boxes, drawn out along a way of the world."""
    found = boxes.copy()
    for axis, along in enumerate(way):
        if along:
            found[:, 1 if along > 0 else 0, axis] += FAR * along
    return found


def _back(own: Array, others: Array, heading: tuple[float, float], over: float = BESIDE) -> float:
    """How far boxes (n, 2, 3) go back against a heading until they meet no others (m, 2, 3), nor
    are less than so far `over` or under them [m]."""
    return round(float(_ways(own, others, heading, over).max(initial=0.0)), 6)


def _ways(own: Array, others: Array, heading: tuple[float, float], over: float = BESIDE) -> Array:
    """The same for each of the others (m,), which they may not meet, nor be less than so far `over`
    or under [m]."""
    axis = 0 if heading[0] else 1
    low = np.maximum(own[:, None, 0], others[None, :, 0])
    high = np.minimum(own[:, None, 1], others[None, :, 1])
    spare = np.array([BESIDE, BESIDE, over])
    spare[axis] = 0.0
    meets = (high - low > -spare).all(axis=2)
    front = own[:, 1, axis] if heading[axis] > 0 else -own[:, 0, axis]
    near = others[:, 0, axis] if heading[axis] > 0 else -others[:, 1, axis]
    ways = np.where(meets, front[:, None] - near[None] + BESIDE, 0.0)
    return np.asarray(ways.max(axis=0, initial=0.0))
