"""Numbers as they are written, units of length, and whole millimetres."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from decimal import Decimal
from types import MappingProxyType

__all__ = ["UNITS", "is_number", "number", "up"]

UNITS: Mapping[str, float] = MappingProxyType({"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254})
"""The units of length [m]."""

_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")


def is_number(word: str) -> bool:
    """Whether a word is written as a number: a sign, decimals and an exponent are allowed."""
    return _NUMBER.fullmatch(word) is not None


def number(word: str, unit: str = "m") -> float | None:
    """The finite number of a word, converted to metres from `unit` as exactly as if it were written
    in metres. None if it is not a number or overflows."""
    if not is_number(word):
        return None
    value = float(word)
    if unit != "m" and math.isfinite(value):
        value = float(Decimal(word) * Decimal(repr(UNITS[unit])))
    return value if math.isfinite(value) else None


def up(length: float) -> float:
    """The next whole millimetre [m]: rounding up keeps things apart."""
    return math.ceil(length * 1000 - 1e-6) / 1000
