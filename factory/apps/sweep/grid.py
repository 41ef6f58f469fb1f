"""The grid of a sweep: the keys that vary, their values, and the points that they span.

`seed=0:1000` is a range, its end left out; `speed=0.2:0.6:0.1` has a step; `jitter=0.1,0.3` is a
list. Items of a list may be ranges.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from itertools import product
from math import ceil, isfinite, prod

from factory.api import Diagnostic, InputError, Settings
from factory.support.errors import did_you_mean

Value = float | int | str | None

Point = tuple[tuple[str, Value], ...]
"""One run of a sweep: a value for each key that varies."""

SETTINGS = tuple(field.name for field in fields(Settings))

WHOLE: Mapping[str, tuple[int, int]] = {
    **{
        name: (int(Settings.BOUNDS[name][0]), int(Settings.BOUNDS[name][1]))
        for name in ("seed", "units", "wip")
    },
    **{
        name: (int(low), int(high))
        for name, (low, high) in Settings.RANGES.items()
        if name in Settings.WHOLE
    },
}
"""Keys of whole numbers, with the least and the greatest value."""

WORLDS = ("mujoco", "ideal")

FAULT_RATE = "fault_rate"
"""The share of operations in which a robot drops its payload, and of joining operations in which an
input has slipped. It has columns in a database only if it varies; else nothing fails."""

KEYS = ("seed", "jitter", "units", "wip", "world", FAULT_RATE, *SETTINGS)
"""All keys that may vary."""

SHARES: Mapping[str, tuple[float, float]] = {
    "jitter": (0, Settings.BOUNDS["jitter"][1]),
    FAULT_RATE: (0, 0.5),
}
"""Keys of shares, with the least and the greatest value."""

DEFAULTS: Mapping[str, Value] = {
    "seed": 0,
    "jitter": 0.0,
    "units": 4,
    "wip": None,
    "world": "mujoco",
}
"""Default values of the keys that are not settings."""

MOST = 1_000_000
"""Upper bound on the runs of a sweep."""


@dataclass(frozen=True, slots=True)
class GridAxis:
    """A key that varies, and its distinct values in the order given."""

    key: str
    values: tuple[Value, ...]


def read_axes(texts: Sequence[str]) -> tuple[GridAxis, ...]:
    """The axes of the texts of `--vary`, e.g. `seed=0:1000`. Raises InputError with every fault."""
    axes: list[GridAxis] = []
    faults: list[Diagnostic] = []
    for text in texts:
        try:
            axes.append(_read_axis(text))
        except InputError as error:
            faults += error.diagnostics
    keys = [axis.key for axis in axes]
    for key in dict.fromkeys(k for k in keys if keys.count(k) > 1):
        faults.append(_usage(f"{key} is varied twice", f"--vary {key}=A,B"))
    size = prod(len(axis.values) for axis in axes)
    if not faults and size > MOST:
        faults.append(_usage(f"{size} runs are more than {MOST}", "take fewer values"))
    if faults:
        raise InputError(faults)
    return tuple(axes)


def points(axes: Sequence[GridAxis]) -> Iterator[Point]:
    """All points of a grid. Settings vary slowest and seeds fastest: a change of settings takes a
    new model, and of some a new layout."""
    rank = [(axis.key == "seed", axis.key not in SETTINGS) for axis in axes]
    order = sorted(range(len(axes)), key=lambda i: rank[i])
    for values in product(*(axes[i].values for i in order)):
        yield tuple((axes[i].key, value) for i, value in zip(order, values, strict=True))


def check_value(key: str, value: Value) -> Diagnostic | None:
    """The error of a value of a key: a number out of range or an unknown word; None if valid."""
    if key in SETTINGS and value is not None:
        try:
            Settings().with_options({key: value})
        except InputError as error:
            return error.diagnostics[0]
        return None
    if key == "world":
        if value in WORLDS:
            return None
        hint = did_you_mean(str(value), WORLDS, "worlds")
        return Diagnostic("BadValue", f"there is no world '{value}'", None, hint)
    if isinstance(value, int | float):
        low, high = SHARES[key] if key in SHARES else WHOLE[key]
        if not low <= value <= high:
            message = f"{key} = {value} is not between {low} and {high}"
            return Diagnostic("BadValue", message, None, f"for example {_example(key)}")
    return None


def _read_axis(text: str) -> GridAxis:
    key, equals, values = (word.strip() for word in text.partition("="))
    if key not in KEYS:
        hint = did_you_mean(key, KEYS, "keys")
        raise InputError(Diagnostic("UnknownParameter", f"unknown key '{key}'", None, hint))
    distinct: dict[Value, None] = {}
    for item in values.split(",") if equals else ():
        distinct |= dict.fromkeys(_read_item(key, item.strip()))
    if not distinct:
        raise InputError(_usage(f"'{text}' gives no values", f"for example {_example(key)}"))
    for value in distinct:
        fault = check_value(key, value)
        if fault is not None:
            raise InputError(fault)
    return GridAxis(key, tuple(distinct))


def _read_item(key: str, item: str) -> Iterator[Value]:
    """The values of one item of a list: a word, a number or a range."""
    if key == "world" or Settings.is_auto(key, item):
        yield item
    elif ":" in item:
        yield from _read_range(key, item)
    else:
        yield _number(key, item, item)


def _read_range(key: str, item: str) -> Iterator[Value]:
    """Values of `a:b` for whole numbers, of `a:b:step` for any; b is excluded."""
    words = item.split(":")
    if len(words) > 3 or (len(words) == 2 and key not in WHOLE):
        raise InputError(_usage(f"'{item}' of {key} has no step", f"{key}=START:END:STEP"))
    start, end = _number(key, words[0], item), _number(key, words[1], item)
    step = _number(key, words[2], item) if len(words) == 3 else 1
    if step <= 0 or end <= start:
        message = f"the range '{item}' of {key} is empty"
        raise InputError(_usage(message, f"{key}=START:END:STEP, START less than END"))
    count = (end - start) / step - 1e-9
    if count > MOST:
        raise InputError(_usage(f"{count:.0f} values of {key} are more than {MOST}", "take fewer"))
    for n in range(ceil(count)):
        value = start + n * step
        yield value if key in WHOLE else float(f"{value:.12g}")


def _number(key: str, word: str, item: str) -> int | float:
    """The number in a word, whole if the key's are. Raises InputError."""
    kind = "whole number" if key in WHOLE else "number"
    try:
        number = int(word) if key in WHOLE else float(word)
        if "_" in word or not isfinite(number):
            raise ValueError
    except (ValueError, OverflowError):
        message = f"{key} takes a {kind}, not '{item}'"
        raise InputError(_usage(message, f"for example {_example(key)}")) from None
    return number


def _example(key: str) -> str:
    """An example of the values of a key."""
    words = {"seed": "0:100", "jitter": "0.1,0.3", "units": "4,8", "wip": "1:4"}
    words |= {"world": "ideal,mujoco", "timestep": "auto,0.002", "substeps": "1,5"}
    words[FAULT_RATE] = "0,0.01,0.05"
    return f"--vary {key}={words.get(key) or getattr(Settings(), key, '')}"


def _usage(message: str, hint: str) -> Diagnostic:
    return Diagnostic("BadValue", message, None, hint)
