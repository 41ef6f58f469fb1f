"""Hands that would meet at a station, where robots come to one carrier from either side, one after
the other: how far the one goes back before the other comes.

What robots that come at once have to do with each other is settled where hands are chosen
(`apart.py`), and so is what a hand has to do with the parts that come later, but for its tower,
which stands behind what it has delivered to then. One that is lifted goes up, and stays there over
the station, unless something here makes it go back.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterator

import numpy as np

from factory.geometry.meshes import Array
from factory.layout.dimensions import PAYLOAD
from factory.layout.guidepath import Box, hull
from factory.layout.hands.apart import BESIDE
from factory.layout.hands.limbs import limbs, rises_first
from factory.layout.layout import Layout
from factory.plant.factory import Operation
from factory.problem.pag import NOPART

FAR = 100.0
"""As far as anything comes from [m]."""


def meetings(layout: Layout, carrier: int) -> Iterator[tuple[int, int, float]]:
    """The robots that have to go back after they have delivered to a carrier: an operation (index)
    that has to wait for that, the robot, and how far it goes [m]."""
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
    beside = max(breadths, default=0.0)
    for at, operation, robot, own in coming_here:
        heading, lifted = layout.guidepaths[robot].heading, rises_first(layout, robot)
        tall = own if lifted else own[[limb.name == "tower" for limb in limbs(layout, robot)]]
        near = slice(bisect_left(places, at - beside), bisect_right(places, at + beside))
        for _, later, other, _ in coming_here[near]:
            if later is not operation and layout.guidepaths[other].heading != heading:
                back = _back(own, _coming(layout, other), heading)
                back = max(back, _back(tall, _brought(layout, other, carrier), heading))
                if back:
                    yield later.index, robot, back
        if lifted and (back := _back(own, _going(layout, carrier, operation), heading)):
            yield following(layout, carrier, operation.index), robot, back


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
    path, product = layout.guidepaths[robot], layout.product
    contents, labels = layout.factory.contents, layout.factory.deliveries(robot)
    tours = zip(layout.factory.tours[robot], labels, strict=True)
    parts = [(product.solids[p], tour[-1]) for tour, label in tours for p in contents[label]]
    boxes = np.array([[part.low, part.high] for part, _ in parts]) - product.middle
    boxes[:, :, :2] += path.a
    boxes[:, :, :2] += np.array([layout.shift(robot, last) for _, last in parts])[:, None]
    over = [layout.elevation(carrier, last) for _, last in parts]
    boxes[:, :, 2] += PAYLOAD + np.array(over)[:, None] + product.middle[2] - product.low[2]
    boxes[:, 1, 2] += layout.strokes.get(robot, 0.0)
    return _onward(boxes, (-path.heading[0], -path.heading[1]))


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


def _back(own: Array, others: Array, heading: tuple[float, float]) -> float:
    """How far boxes (n, 2, 3) go back against a heading until they meet no others (m, 2, 3) [m]."""
    axis = 0 if heading[0] else 1
    beside = [a for a in range(3) if a != axis]
    low = np.maximum(own[:, None, 0], others[None, :, 0])
    high = np.minimum(own[:, None, 1], others[None, :, 1])
    meets = (high - low > -BESIDE)[:, :, beside].all(axis=2) & (high - low > 0)[:, :, axis]
    front = own[:, 1, axis] if heading[axis] > 0 else -own[:, 0, axis]
    near = others[:, 0, axis] if heading[axis] > 0 else -others[:, 1, axis]
    ways = np.where(meets, front[:, None] - near[None] + BESIDE, 0.0)
    return round(float(ways.max(initial=0.0)), 6)
