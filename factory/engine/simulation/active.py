"""The active modes, and their clocks."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import ceil

import numpy as np

from factory.support.arrays import Array, Index
from factory.support.settings import MOST
from factory.theory.control.navigation import Bundle

ROUNDED = 1e-6
"""A clock that lacks so much of a tick has run out."""


@dataclass(slots=True)
class Active:
    """The active modes by number: of operations, then stages of waiting robots.

    Attributes:
        operations: modes of operations.
        ahead: stages.
        bundle: of all of them; None where there are none.
        axes: the axis of each of its robots.
        clocks: (modes,) [s]; None where none has begun.
        clocked: modes whose robots rest in their goal balls, so that their clocks run with time.
    """

    operations: tuple[int, ...] = ()
    ahead: tuple[int, ...] = ()
    bundle: Bundle | None = None
    axes: Index = field(default_factory=lambda: np.empty(0, np.intp))
    clocks: Array | None = None
    clocked: frozenset[int] = frozenset()

    @property
    def numbers(self) -> tuple[int, ...]:
        """All modes, in the order of the bundle."""
        return *self.operations, *self.ahead

    def ticks_left(self, tick: float) -> int:
        """Ticks [s] until the first clock that runs with time has run out, at most MOST."""
        if self.bundle is None or self.clocks is None or not self.clocked:
            return MOST
        left = (self.bundle.dwell - self.clocks)[self.bundle.clocked].min() / tick
        return min(MOST, ceil(left - ROUNDED))

    def go_on(self, seconds: float) -> None:
        """Advance the clocks that run with time."""
        if self.bundle is not None and self.clocks is not None and self.clocked:
            self.clocks[self.bundle.clocked] += seconds
