"""A clamp: jaws that close on both sides of what a hand holds, over its pad.

Jaws move across the heading. Closed, each is AIR off the widest place of the payload that its face
is beside: as with pads, a weld stands for the pressure.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from factory.floor.layout.dimensions import FINGER_LOW, FINGER_TOP
from factory.floor.layout.hands.tips import BESIDE, TERMS, TILTED, TURN, TWIST
from factory.support.arrays import Array
from factory.theory.problem.robot_bodies import Jaw

Box = tuple[tuple[float, ...], tuple[float, ...]]

PALM = "palm/finger"
"""The limb on which jaws slide, made as fingers are."""


@dataclass(frozen=True, slots=True)
class Clamp:
    """The jaws of a hand, and how far they close.

    Attributes:
        jaws: both jaws.
        closed: for each tour how far each jaw closes on its payload [m].
    """

    jaws: tuple[Jaw, ...]
    closed: tuple[tuple[float, ...], ...]

    @property
    def half(self) -> float:
        """Distance of the backs of open jaws from the pad [m]."""
        return max(jaw.back for jaw in self.jaws)

    @property
    def words(self) -> str:
        """The jaws, in words."""
        return f"two jaws, {min(jaw.force for jaw in self.jaws):g} N each"

    def boxes(
        self, at: tuple[float, float, float], open_: bool = False
    ) -> Iterator[tuple[str, Box]]:
        """The boxes of the palm and of the jaws, each jaw `open_` or with all its way from open to
        closed, by their names; `at`: where the pad touches, in the frame of the robot [m]."""
        x, y, z = at
        begin, end = min(j.low[0] for j in self.jaws), max(j.high[0] for j in self.jaws)
        yield PALM, ((x + begin, y - self.half, FINGER_LOW), (x + end, y + self.half, FINGER_TOP))
        for number, jaw in enumerate(self.jaws):
            farthest = max(closed[number] for closed in self.closed)
            face = jaw.opening - farthest * (not open_)
            near, far = sorted((y + jaw.side * face, y + jaw.side * jaw.back))
            low = x + jaw.low[0], near, FINGER_TOP
            yield jaw.name, (low, (x + jaw.high[0], far, z + jaw.high[2]))

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
        middle = np.array([(first.low[0] + first.high[0]) / 2, high / 2]) @ along + left * across
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
