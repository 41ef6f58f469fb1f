"""Rotations in space."""

from __future__ import annotations

from math import cos, sin

import numpy as np

from factory.support.arrays import Array

__all__ = ["about_vertical", "rotation", "upright"]

Quaternion = tuple[float, float, float, float]
"""w, x, y, z."""


def rotation(quaternion: Array) -> Array:
    """A rotation matrix (3, 3).

    Args:
        quaternion: a unit quaternion (4,), w first.
    """
    w, x, y, z = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def upright(angle: float) -> Quaternion:
    """The quaternion of a turn about the vertical."""
    return cos(angle / 2), 0.0, 0.0, sin(angle / 2)


def about_vertical(angle: float) -> Array:
    """The matrix (3, 3) of a turn about the vertical."""
    c, s = cos(angle), sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
