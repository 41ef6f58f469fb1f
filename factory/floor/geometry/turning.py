"""Parts that are presented turned about the vertical (`fed`), and turned as they belong before they
are joined.

A part turns about its *axis*: the vertical through the middle of its bounding box. Until it has
been turned back it may be in any orientation from the one in which it is presented to that which
it has in the product.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, cos, radians

import numpy as np

from factory.floor.geometry.solids import Product, Solid
from factory.support.arrays import Array
from factory.support.rotations import about_vertical

STEP = radians(10.0)
"""A turn is looked at in steps no larger than this [rad]."""


def fed_of(product: Product, parts: Sequence[str]) -> float:
    """Angle about the vertical by which what is made of some parts is presented turned [rad]: that
    of a part alone; 0 for parts that are joined."""
    return product.solids[parts[0]].fed if len(parts) == 1 else 0.0


def turning_pieces(solid: Solid) -> tuple[Array, ...]:
    """Points (n, 3) whose convex hulls hold the pieces of a part in all its orientations, from the
    one in which it is presented to that in the product; its pieces where these are one."""
    if not solid.fed:
        return solid.pieces
    return tuple(_swept(piece, solid.axis, solid.fed) for piece in solid.pieces)


def turning_box(solid: Solid) -> tuple[Array, Array]:
    """The box, from low (3,) to high (3,), of a part in all these orientations [m]."""
    if not solid.fed:
        return solid.low, solid.high
    every = np.concatenate(turning_pieces(solid))
    return every.min(axis=0), every.max(axis=0)


def _swept(points: Array, axis: Array, angle: float) -> Array:
    """The points at every step of a turn, moved outwards so that a chord is outside its arc."""
    steps = ceil(abs(angle) / STEP)
    wider = [1 / cos(angle / steps / 2)] * 2 + [1.0]
    turns = (about_vertical(angle * step / steps) for step in range(steps + 1))
    return np.concatenate([((points - axis) * wider) @ turn.T + axis for turn in turns])
