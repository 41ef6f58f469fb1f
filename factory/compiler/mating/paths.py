"""How deep the bodies of a pair get into each other on their way along an axis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from factory.compiler.mating.depth import Difference, deepest
from factory.compiler.mating.meetings import Ints
from factory.geometry.meshes import Array

TOLERANCE = 2e-5
"""Overlaps of no more than this [m] do not count: what welds in the engine give way, and far above
what numbers written with five digits are rounded by."""

CLEAR = 5e-5
"""On their way bodies that do not overlap still need so much room between them [m], or they scrape:
faces that are flush catch at their edges when a weld gives way by its 0.03 mm."""

LAST = 1e-3
"""But for the last bit of the way [m]: finished parts may touch."""

SIGNS = (-1, +1)
"""The sides from which the last input comes: its path is shifted to this side of the axis."""


@dataclass(frozen=True)
class Depths:
    """How deep the two of each pair get into each other [m], less than 0 where apart: `finished`
    (n,) in the finished product; `path` (n, 2) the most if the last input comes from the lower or
    the upper side, and `shift` (n, 2) how far from its place that is; `graze` (n, 2) the most but
    for the last bit of the way."""

    finished: Array
    path: Array
    shift: Array
    graze: Array

    @property
    def faulty(self) -> NDArray[np.bool_]:
        """Which pairs (n, 2) overlap or scrape on the way from either side."""
        return np.asarray((self.path > TOLERANCE) | (self.graze > -CLEAR))

    def at(self, rows: Ints | slice) -> Depths:
        """Those of some of the pairs."""
        return Depths(self.finished[rows], self.path[rows], self.shift[rows], self.graze[rows])

    def put(self, rows: Ints, found: Depths) -> None:
        """Replaces those of some of the pairs."""
        self.finished[rows], self.path[rows] = found.finished, found.path
        self.shift[rows], self.graze[rows] = found.shift, found.graze


def depths_along(difference: Difference, apart: Array, axis: int) -> tuple[Depths, Array]:
    """The depths where the moving body, in its place `apart` (m, 3) from the other, comes along an
    axis; and where it is (5 m, 3) at each of these depths."""
    ways = np.multiply.outer(SIGNS, np.eye(3)[axis])
    starts = np.stack([apart, apart, apart + LAST * ways[0], apart + LAST * ways[1]])
    along = np.broadcast_to(np.concatenate([ways, ways])[:, None], starts.shape).reshape(-1, 3)
    depth, shift = deepest(difference, starts.reshape(-1, 3), along)
    places = starts.reshape(-1, 3) + shift[:, None] * along
    depth, shift = depth.reshape(4, -1).T, shift.reshape(4, -1).T
    finished = difference.heights(apart).min(axis=1)
    found = Depths(finished, depth[:, :2], shift[:, :2], depth[:, 2:])
    return found, np.concatenate([apart, places])
