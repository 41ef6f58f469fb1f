"""What a robot type is made of: its axes, with what they move and what drives them."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf

from factory.support.errors import Position

CARRIAGE = 0.06
"""Least width and length W that a carriage has to itself [m]."""

CARRIAGE_TOP = 0.05
"""Height of the layer of carriages [m]."""

MAST = 0.02
"""Width that a mast has to itself [m]."""

ARM_WIDTH = 0.016
"""Width that an arm has to itself [m]."""

ARM_LOW, ARM_TOP = 0.066, 0.084
"""From where to where up arms reach [m]; masts end there too."""

FRICTION = 0.2
"""Dry friction of the axes of the shipped robots without a load [N]."""

SLIDE, LIFT_JOINT, TURN_JOINT = "slide", "lift", "turn"
"""The joints of robots: along a guidepath, up, and about the vertical."""

MOVES = {SLIDE: "along", LIFT_JOINT: "up", TURN_JOINT: "turn"}
"""How a robot moves by each joint."""


@dataclass(frozen=True, slots=True)
class RobotAxis:
    """A joint of a robot with its drive.

    Attributes:
        joint: its name.
        mass: what it moves without payload [kg].
        armature: inertia of its motor [kg]; of a hinge [kg m²].
        friction: dry friction without payload [N]; of a hinge [N m].
        kp, kv: gains of its drive [N/m, N s/m], None where they are sized for the payload.
        force: the most that its motor gives [N]; of a hinge [N m].
        position: where its drive is written.
    """

    joint: str
    mass: float
    armature: float = 0.0
    friction: float = 0.0
    kp: float | None = None
    kv: float | None = None
    force: float = inf
    position: Position | None = field(default=None, compare=False, repr=False)

    @property
    def usual(self) -> bool:
        """Whether its drive is sized for its payload, against no more friction than usual."""
        return self.kp is None and self.friction <= FRICTION


@dataclass(frozen=True, slots=True)
class RobotBody:
    """A robot without its hand.

    Attributes:
        carriage: width W of the square about its mast that all of it below the arms is in [m].
        mass: of all of it [kg].
        axes: its joints, from the carriage up.
    """

    carriage: float
    mass: float
    axes: tuple[RobotAxis, ...]

    def axis(self, joint: str) -> RobotAxis:
        """The axis of a joint that it has."""
        return next(axis for axis in self.axes if axis.joint == joint)

    @property
    def first(self) -> RobotAxis:
        """The axis along its guidepath; of a robot that stands, the one that turns."""
        return self.axes[-1] if self.axes[0].joint != SLIDE else self.axes[0]

    @property
    def moves(self) -> tuple[str, ...]:
        """What its axes do: go `along` a guidepath, `up`, or `turn` about the vertical."""
        return tuple(MOVES[axis.joint] for axis in self.axes)
