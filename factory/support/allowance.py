"""The budget of a search: a number of candidates, the same on any machine, and an upper bound on
time."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf
from time import monotonic


@dataclass(slots=True)
class Allowance:
    """At most `effort` candidates are examined, and none is begun after `seconds`. `spent`: their
    number so far; `cut_off`: whether time ended the search first, so that a faster machine would
    have examined more."""

    effort: float
    seconds: float = inf
    spent: int = 0
    cut_off: bool = False
    begun: float = field(default_factory=monotonic, repr=False)

    @property
    def left(self) -> float:
        """Remaining time [s]."""
        return max(0.0, self.seconds - (monotonic() - self.begun))

    def spend(self) -> None:
        """Count one more candidate."""
        self.spent += 1

    def over(self, share: float = 1.0) -> bool:
        """Whether a share of the candidates has been examined, or the time is over."""
        if self.spent >= share * self.effort:
            return True
        self.cut_off = self.cut_off or monotonic() - self.begun > self.seconds
        return self.cut_off
