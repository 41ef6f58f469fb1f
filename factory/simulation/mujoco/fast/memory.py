"""The memory of an array of numbers, to read and to write some at a time: where few are touched
behind the engine's step, whose caches it has taken, that takes a third of the time of NumPy's
calls."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from struct import Struct
from typing import Any

from factory.control.mode import Array

BYTES = 8
"""A number takes so much."""

PLACE, TURN, AXES = 3 * BYTES, 4 * BYTES, 9 * BYTES
"""What the engine has of a body takes so much: where it is, its quaternion, and its matrix."""


def reader(values: Array, count: int) -> Callable[[int], tuple[float, ...]]:
    """What gives so many numbers of an array from a byte on."""
    return partial(Struct(f"{count}d").unpack_from, values.data.cast("B"))


def writer(values: Array, count: int) -> Callable[..., Any]:
    """What puts so many numbers into an array from a byte on."""
    return partial(Struct(f"{count}d").pack_into, values.data.cast("B"))
