"""Straight ends of ways: lines of the tool from where it takes or places something."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import ceil, pi

import numpy as np

from factory.apps.arms.holds import UP
from factory.support.arrays import Array

CURVE = 0.06
"""Length of the most of a straight end that may be rounded, beyond what stays straight [m]."""

BEND = 0.02
"""Radius with which an end that comes from a side bends up [m]."""

FEWEST, SPACING = 25, 0.005
"""Least number of places on an end, and the greatest distance between two where it bends [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Rise:
    """A straight end of a way, above the visit; or beside it first, and up from there.

    Attributes:
        straight: how far it stays as it is; what is beyond may be rounded [m].
        length: of it all [m].
        aside: how far it would go to the side, were it not for its bend; 0 for nothing [m].
        along: the direction to the side, a unit vector (3,).
    """

    straight: float
    length: float
    aside: float = 0.0
    along: Array = field(default_factory=UP.copy)

    @classmethod
    def of(cls, straight: float) -> Rise:
        """One that stays straight so far [m]."""
        return cls(straight, straight + min(straight, CURVE))

    @classmethod
    def beside(cls, along: Array, aside: float, up: float) -> Rise:
        """One that goes to a side, and up from there, so far [m]."""
        aside, up = aside + BEND, max(up, BEND)
        straight = aside + up - (2 - pi / 2) * BEND
        return cls(straight, straight + min(up, CURVE), aside, along)

    @property
    def up(self) -> float:
        """How much higher it ends than it begins [m]."""
        return float(self.places[-1, 2])

    @property
    def places(self) -> Array:
        """Where the tool is, from the visit, at equal distances (k, 3) [m]."""
        if not self.aside:
            return np.asarray(np.linspace(0.0, self.length, FEWEST)[:, None] * UP)
        gone = np.linspace(0.0, self.length, max(FEWEST, ceil(self.length / SPACING) + 1))
        before = self.aside - BEND
        bent = np.clip((gone - before) / BEND, 0.0, pi / 2)
        aside = np.minimum(gone, before) + BEND * np.sin(bent)
        up = BEND * (1 - np.cos(bent)) + np.maximum(gone - before - BEND * pi / 2, 0.0)
        return np.asarray(aside[:, None] * self.along + up[:, None] * UP)


@dataclass(frozen=True, slots=True, eq=False)
class StraightEnd:
    """A straight end of a way.

    Attributes:
        rows: configurations along it, from the visit (k, n) [rad, m].
        share: of it that is not rounded, from the visit.
    """

    rows: Array
    share: float
