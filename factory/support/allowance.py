"""The budget of a search: a number of candidates, the same on any machine, and an upper bound on
time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from math import inf
from time import monotonic

__all__ = ["Allowance"]


_end: ContextVar[float] = ContextVar("end", default=inf)
"""When the time of the search is over in which work is done."""


class TimeOver(Exception):
    """The time of a search is over, and with it the work on a candidate."""


@dataclass(slots=True)
class Allowance:
    """The bounds of a search, and what it has used of them.

    Attributes:
        effort: number of candidates that may be examined.
        seconds: time after which no candidate is begun [s].
        stopped: whether the search was stopped; no candidate is begun then.
        spent: number of candidates examined.
        cut_off: whether time ended the search first, so that a faster machine would have examined
            more.
        begun: the time of its beginning [s].
    """

    effort: float
    seconds: float = inf
    stopped: Callable[[], bool] = field(default=lambda: False, repr=False)
    spent: int = 0
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

    @staticmethod
    def heed() -> None:
        """Called again and again by long work: raises TimeOver where the time of the search in
        which it is done is over."""
        if monotonic() > _end.get():
            raise TimeOver

    @contextmanager
    def limits(self) -> Iterator[None]:
        """Within its context work that heeds the time ends with it, and so does the context."""
        token = _end.set(self.begun + self.seconds)
        try:
            yield
        except TimeOver:
            self.cut_off = True
        finally:
            _end.reset(token)

    def spend(self) -> None:
        """Count one more candidate."""
        self.spent += 1

    def over(self, share: float = 1.0) -> bool:
        """Whether a share of the candidates has been examined, or the time is over."""
        if self.spent >= share * self.effort:
            return True
        self.cut_off = self.cut_off or self.elapsed > self.seconds
        return self.cut_off
