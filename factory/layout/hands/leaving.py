"""Hands that have to be gone before what they have delivered goes on.

Most hands let go of a payload that can then leave at once. Where something of it would meet the
hand on its way, its carrier waits for the hand to be clear. The hand's robot goes home, or raises
its lift, as soon as it has let go, whatever comes next, so the wait ends.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from factory.layout.hands.limbs import grip_box
from factory.layout.layout import Layout
from factory.problem.pag import NOPART

SPARE = 0.005
"""A hand is clear that is so far from all that it has delivered to [m]."""


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
        first = found.setdefault(robot.operations[0], [])
        if rises_first(layout, robot.index):
            first.append(_gone(layout, robot.index, ""))
        hand = layout.hand(robot.index)
        if hand is not None and hand.tall:
            first += [
                _gone(layout, guest, label, lifts=False)
                for guest, label, _ in _delivering(layout, robot.index)
            ]
    return {number: tuple(dict.fromkeys(leaving)) for number, leaving in found.items() if leaving}


def going_on(layout: Layout, carrier: int) -> dict[int, tuple[Leaving, ...]]:
    """For each operation (index) of a carrier the hands that have delivered to it in the one before
    and must be clear of that."""
    found: dict[int, list[Leaving]] = {}
    for guest, label, onward in _delivering(layout, carrier):
        hand = layout.hand(guest)
        if hand is not None and hand.waits:
            found.setdefault(onward, []).append(_gone(layout, guest, label))
    return {number: tuple(leaving) for number, leaving in found.items()}


def _delivering(layout: Layout, carrier: int) -> Iterator[tuple[int, str, int]]:
    """The robots with hands that deliver to a carrier, each with the label that this makes, and the
    carrier's next operation (index)."""
    gear = layout.factory.robots[carrier].operations
    for step, number in enumerate(gear):
        operation = layout.factory.operations[number]
        if operation.carrier != carrier:
            continue
        for guest, label in zip(operation.robots, operation.before, strict=True):
            hand = layout.hand(guest)
            if guest != carrier and label != NOPART and hand is not None and hand.kind != "none":
                yield guest, operation.label, gear[(step + 1) % len(gear)]


def awaited_positions(layout: Layout) -> dict[int, float]:
    """Where robots go as soon as they have let go, since what they have delivered waits for that:
    clear of it; and home those whose hands have to be there before what they take, unless others
    could be where a tall hand comes to."""
    found: dict[int, float] = {}
    factory = layout.factory
    for robot, hand in enumerate(layout.hands):
        if hand is None or hand.kind == "none":
            continue
        first, last = (factory.operations[factory.robots[robot].operations[n]] for n in (0, -1))
        if hand.first and not (first.inputs and hand.tall):
            found[robot] = layout.guidepaths[robot].length
        elif hand.waits and not rises_first(layout, robot):
            clear = _gone(layout, robot, last.label).least + 2 * SPARE
            found[robot] = min(clear, layout.guidepaths[robot].length)
    return found


def goes_early(layout: Layout) -> list[tuple[int, int]]:
    """The operations (index) ahead of which robots go where they are awaited, whatever else."""
    robots, count = layout.factory.robots, len(layout.factory.robots)
    return [(robots[r].operations[0], r) for r in awaited_positions(layout) if r < count]


def rises_first(layout: Layout, robot: int) -> bool:
    """Whether a robot's lift has to be up before it goes home: its hand is above what it has let
    go."""
    hand = layout.hand(robot)
    return hand is not None and hand.kind == "above" and robot in layout.factory.strokes


def _gone(layout: Layout, robot: int, label: str, lifts: bool = True) -> Leaving:
    """When a robot's hand is clear of a sub-assembly: its lift is up, or it has gone back behind
    it."""
    if lifts and rises_first(layout, robot):
        axis = len(layout.factory.robots) + list(layout.lifts).index(robot)
        return Leaving(axis, layout.factory.strokes[robot] - SPARE)
    path, hand = layout.guidepaths[robot], layout.hand(robot)
    assert hand is not None
    back = hand.waits
    if not lifts:
        grip = grip_box(layout, robot)
        assert grip is not None
        back = max(0.0, grip[1] - path.frame(layout.payloads[label])[0])
    back += SPARE
    return Leaving(robot, min(path.reach + back, path.length - SPARE))
