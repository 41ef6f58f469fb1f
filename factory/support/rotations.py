"""Rotations in space."""

from __future__ import annotations

import numpy as np

from factory.support.arrays import Array

__all__ = ["rotation"]


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
