"""A clamp: jaws that close on both sides of what a hand holds, over its pad or, of a hand above,
under it.

Jaws move across the heading. Closed, each is AIR off the widest place of the payload that its face
is beside: as with pads, a weld stands for the pressure.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from factory.floor.layout.dimensions import BEAM, FINGER_LOW, FINGER_TOP
from factory.floor.layout.hands.tips import BESIDE, TERMS, TILTED, TURN, TWIST
from factory.support.arrays import Array
from factory.theory.problem.robot_bodies import Jaw

Box = tuple[tuple[float, ...], tuple[float, ...]]

PALM = "palm"
"""What the name of the limb begins with on which jaws slide, made as fingers or beams are."""


INSIDE = 5e-4
"""How far a palm is inside the faces of the beam that it crosses [m]."""


@dataclass(frozen=True, slots=True)
class Clamp:
    """The jaws of a hand, and how far they close.

    Attributes:
        jaws: both jaws.
        closed: for each tour how far each jaw closes on its payload [m].
        up: 1 where jaws reach up from the pad, -1 where they hang.
    """

    jaws: tuple[Jaw, ...]
    closed: tuple[tuple[float, ...], ...]
    up: int = 1

    @property
    def half(self) -> float:
        """Distance of the backs of open jaws from the pad [m]."""
        return max(jaw.back for jaw in self.jaws)

    @property
    def length(self) -> float:
        """How far the jaws reach along the heading from the pad [m]."""
        return max(max(-jaw.low[0], jaw.high[0]) for jaw in self.jaws)

    @property
    def words(self) -> str:
        """The jaws, in words."""
        return f"two jaws, {min(jaw.force for jaw in self.jaws):g} N each"

    def boxes(
        self, at: tuple[float, float, float], beam: float, open_: bool = False
    ) -> Iterator[tuple[str, Box]]:
        """The boxes of the palm and of the jaws, each jaw `open_` or with all its way from open to
        closed, by their names. All in the frame of the robot [m].

        Args:
            at: where the pad touches.
            beam: height of the lower edge of the beam, of a hand above.
            open_: whether jaws are open.
        """
        x, y, z = at
        begin, end = min(j.low[0] for j in self.jaws), max(j.high[0] for j in self.jaws)
        low, high = FINGER_LOW, FINGER_TOP
        if self.up < 0:
            low, high = beam + INSIDE, beam + BEAM - INSIDE
        name = f"{PALM}/{'finger' if self.up > 0 else 'beam'}"
        yield name, ((x + begin, y - self.half, low), (x + end, y + self.half, high))
        for number, jaw in enumerate(self.jaws):
            farthest = max(closed[number] for closed in self.closed)
            face = jaw.opening - farthest * (not open_)
            near, far = sorted((y + jaw.side * face, y + jaw.side * jaw.back))
            tip = z + self.up * jaw.high[2]
            foot, top = (FINGER_TOP, tip) if self.up > 0 else (tip, beam)
            yield jaw.name, ((x + jaw.low[0], near, foot), (x + jaw.high[0], far, top))

    def gauge(self, heading: tuple[float, float], tour: int = 0) -> Array:
        """What a load uses of the strength of the jaws on a tour, as `Tip.gauge` (11, 6): from a
        force [N] and a moment [Nm] about the pad.

        Each face bears by friction, of what it presses with: weight and acceleration along the
        faces, what twists about the line between the jaws, and as a couple what tilts them about
        any other. What pulls across is borne by the drives. The pad bears nothing.
        """
        faces = [j.opening - c for j, c in zip(self.jaws, self.closed[tour], strict=True)]
        left = sum(jaw.side * face for jaw, face in zip(self.jaws, faces, strict=True)) / 2
        (u, v), first = heading, self.jaws[0]
        across, along = np.array([-v, u, 0.0]), np.array([[u, v, 0.0], [0.0, 0.0, 1.0]])
        high = min(jaw.high[2] for jaw in self.jaws)
        ahead = (first.low[0] + first.high[0]) / 2
        middle = np.array([ahead, self.up * high / 2]) @ along + left * across
        about = np.hstack([-np.cross(middle, np.eye(3)).T, np.eye(3)])
        press = min(jaw.force for jaw in self.jaws)
        bears = 2 * press * min(jaw.grip for jaw in self.jaws)
        radius = min(high, *(jaw.high[0] - jaw.low[0] for jaw in self.jaws)) / 2
        terms = np.zeros((TERMS, 6))
        terms[BESIDE, :3][:2] = along / bears
        terms[TURN] = across @ about * TWIST / radius / bears
        terms[TILTED][0, :3] = across / (2 * press)
        terms[TILTED][1:] = along @ about / (sum(faces) * bears / 2)
        return terms
