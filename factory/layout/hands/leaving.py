"""Hands that have to be gone before what they have delivered goes on.

Most hands let go of a payload that can then leave at once. Where something of it would meet the
hand on its way, or another hand would that comes to the station, its carrier waits for the hand to
be clear. The hand's robot raises its lift, or goes home as far as it has to, as soon as it has let
go, whatever comes next, so the wait ends.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from factory.control.mode import ROUNDING
from factory.layout.dimensions import up
from factory.layout.feeding import passing
from factory.layout.hands.hand import Hand
from factory.layout.hands.limbs import rises_first
from factory.layout.hands.meeting import delivered_at, following, guests, meetings
from factory.layout.layout import Layout
from factory.plant.factory import Operation

SPARE = 0.001
"""A hand is clear that is so far from all that it has delivered to [m]."""

NEAR = 0.001
"""A robot that has to be clear goes on by so much at the least [m]."""

ON = 0.009
"""A robot whose hand has to be clear goes on by so much: it does not slow down before [m]."""


@dataclass(frozen=True, slots=True)
class Leaving:
    """A hand is clear when its `axis` is at `least` [m] or beyond."""

    axis: int
    least: float


def leavings(layout: Layout) -> dict[int, tuple[Leaving, ...]]:
    """For each operation (index) the hands that must be clear before it starts: those that have
    delivered to its carrier in the operation before, where their payload waits for them; before a
    carrier comes home with a tall hand, those of all that deliver to it; and before a robot goes
    home whose hand is above what it has let go, its own."""
    found: dict[int, list[Leaving]] = {}
    for robot in layout.factory.robots:
        for number, leaving in going_on(layout, robot.index).items():
            found.setdefault(number, []).extend(leaving)
        before = list[Leaving]()
        if rises_first(layout, robot.index):
            before.append(raised(layout, robot.index))
        hand = layout.hand(robot.index)
        if hand is not None and hand.tall:
            before += [
                _gone_behind(layout, guest, operation)
                for operation, guest, _ in _delivering(layout, robot.index)
            ]
        for tour in layout.factory.tours[robot.index] if before else ():
            found.setdefault(tour[0], []).extend(before)
    return {number: tuple(dict.fromkeys(leaving)) for number, leaving in found.items() if leaving}


def going_on(layout: Layout, carrier: int, later: bool = True) -> dict[int, tuple[Leaving, ...]]:
    """For each operation (index) of a carrier the hands that have delivered to it in the one
    before, or `later` in any before, and must be clear of what is there or comes there."""
    found: dict[int, list[Leaving]] = {}
    gear = layout.factory.robots[carrier].operations
    for operation, guest, hand in _delivering(layout, carrier):
        step = gear.index(operation.index) + 1
        for number, back in enumerate(hand.waits if later else hand.waits[:1]):
            if back:
                awaited = found.setdefault(gear[(step + number) % len(gear)], [])
                awaited.append(_gone(layout, guest, back))
    for number, guest, back in meetings(layout, carrier):
        delivers = layout.factory.robots[guest].operations[-1]
        if later or following(layout, carrier, delivers) == number:
            found.setdefault(number, []).append(_back(layout, guest, back))
    return {number: tuple(leaving) for number, leaving in found.items()}


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
    to bring while its carrier comes home for another: it goes clear of that."""
    found: dict[int, float] = {}
    factory, backs = layout.factory, [0.0] * len(layout.factory.robots)
    for carrier in factory.robots if layout.hands else ():
        for _, guest, back in meetings(layout, carrier.index):
            backs[guest] = max(backs[guest], back)
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
        back = max(backs[robot], 0.0 if rises_first(layout, robot) else hand.clear)
        if back:
            least, end = _back(layout, robot, back).least, _before_next(layout, robot)
            found[robot] = min(least + ON, max(least + NEAR, end))
    return found


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


def raised(layout: Layout, robot: int) -> Leaving:
    """When a robot's lift is up."""
    axis = len(layout.factory.robots) + list(layout.lifts).index(robot)
    return Leaving(axis, layout.strokes[robot] - SPARE)


def _gone(layout: Layout, robot: int, back: float) -> Leaving:
    """When a robot's hand is clear of what it has to go back from by so much [m], or its lift is
    up."""
    return raised(layout, robot) if rises_first(layout, robot) else _back(layout, robot, back)


def _back(layout: Layout, robot: int, back: float) -> Leaving:
    """When a robot has gone back by so much [m], wherever it has delivered."""
    least = max(delivered_at(layout, robot)) + back + SPARE
    return Leaving(robot, min(least, layout.guidepaths[robot].length - SPARE))


def _gone_behind(layout: Layout, robot: int, operation: Operation) -> Leaving:
    """When all of a robot's hand has gone back behind what it has delivered to."""
    return _back(layout, robot, _behind(layout, robot, operation))


def _behind(layout: Layout, robot: int, operation: Operation) -> float:
    """How far a robot's hand goes back until all of it is behind what it has delivered to [m]."""
    path, grip = layout.guidepaths[robot], layout.grip(robot)
    assert grip is not None
    box = layout.held(robot, operation.index, operation.label)
    return max(0.0, grip[1] - path.frame(box)[0])
