"""What is asked of an allocation: so many robots, or a cycle time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from factory.support.settings import LEAST

STEP = 1.15
"""The bounds on estimated cycles that are tried: each is the one before divided by this."""

SECONDS = 60.0
"""How long is looked for few robots, where nothing else is said [s]."""


@dataclass(frozen=True, slots=True)
class Aim:
    """How many `robots` there are, LEAST for as few as found, None for as many as it takes; the
    `cycle` time to be reached [s], None for the shortest; how many `seconds` may be spent on the
    choice."""

    robots: int | Literal["least"] | None = None
    cycle: float | None = None
    seconds: float = SECONDS

    @property
    def asks(self) -> bool:
        """Whether it asks for anything."""
        return self.robots is not None or self.cycle is not None

    def rank(self, robots: int, seconds: float, troubles: int = 0) -> tuple[float, ...]:
        """What a factory is judged by, the less the better: how many of its operations are worse
        than as they are written, its robots, its cycle time [s]."""
        seconds = round(seconds, 3)
        if self.robots == LEAST:
            return troubles, robots, seconds
        more = max(0, robots - self.robots) if self.robots else 0
        if self.cycle is None:
            return troubles, more, seconds, robots
        return troubles, more, max(0.0, seconds - self.cycle), robots, seconds

    def wants(self, robots: int, seconds: float) -> bool:
        """Whether estimates may be those of what is wanted."""
        if isinstance(self.robots, int) and robots > self.robots:
            return False
        return self.cycle is None or seconds < self.cycle * STEP
