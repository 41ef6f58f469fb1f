"""Rotations in degrees, `turn = ( 0, 0, 90 )`, and the quaternions of them."""

from __future__ import annotations

from functools import reduce
from math import asin, atan2, cos, degrees, hypot, radians, sin

Turn = tuple[float, ...]
"""Angles (3,) about x, y and z of the product [degrees], in this order, about fixed axes."""

Quaternion = tuple[float, ...]
"""(w, x, y, z)."""

CLEAN = 0.1
"""Angles of clean rotations are multiples of this [degrees]."""

DIGITS = 9
"""Decimals of a quaternion."""

EQUAL = 2e-9
"""Quaternions are equal whose numbers differ by no more than this."""

LEVEL = 1e-9
"""A rotation about y by a right angle within this leaves one angle of the other two free."""


def quaternion_of(turn: Turn) -> Quaternion:
    """The unit quaternion of a rotation in degrees, w >= 0.

    >>> quaternion_of((0, 0, 180))
    (0.0, 0.0, 0.0, 1.0)
    """
    halves = [radians(angle % 360) / 2 for angle in turn]
    axes = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
    single = [
        (cos(half), *(sin(half) * x for x in axis)) for half, axis in zip(halves, axes, strict=True)
    ]
    whole = [round(number, DIGITS) + 0.0 for number in reduce(_after, single)]
    sign = -1.0 if next((x for x in whole if x), 1.0) < 0 else 1.0
    return tuple(sign * x + 0.0 for x in whole)


def _after(first: Quaternion, second: Quaternion) -> Quaternion:
    """The rotation by one quaternion and then by another."""
    a, b, c, d = second
    w, x, y, z = first
    return (
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    )


def turn_of(quaternion: Quaternion) -> Turn | None:
    """The clean rotation of a quaternion, with the fewest and smallest angles; None if it is
    none."""
    w, x, y, z = quaternion
    size = hypot(w, x, y, z)
    w, x, y, z = w / size, x / size, y / size, z / size
    tilt = max(-1.0, min(1.0, 2 * (w * y - z * x)))
    if abs(tilt) > 1 - LEVEL:
        about = (0.0, asin(tilt), -2 * atan2(x, w) if tilt > 0 else 2 * atan2(x, w))
    else:
        about = (
            atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
            asin(tilt),
            atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
        )
    turn = tuple(round(degrees(angle) / CLEAN) * CLEAN for angle in about)
    other = (turn[0] + 180, 180 - turn[1], turn[2] + 180)
    ways = [_within(way) for way in (turn, other)]
    best = min(ways, key=lambda way: (sum(map(bool, way)), sum(map(abs, way))))
    made = quaternion_of(best)
    unit = (w, x, y, z)
    far = (max(abs(a - s * b) for a, b in zip(made, unit, strict=True)) for s in (1, -1))
    return best if min(far) <= EQUAL else None


def _within(turn: Turn) -> Turn:
    """The same angles in (-180, 180], without rounding errors."""
    angles = (round(angle, 6) % 360 for angle in turn)
    return tuple((angle - 360 if angle > 180 else angle) + 0.0 for angle in angles)
