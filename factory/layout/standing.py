"""What a product stands on: a plate with a slot, into which a round bottom dips."""

from __future__ import annotations

import numpy as np

from factory.geometry.meshes import Array
from factory.geometry.solids import Product
from factory.layout.hands.surfaces import Body

FLAT = 1e-5
"""What dips no deeper stands flat [m]."""

HalfSpace = tuple[int, float, int]
"""All that is beyond a bound [m] on an axis, one way (+1, -1) along it."""


def dip(product: Product, plates: list[HalfSpace]) -> float:
    """How much higher a product is where it is over some plates, which are level, than where it is
    lowest [m]: 0 where it is over none."""
    bodies = [body for solid in product.solids.values() for body in Body.of(solid)]
    least, bottom = np.inf, float(product.low[2])
    for body in sorted(bodies, key=lambda body: float(body.low[2])):
        if float(body.low[2]) >= least:
            break
        least = min(least, *(_lowest(body, *plate) for plate in plates), np.inf)
    deep = least - bottom
    return deep if FLAT < deep < np.inf else 0.0


def _lowest(body: Body, axis: int, bound: float, way: int) -> float:
    """How low a body is beyond a bound [m]; inf where it is not there."""
    beyond = way * (np.array([body.low, body.high])[:, axis] - bound)
    if beyond.max() <= 0:
        return np.inf
    if body.ball:
        middle, radius = (body.low + body.high) / 2, (body.high - body.low)[2] / 2
        short = max(0.0, -way * float(middle[axis] - bound))
        return float(middle[2] - np.sqrt(max(radius**2 - short**2, 0.0)))
    ends = body.edges
    far = way * (ends[:, :, axis] - bound)
    heights: Array = ends[:, :, 2]
    found = heights[far >= 0].min(initial=np.inf)
    crossing = far.prod(axis=1) < 0
    share = far[crossing, 0] / (far[crossing, 0] - far[crossing, 1])
    at = heights[crossing, 0] + share * (heights[crossing, 1] - heights[crossing, 0])
    return float(min(found, at.min(initial=np.inf)))
