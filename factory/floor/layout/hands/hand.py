"""A hand: where and how a robot holds what it carries.

It touches places of the payload's surface with pads, and reaches there in the way of its kind.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from factory.floor.layout.dimensions import FINGER
from factory.floor.layout.hands.clamp import Clamp
from factory.floor.layout.hands.kinds import ABOVE, BEHIND, BELOW, NONE, HandKind
from factory.floor.layout.hands.reach import SLENDER
from factory.floor.layout.hands.tips import STRONG, Tip, TipName, tip
from factory.support.arrays import Array

Point3 = tuple[float, float, float]

STEM = 0.006
"""Diameter of the thinnest column or stem [m]."""

ROOT = 0.01
"""How far a finger begins before the end of its arm [m]."""

PAD = 0.0015
"""Thickness of a pad [m]."""


@dataclass(frozen=True, slots=True)
class Hand:
    """The gripper of a robot: how it holds its payload. Of the kind `none` if nothing can hold.

    Attributes:
        kind: from where it reaches the payload.
        places: points of the payload's surface at the middles of the tips, in the frame of the
            finished product [m]: one or, from below, two on one line along the heading.
        radius: of a tip [m].
        beam: height of the lower edge of the beam of a gripper above, in that frame [m].
        share: predicted share of the tips' strength that weight and acceleration use.
        tip: kind of tip.
        first: whether it is in place before its payload comes.
        wait: predicted distance that it goes back until its carrier's next operation may start [m].
        covered: share of a tip's face that the surface covers, for each tour, with suction.
        clamp: the jaws that close over its tip; None without.
    """

    BELOW: ClassVar[HandKind] = BELOW
    STRONG: ClassVar[float] = STRONG

    kind: HandKind
    places: tuple[Point3, ...]
    radius: float = 0.003
    beam: float = 0.0
    share: float = 0.0
    tip: TipName = "suction"
    first: bool = False
    wait: float = 0.0
    covered: tuple[float, ...] = (1.0,)
    clamp: Clamp | None = None

    @classmethod
    def nothing(cls, at: Point3, share: float = 0.0) -> Hand:
        """The hand that holds nothing at a place, using at most a share of its strength."""
        return cls(NONE, (at,), share=share)

    @classmethod
    def on_face(cls, normal: Array, at: Point3, radius: float, tip: TipName) -> Hand:
        """A hand with one tip on a face with a normal (3,): from above, or from behind."""
        return cls(ABOVE if normal[2] else BEHIND, (at,), radius, tip=tip)

    @staticmethod
    def tip_of(kind: TipName) -> Tip:
        """How strong a kind of tip is."""
        return tip(kind)

    @property
    def half(self) -> float:
        """How far it reaches to the sides of its places [m]."""
        return max(FINGER / 2, self.radius) if self.clamp is None else self.clamp.half

    @property
    def width(self) -> float:
        """Width of its finger, or of the bar to its stem [m]."""
        return min(max(2 * self.radius, SLENDER), FINGER)

    @property
    def column(self) -> float:
        """Diameter of its column or stem [m]: half the pad's, within STEM and FINGER."""
        return min(2 * self.radius, max(STEM, min(self.radius, FINGER)))
