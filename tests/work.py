"""Work counted in place of time: the same on any machine."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")


def counted(function: Callable[..., T], *inputs: object) -> tuple[int, T]:
    """How many functions a call of `function` calls, those in C included, and what it returns."""
    count = 0

    def seen(frame: object, event: str, argument: object) -> None:
        nonlocal count
        count += event in ("call", "c_call")

    sys.setprofile(seen)
    try:
        result = function(*inputs)
    finally:
        sys.setprofile(None)
    return count, result
