"""Where robots are in a marking, and what they hold there."""

from __future__ import annotations

from factory.nets.petri import Marking
from factory.plant.factory import Factory


def step_of(factory: Factory, robot: int, marking: Marking) -> int:
    """The step of its gear that a robot (index) is at: twice that of its program, and one more
    where the operation is under way."""
    places = factory.net.gears[robot].places
    return next(step for step, place in enumerate(places) if place in marking)


def held(factory: Factory, marking: Marking) -> list[str]:
    """The label that each robot holds in a marking, NOPART for nothing."""
    found = []
    for robot in factory.robots:
        number = robot.operations[step_of(factory, robot.index, marking) // 2]
        operation = factory.operations[number]
        found.append(operation.before[operation.robots.index(robot.index)])
    return found


def marking_of(marked: bytearray) -> Marking:
    """The places that are marked."""
    return frozenset(place for place, is_so in enumerate(marked) if is_so)
