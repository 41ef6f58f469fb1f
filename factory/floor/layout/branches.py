"""The branches of a factory: which robot brings what it has to which other."""

from __future__ import annotations

from collections.abc import Sequence

from factory.theory.plant.factory import Factory
from factory.theory.plant.operation import Operation


def carriers(factory: Factory) -> list[int]:
    """For each robot the carrier on whose guidepath its own ends: the one it delivers to, or that
    of a fixed robot which takes what it brings; -1 for the output robot.

    Args:
        factory: the factory.
    """
    ends = (delivery(factory, robot.index) for robot in factory.robots)
    return [-1 if factory.drops(o.index) else o.carrier for o in ends]


def branch_of(on: Sequence[int], robot: int) -> list[int]:
    """A robot (index) and all robots that bring it something, carriers first; `on`: the
    `carriers`."""
    branch = [robot]
    for other, carrier in enumerate(on):  # carriers come first
        if carrier in branch:
            branch.append(other)
    return branch


def delivery(factory: Factory, robot: int) -> Operation:
    """The operation at whose station the guidepath of a robot (index) ends: its last, or that of a
    fixed robot which takes what it brings."""
    while True:
        last = factory.last(robot)
        if last.carrier == robot or factory.robots[last.carrier].travels:
            return last
        robot = last.carrier
