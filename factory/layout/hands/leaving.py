"""Robots on their way home: where those go by themselves whose hands have to be there first, and
what is clear of a hand that has let go."""

from __future__ import annotations

from factory.layout.dimensions import up
from factory.layout.feeding import passing
from factory.layout.layout import Layout
from factory.nets.coordinated import Past

SPARE = 0.001
"""A hand is clear that is so far from all that it has delivered to [m]."""

NEAR = 0.001
"""A robot that has to be clear goes on by so much at the least [m]."""

ON = 0.009
"""A robot whose hand has to be clear goes on by so much: it does not slow down before [m]."""


def homes(layout: Layout) -> dict[int, float]:
    """The robots (index) whose hands have to be there before what they take, and where that is, an
    arc length [m]; unless others could be where a tall hand comes to."""
    operations, ways = layout.factory.operations, dict[int, float]()
    for robot in layout.factory.robots:
        hand = layout.hand(robot.index)
        if hand is None or not hand.first or not robot.operations:
            continue
        if not (operations[robot.operations[0]].inputs and hand.tall):
            ways[robot.index] = layout.guidepaths[robot.index].length
    return ways


def gone_by(layout: Layout, robot: int, least: float) -> float:
    """Where a robot goes so that it comes past a point: on a little, if it can [m]."""
    return min(least + ON, max(least + NEAR, before_next(layout, robot)))


def before_next(layout: Layout, robot: int) -> float:
    """How far back a robot may be while its next part comes down, an arc length [m]: not as far as
    that where its hand is above what it takes."""
    length, hand = layout.guidepaths[robot].length, layout.hand(robot)
    tours = layout.factory.tours[robot] if hand is not None and hand.kind == "above" else ()
    firsts = (layout.factory.operations[tour[0]] for tour in tours)
    ways = (passing(layout, leaf) for leaf in firsts if not leaf.inputs)
    return length - max(ways, default=0.0)


def raised(layout: Layout, robot: int, after: int) -> Past:
    """When a robot's lift is up for its next tour after an operation (index)."""
    gear = layout.factory.robots[robot].operations
    up = layout.visits[gear[(gear.index(after) + 1) % len(gear)], robot].up
    return Past(2 * after + 1, layout.factory.lift_axis[robot], up - SPARE)


def farther(layout: Layout, robot: int, by: float) -> float:
    """How far a robot is to go from where it delivers that has to go so much further [m]."""
    return up(layout.guidepaths[robot].travel + by)
