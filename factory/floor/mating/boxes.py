"""How deep boxes get into each other on their ways along an axis."""

from __future__ import annotations

import numpy as np

from factory.floor.mating.bodies import ConvexBodies
from factory.floor.mating.paths import LAST, SIGNS, Depths
from factory.support.arrays import Array, Indices


def box_depths(bodies: ConvexBodies, moving: Indices, standing: Indices, axis: int) -> Depths:
    """The depths of bounding boxes (see `depth.py`), in closed form."""
    low, high = bodies.low, bodies.high
    up, down = high[standing] - low[moving], high[moving] - low[standing]
    depth = np.minimum(up, down)
    across = np.delete(depth, axis, axis=1).min(axis=1)[:, None]
    half = ((up[:, axis] + down[:, axis]) / 2)[:, None]
    ahead = (up[:, axis] - down[:, axis])[:, None] * np.array(SIGNS) / 2

    def most(ahead: Array) -> Array:
        along = np.where(ahead > 0, half, half - np.abs(ahead))
        return np.asarray(np.minimum(across, along))

    path = most(ahead)
    shift = np.where(ahead > 0, np.maximum(ahead - (half - path), 0.0), 0.0)
    finished = np.minimum(across[:, 0], depth[:, axis])
    return Depths(finished, path, shift, most(ahead - LAST), np.zeros(path.shape, bool))
