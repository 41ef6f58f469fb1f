"""The hands of a layout's robots: their limbs, and the room that these take."""

from __future__ import annotations

from factory.floor.layout.dimensions import FINGER
from factory.floor.layout.hands.mounted import Limb, limbs_of
from factory.floor.layout.layout import Layout


def limbs(layout: Layout, robot: int) -> tuple[Limb, ...]:
    """The limbs of a robot's hand; none for a tool, or where nothing can hold."""
    hand = layout.hand(robot)
    return limbs_of(hand, layout.mount(robot)) if hand is not None else ()


def rises_first(layout: Layout, robot: int) -> bool:
    """Whether a robot's lift has to be up before it goes home: its hand is above what it
    released."""
    hand = layout.hand(robot)
    return hand is not None and hand.kind.hangs and layout.factory.lowers(robot)


def cross_of(layout: Layout, robot: int) -> tuple[float, float]:
    """The interval across which the arm of a robot in a lane reaches to the line of its finger, to
    the left of its carriage's line [m]; (0, 0) without a lane."""
    hand = layout.hand(robot)
    if hand is None or not hand.kind.rises:
        return 0.0, 0.0
    aside, half = layout.mount(robot).reached(hand)[0][1], hand.width / 2
    return (min(0.0, aside - half), max(0.0, aside + half)) if abs(aside) > FINGER / 2 else (0, 0)


__all__ = ["Limb", "cross_of", "limbs", "rises_first"]
