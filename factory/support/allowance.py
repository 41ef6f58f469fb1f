"""The budget of a search: a number of candidates, the same on any machine, and an upper bound on
time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf
from time import monotonic


@dataclass(slots=True)
class Allowance:
    """At most `effort` candidates are examined, and none is begun after `seconds`, or once it is
    `stopped`. `spent`: their number so far; `cut_off`: whether time ended the search first, so that
    a faster machine would have examined more."""

    effort: float
    seconds: float = inf
    stopped: Callable[[], bool] = field(default=lambda: False, repr=False)
    spent: float = 0
    cut_off: bool = False
    begun: float = field(default_factory=monotonic, repr=False)

    @property
    def elapsed(self) -> float:
        """The time since the search began [s]; infinite once it is stopped."""
        return inf if self.stopped() else monotonic() - self.begun

    @property
    def left(self) -> float:
        """Remaining time [s]."""
        return max(0.0, self.seconds - self.elapsed)

    @property
    def used(self) -> float:
        """The share of the candidates or of the time that is used up, whichever is greater."""
        return max(self.spent / self.effort, self.time_used)

    @property
    def time_used(self) -> float:
        """The share of the time that is used up; infinite once the search is stopped."""
        elapsed = self.elapsed
        return elapsed if elapsed == inf else elapsed / self.seconds

    def spend(self, cost: float = 1) -> None:
        """Count one more candidate, or what costs as much as several."""
        self.spent += cost

    def over(self, share: float = 1.0) -> bool:
        """Whether a share of the candidates has been examined, or the time is over."""
        if self.spent >= share * self.effort:
            return True
        self.cut_off = self.cut_off or self.elapsed > self.seconds
        return self.cut_off
