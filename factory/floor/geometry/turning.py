"""Parts that are presented turned about the vertical (`fed`), and turned as they belong before they
are joined.

A part turns about its *axis*: the vertical through the middle of its bounding box. Until it has
been turned back it may be in any orientation from the one in which it is presented to that which
it has in the product.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import ceil, cos, radians, sin

import numpy as np

from factory.floor.geometry.solids import Product, Solid
from factory.support.arrays import Array

STEP = radians(10.0)
"""A turn is looked at in steps no larger than this [rad]."""

Quaternion = tuple[float, float, float, float]


def fed_of(product: Product, parts: Sequence[str]) -> float:
    """Angle about the vertical by which what is made of some parts is presented turned [rad]: that
    of a part alone; 0 for parts that are joined."""
    return product.solids[parts[0]].fed if len(parts) == 1 else 0.0


def axis_of(solid: Solid) -> Array:
    """Where the axis about which a part turns stands (3,), at height 0 [m]."""
    x, y, _ = (solid.low + solid.high) / 2
    return np.array([x, y, 0.0])


def upright(angle: float) -> Quaternion:
    """The quaternion of a turn about the vertical."""
    return cos(angle / 2), 0.0, 0.0, sin(angle / 2)


def about_vertical(angle: float) -> Array:
    """The matrix (3, 3) of a turn about the vertical."""
    c, s = cos(angle), sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def presented(solid: Solid) -> Solid:
    """A part as it is presented: turned about its axis by `fed`; itself where that is 0."""
    if not solid.fed:
        return solid
    turn, axis = about_vertical(solid.fed), axis_of(solid)

    def moved(points: Array) -> Array:
        return np.asarray((points - axis) @ turn.T + axis)

    corners, pieces = moved(solid.corners), tuple(map(moved, solid.pieces))
    every = np.concatenate(pieces)
    w, x, y, z = solid.quaternion
    c, _, _, s = upright(solid.fed)
    return replace(
        solid,
        position=moved(solid.position),
        quaternion=np.array([c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w]),
        centre=moved(solid.centre),
        inertia=turn @ solid.inertia @ turn.T,
        low=every.min(axis=0),
        high=every.max(axis=0),
        corners=corners,
        pieces=pieces,
        fed=0.0,
    )


def turning_pieces(solid: Solid) -> tuple[Array, ...]:
    """Points (n, 3) whose convex hulls hold the pieces of a part in all its orientations, from the
    one in which it is presented to that in the product; its pieces where these are one."""
    if not solid.fed:
        return solid.pieces
    return tuple(_swept(piece, axis_of(solid), solid.fed) for piece in solid.pieces)


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
