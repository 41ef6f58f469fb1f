"""What a search may spend: so many candidates, which are the same on any machine; and, as a mere
bound, so much time."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf
from time import monotonic


@dataclass(slots=True)
class Allowance:
    """At most `effort` candidates are looked at, and none is begun after `seconds`. `spent`: how
    many were; `cut_off`: whether the time ended the search first, so that on a faster machine, or a
    quieter one, more would have been looked at."""

    effort: float
    seconds: float = inf
    spent: int = 0
    cut_off: bool = False
    begun: float = field(default_factory=monotonic, repr=False)

    @property
    def left(self) -> float:
        """The time that is left [s]."""
        return max(0.0, self.seconds - (monotonic() - self.begun))

    def spend(self) -> None:
        """One more candidate is looked at."""
        self.spent += 1

    def over(self, share: float = 1.0) -> bool:
        """Whether a share of the candidates was looked at, or the time is over."""
        if self.spent >= share * self.effort:
            return True
        self.cut_off = self.cut_off or monotonic() - self.begun > self.seconds
        return self.cut_off
