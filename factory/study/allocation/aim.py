"""What is asked of an allocation: so many robots, or a cycle time."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import Literal

from factory.compiler.parallel import Branches
from factory.support.settings import LEAST

STEP = 1.15
"""The bounds on estimated cycles that are tried: each is the one before divided by this."""

LABELS, EFFORTS = 3000, (8, 100)
"""So many labels are laid out in a search, in so many factories: a large product's layout takes as
long as many of a small one's."""


def usual_effort(labels: int) -> int:
    """How many factories a search lays out at most for a product of so many labels, where nothing
    else is said."""
    return min(max(LABELS // labels, EFFORTS[0]), EFFORTS[1])


@dataclass(frozen=True, slots=True)
class Aim:
    """How many `robots` there are, LEAST for as few as found, None for as many as it takes; the
    `cycle` time to be reached [s], None for the shortest. `effort`: how many factories are laid
    out at most, None for as many as is usual; none is begun after `seconds`. `branches`: labels,
    and how often the branch that brings each is to be there."""

    robots: int | Literal["least"] | None = None
    cycle: float | None = None
    effort: int | None = None
    seconds: float = inf
    branches: Branches = ()

    @property
    def asks(self) -> bool:
        """Whether it asks for anything."""
        return self.robots is not None or self.cycle is not None

    def rank(self, robots: int, seconds: float, bare: int = 0) -> tuple[float, ...]:
        """What a factory is judged by, the less the better: how many more robots it has than are
        asked for, how many more labels are `bare` of hands than as they are written, its cycle
        time [s]; its robots first where as few as found are asked for."""
        seconds = round(seconds, 3)
        if self.robots == LEAST:
            return bare, robots, seconds
        more = max(0, robots - self.robots) if self.robots else 0
        if self.cycle is None:
            return more, bare, seconds, robots
        return more, bare, max(0.0, seconds - self.cycle), robots, seconds

    def wants(self, robots: int, seconds: float) -> bool:
        """Whether estimates may be those of what is wanted."""
        if isinstance(self.robots, int) and robots > self.robots:
            return False
        return self.cycle is None or seconds < self.cycle * STEP
