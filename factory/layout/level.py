"""How high a robot holds what it brings."""

from __future__ import annotations

from dataclasses import dataclass

LEAST = 0.001
"""A lift goes up by so much at least [m]."""


@dataclass(frozen=True, slots=True)
class Level:
    """How high a robot holds what it brings on one of its tours [m]: how far up its lift is where
    it delivers (`down`), and before that (`up`), and how far above its place in the product it
    carries that (`elevation`)."""

    down: float
    up: float
    elevation: float
