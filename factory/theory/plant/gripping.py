"""Grips that take time: jaws close on what a robot takes while it dwells at its goal.

Closed jaws bear what the robot carries, so they are closed when the operation ends; they open where
it has delivered, and are open when it comes for the next.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from math import ceil

from factory.theory.plant.operation import Operation
from factory.theory.plant.robot import Robot
from factory.theory.problem.pag import NOPART
from factory.theory.problem.robot_bodies import RobotBody

JAW_SPEED, JAW_ACCELERATION = 0.1, 1.0
"""Of jaws [m/s; m/s²]."""

MARGIN = 0.03
"""How much longer a robot dwells than its jaws take [s]."""


def jaw_time(stroke: float) -> float:
    """How long a jaw takes from rest to rest over a stroke [m; s]."""
    from factory.theory.control.profile import SpeedProfile

    return SpeedProfile(JAW_SPEED, JAW_ACCELERATION).rest(stroke)


def closing_time(body: RobotBody) -> float:
    """How long a robot dwells where it takes something [s]: until its jaws are closed, 0 without
    jaws."""
    longest = max((jaw_time(jaw.stroke) for jaw in body.jaws), default=0.0)
    return ceil(longest * 100 - 1e-6) / 100 + MARGIN * bool(body.jaws)


def takes(operation: Operation, robot: int) -> bool:
    """Whether a robot (index) comes to an operation with empty hands and leaves with something."""
    slot = operation.robots.index(robot)
    return operation.before[slot] == NOPART != operation.after[slot]


def with_closing(operations: Iterable[Operation], robots: Sequence[Robot]) -> tuple[Operation, ...]:
    """The operations, with a dwell where jaws close."""
    if not any(robot.body.jaws for robot in robots):
        return tuple(operations)

    def dwell(o: Operation) -> float:
        times = (closing_time(robots[robot].body) for robot in o.robots if takes(o, robot))
        return max([o.dwell, *times])

    return tuple(replace(o, dwell=dwell(o)) for o in operations)
