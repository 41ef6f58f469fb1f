"""A robot of a factory."""

from __future__ import annotations

from dataclasses import dataclass, field

from factory.support.errors import Position
from factory.theory.problem.ids import OperationId, RobotId
from factory.theory.problem.robot_bodies import RobotBody
from factory.theory.problem.robot_types import RobotType


@dataclass(frozen=True, slots=True)
class Robot:
    """A robot of a factory.

    Attributes:
        index: its number in `Factory.robots`.
        name: r1, r2 and so on.
        kind: its robot type.
        operations: its operations (index), in the order of its gear.
        position: the operation that made it necessary: the user's line; not compared.
    """

    index: RobotId
    name: str
    kind: RobotType = field(repr=False)
    operations: tuple[OperationId, ...]
    position: Position | None = field(default=None, compare=False)

    @property
    def type(self) -> str:
        """The name of its type."""
        return self.kind.name

    @property
    def body(self) -> RobotBody:
        """What it is made of, without its hand."""
        return self.kind.body

    @property
    def travels(self) -> bool:
        """Whether it goes along a guidepath; else it stands at the station of the robot that it
        delivers to, and its first axis turns what it holds about the vertical."""
        return self.kind.travels
