"""How much room the pads and fingers of hands take, whatever kind of hand they belong to."""

from __future__ import annotations

import numpy as np

from factory.floor.layout.dimensions import FINGER
from factory.floor.layout.hands.surfaces import Way
from factory.support.arrays import Array

AIR = 2e-4
"""How far a pad stays off the surface that it holds [m]: it slides along it without touching."""

APART = 2e-4
"""A hand is so far from all parts beside it [m]: they come and go with that play."""

SLENDER = 0.001
"""Least width of a finger [m]."""


def widths(radius: Array) -> Array:
    """Widths (n,) of the fingers of pads of some radii (n,) [m]: no wider than the pads, within
    bounds."""
    return np.minimum(np.maximum(2 * radius, SLENDER), FINGER)


def halves(radius: Array) -> Array:
    """Half the width of pads of some radii (n,) and their fingers (n,) [m]."""
    return np.maximum(radius, widths(radius) / 2)


def back(way: Way) -> Way:
    """The opposite direction."""
    return -way[0], -way[1]
