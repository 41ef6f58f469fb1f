"""Bounds on the values of a run and of a search, the same for options and for functions; and the
budget of a search: a number of candidates, the same on any machine, and an upper bound on time."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from math import inf
from numbers import Integral, Real
from time import monotonic
from types import MappingProxyType
from typing import Any, Literal, get_args

from factory.support.errors import Diagnostic, InputError, did_you_mean
from factory.support.settings import LONGEST

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


Bounds = tuple[float, float]

BOUNDS: Mapping[str, Bounds] = MappingProxyType(
    {
        "units": (1, 10**9),
        "seed": (0, 2**63 - 1),
        "jitter": (0.0, 0.9),
        "wip": (1, 10**9),
        "spares": (0, 10**6),
        "swap": (0.0, LONGEST),
        "max_time": (0.0, LONGEST),
        "cycle": (0.0, LONGEST),
        "seconds": (0.0, LONGEST),
        "effort": (1, 10**6),
        "robots": (1, 10**9),
        "tile": (0.02, 10**3),
        "jobs": (1, 1024),
        "fps": (1, 120),
    }
)
"""Least and greatest value, whole numbers where these are; a time in seconds is more than 0."""

TIMES = ("swap", "max_time", "cycle", "seconds")
"""Times, whose least value is excluded [s]."""

WorldName = Literal["mujoco", "ideal"]
"""The worlds in which a factory runs."""

WORLDS: tuple[WorldName, ...] = get_args(WorldName)

AIMS = ("cycle", "robots", "floor")
"""What the search for an assembly tree may minimise."""

UPS: Mapping[str, tuple[int, int]] = MappingProxyType(
    {f"{sign}{name}": (n, -1 if sign else 1) for sign in ("", "-") for n, name in enumerate("xyz")}
)
"""The directions that may be up: an axis, and the side of it."""

LENGTHS = ("m", "cm", "mm", "in", "ldu")
"""The names of units of length; `ldu` is that of LDraw, 0.4 mm."""


def check_values(values: Mapping[str, object]) -> None:
    """Check values by their names in BOUNDS; None is always valid. Raises InputError (Usage) with
    every fault."""
    faults = [fault for name, value in values.items() for fault in _faults(name, value)]
    if faults:
        raise InputError(faults)


def check_choice(name: str, value: object, valid: tuple[str, ...]) -> None:
    """Check that a value is one of some words. Raises InputError (Usage)."""
    if value not in valid:
        hint = did_you_mean(str(value), valid, f"values of {name}")
        raise InputError(Diagnostic("Usage", f"{name} = {value!r:.60} is not valid", None, hint))


def _faults(name: str, value: Any) -> Iterator[Diagnostic]:
    (low, high), least = BOUNDS[name], "more than" if name in TIMES else "at least"
    kind, noun = (Integral, "whole number") if isinstance(low, int) else (Real, "number")
    right = isinstance(value, kind) and not isinstance(value, bool)
    inside = right and low <= value <= high and (name not in TIMES or value > low)
    if value is not None and not inside:
        hint = f"{name} is a {noun}, {least} {low} and at most {high}"
        yield Diagnostic("Usage", f"{name} = {value!r:.60} is not valid", None, hint)


def pair(text: str, option: str, example: str, number: type, most: int) -> tuple[Any, Any]:
    """`4x3` as two positive numbers of at most `most`. Raises InputError (BadValue)."""
    try:
        width, depth = (number(word) for word in text.lower().split("x"))
        if not text.isascii() or "_" in text or not (0 < width <= most and 0 < depth <= most):
            raise ValueError
    except ValueError:
        message = f"{option} takes two positive numbers up to {most}, not '{text}'"
        raise InputError(
            Diagnostic("BadValue", message, None, f"for example {option} {example}")
        ) from None
    return width, depth
