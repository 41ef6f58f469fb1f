"""The sizes of robots and the heights of the two layers of a factory [m]; see docs/design.md.

Robots live below the plane z0 = PAYLOAD, payloads above it, so a robot passes under any payload.
From the floor up: carriages; arms, above any carriage, met by masts only; fingers, above any mast;
payloads.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from factory.support.decimals import up
from factory.theory.problem.robot_bodies import ARM_WIDTH, CARRIAGE, MAST

CARRIAGES, ARMS, PAYLOADS = LAYERS = range(3)
"""The layers in which things can meet, from the floor up. What stands on the floor is in all of
them."""

FINGER_LOW, FINGER_TOP = 0.09, 0.096
PAYLOAD = 0.1
"""z0: the lowest point of a product is carried at this height."""

FINGER = 0.01
"""Width of a finger, and of the bars and beams of tall hands."""

BEAM = 0.012
"""How high a beam is."""

STUB = 0.03
"""The shortest arm, from the middle of the mast."""

POST = 0.03
"""Width of a feeder's post."""

BOOM = 0.016
"""Width of the boom that carries a feeder's housing; `BOOM_HEIGHT` its height."""

BOOM_HEIGHT = 0.014

PLAY = 0.001
"""Between a housing's walls, or a shed's, and what is inside."""

WALL = 0.001
"""Thickness of the walls of a housing and of the shed, of their lids, and of its shutter."""

SIDE = PLAY + WALL
"""How much wider on each side a housing is than its part, and the shed than a product."""

PAD = 0.004
"""Height of the suction pad from which a part hangs."""

RISE = 1 / 3
"""No line of sight that rises by less than this share of its way in plan gets to a part in its
housing, which is above the housing's lower edge by so much of the housing's diagonal."""

APART = 0.02
"""Robots keep so far from what lies about [m]."""

BEHIND = 0.015
"""How far behind the shed's shutter a product ends."""

TOOL_TRAVEL = 0.12
"""How far a tool comes from its home to its station."""

TRAY = 0.0025
"""Thickness of the tray on which a product leaves."""

SLOT = 0.001
"""How far the slot in tray and belt is from the hand that comes through it [m]."""

BELT_GAP = 3e-4
"""The outfeed lies this much below z0, so that the output robot brings its product without
touching."""


class Dimensions:
    """The sizes and heights that the machines of all layouts share [m].

    Attributes:
        PAYLOAD: height of the lowest point of a product that is carried.
        MAST: width that a mast has to itself.
        ARM_WIDTH: width that an arm has to itself.
        FINGER: width of a finger.
        PAD: height of the suction pad from which a part hangs.
        PLAY: between the walls of a housing and what is inside.
        WALL: thickness of these walls.
        RISE: least share of its way in plan by which a line of sight rises to a part in its
            housing.
        APART: distance that robots keep from what lies about.
    """

    PAYLOAD: ClassVar[float] = PAYLOAD
    MAST: ClassVar[float] = MAST
    ARM_WIDTH: ClassVar[float] = ARM_WIDTH
    FINGER: ClassVar[float] = FINGER
    PAD: ClassVar[float] = PAD
    PLAY: ClassVar[float] = PLAY
    WALL: ClassVar[float] = WALL
    RISE: ClassVar[float] = RISE
    APART: ClassVar[float] = APART


@dataclass(frozen=True, slots=True)
class Clearance:
    """The distances that a layout keeps.

    Attributes:
        c: least distance between things that are not meant to touch [m].
        carriage: W, width and length of the largest carriage [m].
    """

    c: float = 0.02
    carriage: float = CARRIAGE

    @property
    def rim(self) -> float:
        """Distance of an arm's end from the line of another robot's mast, and of a post."""
        return max(MAST, POST) / 2 + self.c

    @property
    def stop(self) -> float:
        """Distance of end stops beyond the ends of a guidepath: two robots pressed against stops
        that face each other keep a tenth of the clearance."""
        return 0.45 * self.c

    @property
    def play(self) -> float:
        """Distance of buffers beyond the ends of a guidepath: a robot reaches them only if it is
        pushed."""
        return self.c / 20

    @property
    def spread(self) -> float:
        """Distance of the lanes of relaying robots, to either side, from the line of a single
        robot."""
        return up((self.carriage + self.c) / 2)

    def reach(self, arm: float, lane: float = 0.0) -> float:
        """Distance that a carriage stays behind the arm's end, and behind the other robot's
        carriage, whose line is `lane` nearer to the product's middle."""
        return max(arm + STUB, self.carriage + self.c + lane)

    @property
    def room(self) -> float:
        """Height between a presented part and the lower edge of its housing."""
        return self.c

    def post(self, reach: float, rear: float) -> float:
        """Distance of a feeder's post, behind the product's middle: behind the carriage's rear
        stop, and behind the part and the hand that holds it, whose rear end is at `rear`."""
        return max(reach + self.carriage / 2, -rear) + self.c + POST / 2
