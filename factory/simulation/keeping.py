"""What a run keeps of its state to be gone on with later, told once for both ways: a component
passes its values to a `Keeper`, which notes them down, or gives back those that were noted.

What is taken up comes from a file, which may say anything: each value is checked as it is taken.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Container, Iterable, Mapping
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

T = TypeVar("T")
R = TypeVar("R", bound=tuple[Any, ...])
Test = Callable[[Any], bool]
Arrays = Mapping[str, NDArray[Any]]

LARGE = 10**9
"""Upper bound on every length [m], time [s] and count that is taken up."""

VALUES = "values"
"""The array of the values that are no arrays: JSON."""

KINDS = {"b": "|u1", "u": "<i4", "i": "<i4", "f": "<f8"}
"""The types in which arrays are noted down, by their kinds."""


class Keeper(Protocol):
    """Keeps values by name. `takes_up`: gives what was noted down; raises ValueError where that
    is missing, or no run can have it."""

    @property
    def takes_up(self) -> bool: ...

    def array(
        self, name: str, values: NDArray[Any], low: float = -LARGE, high: float = LARGE
    ) -> None:
        """The content of an array, which is written over when it is taken up: of the same shape,
        and from `low` to `high`."""

    def value(self, name: str, value: T, is_good: Test) -> T:
        """A value of JSON, where it `is_good`."""

    def rows(self, name: str, rows: Iterable[R], *tests: Test) -> list[R]:
        """Rows of values of JSON, each of which passes its test."""

    def number(self, name: str, value: float, low: float = -LARGE, high: float = LARGE) -> float:
        """A number from `low` to `high`, to the last bit."""

    def flag(self, name: str, value: bool) -> bool:
        """Whether something is so."""

    def whole(self, name: str, value: int, low: int = 0, high: int = LARGE) -> int:
        """A whole number from `low` to `high`."""


class Noting:
    """A Keeper that notes values down: `arrays` has them all."""

    takes_up = False

    def __init__(self) -> None:
        self._values: dict[str, Any] = {}
        self._arrays: dict[str, NDArray[Any]] = {}

    @property
    def arrays(self) -> dict[str, NDArray[Any]]:
        """All that has been noted down."""
        text = json.dumps(self._values, allow_nan=False, separators=(",", ":"))
        return {**self._arrays, VALUES: np.frombuffer(text.encode(), "u1")}

    def array(
        self, name: str, values: NDArray[Any], low: float = -LARGE, high: float = LARGE
    ) -> None:
        self._arrays[name] = np.array(values, KINDS[values.dtype.kind])

    def value(self, name: str, value: T, is_good: Test) -> T:
        self._values[name] = value
        return value

    def rows(self, name: str, rows: Iterable[R], *tests: Test) -> list[R]:
        self._values[name] = [*rows]
        return self._values[name]  # type: ignore[no-any-return]

    def number(self, name: str, value: float, low: float = -LARGE, high: float = LARGE) -> float:
        self._arrays[name] = np.array([value], float)
        return value

    def flag(self, name: str, value: bool) -> bool:
        return self.value(name, bool(value), bool)

    def whole(self, name: str, value: int, low: int = 0, high: int = LARGE) -> int:
        return self.value(name, int(value), bool)


class TakingUp:
    """A Keeper that gives what was noted down in `arrays`, checked. Raises ValueError where those
    are not what `Noting` gives."""

    takes_up = True

    def __init__(self, arrays: Arrays) -> None:
        self._arrays = arrays
        try:
            self._values = json.loads(arrays[VALUES].tobytes())
        except (KeyError, RecursionError) as error:
            raise ValueError(f"it has no values: {error}") from error
        if not isinstance(self._values, dict):
            raise ValueError("its values are no table")

    def array(
        self, name: str, values: NDArray[Any], low: float = -LARGE, high: float = LARGE
    ) -> None:
        found, kind = self._arrays.get(name), KINDS[values.dtype.kind]
        if found is None:
            raise ValueError(f"it has no '{name}'")
        if found.dtype != kind or found.shape != values.shape:
            wanted = f"{kind} {values.shape}"
            raise ValueError(f"'{name}' is {found.dtype.str} {found.shape}, not {wanted}")
        if not ((found >= low) & (found <= high)).all():
            raise ValueError(f"'{name}' is out of range: not from {low:g} to {high:g}")
        values[...] = found

    def rows(self, name: str, rows: Iterable[R], *tests: Test) -> list[R]:
        found: Any = self.value(name, [], lambda v: isinstance(v, list))
        for row in found:
            if not isinstance(row, list) or len(row) != len(tests):
                raise ValueError(f"'{name}' can have no row {row!r:.60}")
            if not all(test(x) for test, x in zip(tests, row, strict=True)):
                raise ValueError(f"'{name}' can have no row {row!r:.60}")
        return [tuple(row) for row in found]  # type: ignore[misc]

    def value(self, name: str, value: T, is_good: Test) -> T:
        if name not in self._values:
            raise ValueError(f"it has no '{name}'")
        found: T = self._values[name]
        if not is_good(found):
            raise ValueError(f"'{name}' can be no {found!r:.60}")
        return found

    def number(self, name: str, value: float, low: float = -LARGE, high: float = LARGE) -> float:
        found = np.zeros(1)
        self.array(name, found, low, high)
        return float(found[0])

    def flag(self, name: str, value: bool) -> bool:
        return self.value(name, value, lambda v: type(v) is bool)

    def whole(self, name: str, value: int, low: int = 0, high: int = LARGE) -> int:
        return self.value(name, value, lambda v: type(v) is int and low <= v <= high)


def keep_draws(keeper: Keeper, name: str, draws: np.random.Generator) -> None:
    """Where a generator of random numbers (PCG64) is."""
    state: Any = draws.bit_generator.state
    kept = [state["state"]["state"], state["state"]["inc"], state["has_uint32"], state["uinteger"]]
    bounds = (1 << 128, 1 << 128, 2, 1 << 32)
    found = keeper.rows(name, [(*kept,)], *map(up_to, bounds))
    if len(found) != 1:
        raise ValueError(f"'{name}' is {len(found)} states, not one")
    at, inc, has, left = found[0]
    draws.bit_generator.state = {
        **state,
        "state": {"state": at, "inc": inc | 1},
        "has_uint32": has,
        "uinteger": left,
    }


def up_to(count: float) -> Test:
    """Whether a value is a whole number from 0 to less than `count`."""
    return lambda v: type(v) is int and 0 <= v < count


def one_of(names: Container[str]) -> Test:
    """Whether a value is one of some names."""
    return lambda v: isinstance(v, str) and v in names


def some_of(names: Container[str]) -> Test:
    """Whether a value is a list of some names."""
    return lambda v: isinstance(v, list | tuple) and all(map(one_of(names), v))


def is_size(value: Any) -> bool:
    """Whether a value is a number from 0, not too large."""
    return type(value) in (int, float) and 0 <= value <= LARGE


def maybe_size(value: Any) -> bool:
    """Whether a value is a number from 0, not too large, or None."""
    return value is None or is_size(value)


def is_text(value: Any) -> bool:
    """Whether a value is a text."""
    return isinstance(value, str)
