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

WAY = "way"
"""The axis that moves all joints of a chain along a curve in joint space."""


@dataclass(frozen=True, slots=True)
class JointMotion:
    """How a joint moves a robot and what it carries.

    Attributes:
        word: `along` a guidepath or a curve, `up`, or `turn` about the vertical.
        body: the body with the joint, in the MJCF of a robot type.
        direction: the axis of the joint there (3,); nothing for a curve of several joints.
        drive: name of the actuator.
        rotary: whether the coordinate is an angle [rad]; else it is a length [m].
        hangs: whether the drive bears the weight of what moves; else a guide or a bearing does.
        rolls: whether the weight of a load adds to the friction.
        lever: distance that the robot goes for a unit of the coordinate [m].
        lowers: whether the robot lowers by it what it delivers.
    """

    word: str
    body: str
    direction: tuple[float, ...]
    drive: str
    rotary: bool = False
    hangs: bool = False
    rolls: bool = False
    lever: float = 1.0
    lowers: bool = False


MOTIONS = {
    SLIDE: JointMotion("along", "carriage", (-1.0, 0.0, 0.0), "drive", rolls=True),
    LIFT_JOINT: JointMotion("up", "head", (0.0, 0.0, 1.0), "hoist", hangs=True, lowers=True),
    TURN_JOINT: JointMotion("turn", "tool", (0.0, 0.0, 1.0), "drive", rotary=True, lever=0.1),
    WAY: JointMotion("along", "tool", (), "drive", lowers=True),
}
"""How a robot moves by each joint, from the carriage up. At the end of an arm of 0.1 m, what turns
is as fast as other robots are."""


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
        moves: the joints of the MJCF that it moves together, each with its actuator; nothing where
            it is one joint.
    """

    joint: str
    mass: float
    armature: float = 0.0
    friction: float = 0.0
    kp: float | None = None
    kv: float | None = None
    force: float = inf
    position: Position | None = field(default=None, compare=False, repr=False)
    moves: tuple[tuple[str, str], ...] = ()

    @property
    def motion(self) -> JointMotion:
        """How it moves."""
        return MOTIONS[self.joint]

    @property
    def usual(self) -> bool:
        """Whether its drive is sized for its payload, against no more friction than usual."""
        return self.kp is None and self.friction <= FRICTION


@dataclass(frozen=True, slots=True)
class Jaw:
    """A finger of a gripper: an axis that grips move, not modes. It closes on what is taken, and
    opens where that has changed hands.

    Attributes:
        name: of its body, joint, geom and actuator.
        side: +1 for one on the left of the robot's heading, which closes to the right; else -1.
        low, high: corners of its box from the nest, open (3,) [m].
        stroke: how far it closes at the most [m].
        mass: of it [kg].
        armature: inertia of its motor [kg].
        friction: dry friction [N].
        force: what it presses with [N].
        grip: coefficient of friction of its face.
    """

    name: str
    side: int
    low: tuple[float, float, float]
    high: tuple[float, float, float]
    stroke: float
    mass: float
    armature: float
    friction: float
    force: float
    grip: float

    @property
    def opening(self) -> float:
        """Distance of its face from the nest, open [m]."""
        return self.low[1] if self.side > 0 else -self.high[1]

    @property
    def back(self) -> float:
        """Distance of its back from the nest, open [m]."""
        return self.high[1] if self.side > 0 else -self.low[1]


@dataclass(frozen=True, slots=True)
class RobotBody:
    """A robot without its hand.

    Attributes:
        carriage: width W of the square about its mast that all of it below the arms is in [m].
        mass: of all of it [kg].
        axes: its joints, from the carriage up.
        jaws: the fingers of its gripper, one on each side; nothing where it holds by pads.
    """

    carriage: float
    mass: float
    axes: tuple[RobotAxis, ...]
    jaws: tuple[Jaw, ...] = ()

    def axis(self, joint: str) -> RobotAxis:
        """The axis of a joint that it has."""
        return next(axis for axis in self.axes if axis.joint == joint)

    @property
    def first(self) -> RobotAxis:
        """The axis along its guidepath; of a robot that stands, the one that turns."""
        return self.axes[0] if self.travels else self.axes[-1]

    @property
    def travels(self) -> bool:
        """Whether it goes along a guidepath or a curve; else it stands where it works."""
        return self.axes[0].motion.word == "along"

    @property
    def lifts(self) -> bool:
        """Whether it has a lift."""
        return any(axis.joint == LIFT_JOINT for axis in self.axes)

    @property
    def motions(self) -> tuple[str, ...]:
        """What its axes do: go `along` a guidepath, `up`, or `turn` about the vertical."""
        return tuple(axis.motion.word for axis in self.axes)
