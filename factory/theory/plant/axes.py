"""The axes of a factory: the joints that its modes move, each with a scalar coordinate."""

from __future__ import annotations

from dataclasses import dataclass

from factory.theory.plant.robot import Robot
from factory.theory.problem.ids import AxisId
from factory.theory.problem.robot_bodies import JointMotion, RobotAxis


@dataclass(frozen=True, slots=True)
class Axis:
    """A joint of a robot that modes move.

    Attributes:
        index: its number in `Factory.axes`.
        robot: the robot.
        joint: what the robot's type says of it: mass, friction, drive.
    """

    index: AxisId
    robot: Robot
    joint: RobotAxis

    @property
    def motion(self) -> JointMotion:
        """How it moves."""
        return self.joint.motion

    @property
    def name(self) -> str:
        """Its name for users: that of the robot for a first axis, `r3 lift` for others."""
        first = self.joint == self.robot.body.first
        return self.robot.name if first else f"{self.robot.name} {self.joint.joint}"
