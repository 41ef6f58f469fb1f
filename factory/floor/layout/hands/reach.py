"""The boxes of a hand among the payloads: pad and column, pad and stem, or pad and bar."""

from __future__ import annotations

import numpy as np

from factory.floor.geometry.solids import Product
from factory.floor.layout.dimensions import BEAM, FINGER
from factory.floor.layout.hands.hand import AIR, Kind, widths
from factory.floor.layout.hands.surfaces import Way
from factory.support.arrays import Array

APART = 2e-4
"""A hand is so far from all parts beside it [m]: they come and go with that play."""


def reach(product: Product, kind: Kind, at: Array, radius: Array, u: Way) -> tuple[Array, Array]:
    """The boxes (n, 3) [m] of pad and column, pad and stem, or pad and bar of hands that head along
    u, with pads of some radii (n,) at places (n, 3), including play. Over a pad half its air is
    play: a payload sags, and may hang lower than the pad."""
    half = halves(radius)[:, None] if kind == "behind" else radius[:, None]
    low, high = at - half - APART, at + half + APART
    if kind == "below":
        low[:, 2], high[:, 2] = product.low[2] - 1.0, at[:, 2] - AIR / 2
    elif kind == "above":
        low[:, 2], high[:, 2] = at[:, 2] + AIR, product.high[2] + 10.0
    else:
        low[:, 2] = np.minimum(low[:, 2], at[:, 2] - BEAM / 2)
        high[:, 2] = np.maximum(high[:, 2], at[:, 2] + BEAM / 2)
        axis, ahead = (0, u[0]) if u[0] else (1, u[1])
        (high if ahead > 0 else low)[:, axis] = at[:, axis] - ahead * AIR
    return low, high


def under_beam(kind: Kind, low: Array, high: Array, radius: Array) -> tuple[Array, Array]:
    """The boxes of hands for parts that are lowered: a hand above is as wide as its beam, which is
    over its pad."""
    more = np.maximum(0.0, FINGER / 2 - radius)[:, None] * [1.0, 1.0, 0.0] * (kind == "above")
    return low - more, high + more


def halves(radius: Array) -> Array:
    """Half the width of pads of some radii (n,) and their fingers (n,) [m]."""
    return np.maximum(radius, widths(radius) / 2)


def back(way: Way) -> Way:
    """The opposite direction."""
    return -way[0], -way[1]
