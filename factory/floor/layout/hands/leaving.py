"""Robots on their way home: where robots go by themselves whose hands must be there before the next
part, and what is clear of a hand that has released its payload."""

from __future__ import annotations

from factory.floor.layout.feeding import passing
from factory.floor.layout.layout import Layout
from factory.support.decimals import up
from factory.theory.nets.coordinated import Past
from factory.theory.problem.ids import end_of

SPARE = 0.001
"""A hand is clear that is so far from all that it has delivered to [m]."""

NEAR = 0.001
"""A robot that has to be clear goes on by so much at the least [m]."""

ON = 0.009
"""A robot whose hand has to be clear goes on by so much: it does not slow down before [m]."""


def homes(layout: Layout) -> dict[int, float]:
    """The robots (index) whose hands must be in place before what they take, and the arc length of
    that place [m]; without robots whose tall hands could meet others there."""
    operations, ways = layout.factory.operations, dict[int, float]()
    for robot in layout.factory.robots:
        hand = layout.hand(robot.index)
        if hand is None or not hand.first:
            continue
        if not (operations[robot.operations[0]].inputs and hand.kind.tall):
            ways[robot.index] = layout.guidepaths[robot.index].length
    return ways


def gone_by(layout: Layout, robot: int, least: float) -> float:
    """Goal of a robot that is to pass a point: a little beyond it, if possible [m]."""
    return min(least + ON, max(least + NEAR, before_next(layout, robot)))


def before_next(layout: Layout, robot: int) -> float:
    """Greatest arc length of a robot while its next part comes down [m]: its B end, or less if its
    hand is above what it takes."""
    length, hand = layout.guidepaths[robot].length, layout.hand(robot)
    tours = layout.factory.tours[robot] if hand is not None and hand.kind.hangs else ()
    firsts = (layout.factory.operations[tour[0]] for tour in tours)
    ways = (passing(layout, leaf) for leaf in firsts if not leaf.inputs)
    return length - max(ways, default=0.0)


def raised(layout: Layout, robot: int, after: int) -> Past:
    """When a robot's lift is up for its next tour after an operation (index)."""
    axis, factory = layout.factory.up(robot), layout.factory
    assert axis is not None, "its hand is above what it releases"
    return Past(end_of(after), axis, layout.visits[factory.after(robot, after), robot].up - SPARE)


def farther(layout: Layout, robot: int, by: float) -> float:
    """Travel of a robot that has to go further by a distance [m]."""
    return up(layout.guidepaths[robot].travel + by)
