"""How high an input is raised above its place, so that it clears the others wherever it comes."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil

from factory.compiler.mating.meetings import Meeting
from factory.geometry.solids import Product
from factory.plant.approaches import MARGIN


def strokes(product: Product, parts: Sequence[str], meeting: Meeting) -> tuple[float, float]:
    """The strokes if the first, or the last input is lowered, in whole millimetres [m]: from its
    bottom to the top of the others, and a margin."""
    rest = _span(product, parts[meeting.first : meeting.split])
    last = _span(product, parts[meeting.split : meeting.end])
    return _stroke(last[1] - rest[0]), _stroke(rest[1] - last[0])


def _stroke(height: float) -> float:
    return round(ceil((max(height, 0.0) + MARGIN) * 1e3 - 1e-6) / 1e3, 3)


def _span(product: Product, parts: Sequence[str]) -> tuple[float, float]:
    """From where to where parts reach upwards."""
    solids = [product.solids[part] for part in parts]
    return float(min(s.low[2] for s in solids)), float(max(s.high[2] for s in solids))
