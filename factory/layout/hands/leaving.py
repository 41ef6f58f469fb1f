"""Hands that have to be gone before what they have delivered goes on.

Most hands let go of a payload that can then leave at once. Where something of it would meet the
hand on its way, or another hand would that comes to the station, its carrier waits for the hand to
be clear. The hand's robot raises its lift, or goes home as far as it has to, as soon as it has let
go, whatever comes next, so the wait ends.
"""

from __future__ import annotations

from collections.abc import Iterator

from factory.control.mode import ROUNDING
from factory.layout.dimensions import up
from factory.layout.feeding import passing
from factory.layout.hands.hand import Hand
from factory.layout.hands.limbs import rises_first
from factory.layout.hands.meeting import delivered_at, guests, meetings
from factory.layout.layout import Layout
from factory.nets.coordinated import Past
from factory.plant.factory import Operation

SPARE = 0.001
"""A hand is clear that is so far from all that it has delivered to [m]."""

NEAR = 0.001
"""A robot that has to be clear goes on by so much at the least [m]."""

ON = 0.009
"""A robot whose hand has to be clear goes on by so much: it does not slow down before [m]."""


def leavings(layout: Layout) -> dict[int, tuple[Past, ...]]:
    """For each operation (index) the hands that must be clear before it starts: those that have
    delivered to its carrier, where their payload waits for them; before a carrier comes home with a
    tall hand, those of all that deliver to it; and before a robot goes home whose hand is above
    what it has let go, its own."""
    waits: dict[int, list[Past]] = {}
    for robot in layout.factory.robots:
        for number, gone in _going_on(layout, robot.index):
            waits.setdefault(number, []).append(gone)
        before, tours = list[Past](), layout.factory.tours[robot.index]
        hand = layout.hand(robot.index)
        if hand is not None and hand.tall:
            before += [
                _back(layout, guest, operation.index, _behind(layout, guest, operation))
                for operation, guest, _ in _delivering(layout, robot.index)
            ]
        rises = rises_first(layout, robot.index)
        for last, tour in zip((*tours[-1:], *tours), tours, strict=False):
            own = [raised(layout, robot.index, last[-1])] if rises else []
            if before or own:
                waits.setdefault(tour[0], []).extend((*own, *before))
    return {number: tuple(dict.fromkeys(passes)) for number, passes in waits.items()}


def _going_on(layout: Layout, carrier: int) -> Iterator[tuple[int, Past]]:
    """Operations (index) of a carrier, each with a hand that has delivered to it in one before, and
    must be clear of what is there or comes there."""
    gear = layout.factory.robots[carrier].operations
    for operation, guest, hand in _delivering(layout, carrier):
        step = gear.index(operation.index) + 1
        for number, back in enumerate(hand.waits):
            if back:
                later = gear[(step + number) % len(gear)]
                yield later, _gone(layout, guest, operation.index, back)
    for met in meetings(layout, carrier):
        yield met.starts, _back(layout, met.robot, met.delivers, met.far)


def _delivering(layout: Layout, carrier: int) -> Iterator[tuple[Operation, int, Hand]]:
    """The robots with hands that deliver to a carrier, each with its hand, and the operation in
    which it does."""
    for operation, guest in guests(layout, carrier):
        hand = layout.hand(guest)
        if hand is not None and hand.kind != "none":
            yield operation, guest, hand


def awaited_positions(layout: Layout) -> dict[int, float]:
    """Where robots go as soon as they have let go, since what they have delivered waits for that:
    clear of it; and home those whose hands have to be there before what they take, unless others
    could be where a tall hand comes to. Where robots have several tours, one may have nothing more
    to bring while its carrier comes home for another: it goes clear of that. And further, where the
    layout's certificate asks for that."""
    found: dict[int, float] = {}
    factory, backs = layout.factory, [0.0] * len(layout.factory.robots)
    for carrier in factory.robots if layout.hands else ():
        for back in meetings(layout, carrier.index):
            backs[back.robot] = max(backs[back.robot], back.far)
        hand = layout.hand(carrier.index)
        if hand is not None and hand.tall:
            for operation, guest, _ in _delivering(layout, carrier.index):
                if len(factory.tours[guest]) < len(factory.tours[carrier.index]):
                    backs[guest] = max(backs[guest], _behind(layout, guest, operation))
    for robot, hand in enumerate(layout.hands):
        if hand is None or hand.kind == "none":
            continue
        first = factory.operations[factory.robots[robot].operations[0]]
        if hand.first and not (first.inputs and hand.tall):
            found[robot] = layout.guidepaths[robot].length
            continue
        far = max(backs[robot], 0.0 if rises_first(layout, robot) else hand.clear)
        if far:
            found[robot] = gone_by(layout, robot, _least(layout, robot, far))
    if layout.certificate is not None and layout.certificate.is_of(factory):
        for robot, at in layout.certificate.backs:
            found[robot] = max(at, found.get(robot, 0.0))
    return found


def gone_by(layout: Layout, robot: int, least: float) -> float:
    """Where a robot goes so that it comes past a point: on a little, if it can [m]."""
    return min(least + ON, max(least + NEAR, _before_next(layout, robot)))


def crowded(layout: Layout) -> dict[int, float]:
    """How far robots are to go at the least, from where they deliver, so that hands that hold from
    above get out of the way before they come to where the next part comes down [m]."""
    found = dict[int, float]()
    for robot, at in awaited_positions(layout).items():
        further = at - _before_next(layout, robot)
        if further > ROUNDING:
            found[robot] = up(layout.guidepaths[robot].travel + further)
    return found


def _before_next(layout: Layout, robot: int) -> float:
    """How far back a robot may be while its next part comes down, an arc length [m]: not as far as
    that where its hand is above what it takes."""
    length, hand = layout.guidepaths[robot].length, layout.hand(robot)
    tours = layout.factory.tours[robot] if hand is not None and hand.kind == "above" else ()
    firsts = (layout.factory.operations[tour[0]] for tour in tours)
    ways = (passing(layout, leaf) for leaf in firsts if not leaf.inputs)
    return length - max(ways, default=0.0)


def goes_early(layout: Layout) -> list[tuple[int, int]]:
    """The operations (index) ahead of which robots go where they are awaited, whatever else."""
    count = len(layout.factory.robots)
    awaited = [r for r in awaited_positions(layout) if r < count]
    return [(tour[0], r) for r in awaited for tour in layout.factory.tours[r]]


def raised(layout: Layout, robot: int, after: int) -> Past:
    """When a robot's lift is up after an operation (index)."""
    axis = len(layout.factory.robots) + list(layout.lifts).index(robot)
    return Past(2 * after + 1, axis, layout.strokes[robot] - SPARE)


def _gone(layout: Layout, robot: int, after: int, back: float) -> Past:
    """When a robot's hand is clear of what it has to go back from by so much [m], or its lift is
    up, after an operation (index)."""
    if rises_first(layout, robot):
        return raised(layout, robot, after)
    return _back(layout, robot, after, back)


def _back(layout: Layout, robot: int, after: int, back: float) -> Past:
    """When a robot has gone back by so much [m], wherever it delivers, after an operation
    (index)."""
    return Past(2 * after + 1, robot, _least(layout, robot, back))


def _least(layout: Layout, robot: int, back: float) -> float:
    """Where a robot is that has gone back by so much, wherever it delivers [m]."""
    least = max(delivered_at(layout, robot)) + back + SPARE
    return min(least, layout.guidepaths[robot].length - SPARE)


def _behind(layout: Layout, robot: int, operation: Operation) -> float:
    """How far a robot's hand goes back until all of it is behind what it has delivered to [m]."""
    path, grip = layout.guidepaths[robot], layout.grip(robot)
    assert grip is not None
    box = layout.held(robot, operation.index, operation.label)
    return max(0.0, grip[1] - path.frame(box)[0])
