"""Bounds on the values of a run and of a search, the same for options and for functions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from numbers import Integral, Real
from types import MappingProxyType
from typing import Any, Literal, get_args

from factory.support.errors import Diagnostic, InputError, did_you_mean

LONGEST = 1e9
"""Upper bound on a time given by the user [s]: 30 years."""

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
    """Check values by their names: a world is one of WORLDS, others are within BOUNDS, or None.
    Raises InputError (Usage) with every fault."""
    if "world" in values:
        check_choice("world", values["world"], WORLDS)
    numbers = {name: value for name, value in values.items() if name != "world"}
    faults = [fault for name, value in numbers.items() for fault in _faults(name, value)]
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
