"""The aim of an allocation: a number of robots, or a cycle time."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import Literal

from factory.compiler.parallel import Branches
from factory.support.bounds import check_values
from factory.support.settings import LEAST

STEP = 1.15
"""Ratio of successive bounds on estimated cycles."""

LABELS, EFFORTS = 3000, (8, 100)
"""Number of labels that a search lays out, over all its factories; least and greatest number of
these: the layout of a large product takes as long as many of a small one."""


def usual_effort(labels: int) -> int:
    """Default of the greatest number of factories that a search lays out, for a product with so
    many labels."""
    return min(max(LABELS // labels, EFFORTS[0]), EFFORTS[1])


@dataclass(frozen=True, slots=True)
class Aim:
    """Number of `robots`, LEAST for as few as found, None for any number; the `cycle` time to be
    reached [s], None for the shortest. `effort`: greatest number of factories that are laid out,
    None for the default; none is begun after `seconds`. `branches`: labels, with the number of
    copies of the branch that brings each. Raises InputError (Usage) for a wrong value."""

    robots: int | Literal["least"] | None = None
    cycle: float | None = None
    effort: int | None = None
    seconds: float = inf
    branches: Branches = ()

    def __post_init__(self) -> None:
        robots = None if self.robots == LEAST else self.robots
        seconds = None if self.seconds == inf else self.seconds
        check_values(
            {"robots": robots, "cycle": self.cycle, "effort": self.effort, "seconds": seconds}
        )

    @property
    def asks(self) -> bool:
        """Whether it limits the robots or the cycle time."""
        return self.robots is not None or self.cycle is not None

    def rank(self, robots: int, seconds: float, bare: int = 0) -> tuple[float, ...]:
        """Rank of a factory, the less the better: its robots beyond those allowed, the labels
        without a hand beyond those of the product as written (`bare`), its cycle time [s]; with
        LEAST, the number of robots before the cycle time."""
        seconds = round(seconds, 3)
        if self.robots == LEAST:
            return bare, robots, seconds
        more = max(0, robots - self.robots) if self.robots else 0
        if self.cycle is None:
            return more, bare, seconds, robots
        return more, bare, max(0.0, seconds - self.cycle), robots, seconds

    def wants(self, robots: int, seconds: float) -> bool:
        """Whether a factory with these estimates may reach the aim."""
        if isinstance(self.robots, int) and robots > self.robots:
            return False
        return self.cycle is None or seconds < self.cycle * STEP
