"""How deep the bodies of a pair get into each other on their way along an axis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from factory.compiler.mating.depth import summits
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

CHUNK = 500_000
"""So many numbers are computed at a time."""

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

    @property
    def room(self) -> Array:
        """The least room (n, 2) on the way from either side but for the last bit of it [m], less
        than 0 where the two overlap, there or anywhere."""
        deep = np.where(self.path > TOLERANCE, self.path, -np.inf)
        return np.asarray(-np.maximum(self.graze, deep))

    @property
    def receding(self) -> Array:
        """How far (n, 2) the two must recede from each other [m], or be made smaller together, so
        that they neither overlap nor scrape on the way from either side."""
        return np.asarray(np.maximum(self.path, self.graze + CLEAR))

    def at(self, rows: Ints | slice) -> Depths:
        """Those of some of the pairs."""
        return Depths(self.finished[rows], self.path[rows], self.shift[rows], self.graze[rows])

    def put(self, rows: Ints | slice, found: Depths) -> None:
        """Replaces those of some of the pairs."""
        self.finished[rows], self.path[rows] = found.finished, found.path
        self.shift[rows], self.graze[rows] = found.shift, found.graze


def depths_of(heights: Array, slopes: Array) -> tuple[Depths, Array]:
    """The depths of pairs on their ways along an axis, from the bounds that half-spaces set (m, k):
    their `heights` in the finished product, and how much more a metre along the axis (k,). And the
    places (4, m) on the axis, from there, where those of `path` and `graze` are."""
    ways, begin = np.array([*SIGNS, *SIGNS], float), np.array([0.0, 0.0, LAST, LAST])
    depth, shift = np.empty((4, len(heights))), np.empty((4, len(heights)))
    step = max(1, CHUNK // max(1, len(slopes)))
    for start in range(0, len(heights), step):
        mine = heights[start : start + step]
        along = np.multiply.outer(ways, slopes)[:, None]
        lines = mine + begin[:, None, None] * along
        rows = np.broadcast_to(along, lines.shape).reshape(-1, len(slopes))
        most, at = summits(lines.reshape(-1, len(slopes)), rows)
        depth[:, start : start + step] = most.reshape(4, -1)
        shift[:, start : start + step] = at.reshape(4, -1)
    found = Depths(heights.min(axis=1), depth[:2].T, shift[:2].T, depth[2:].T)
    return found, (begin[:, None] + shift) * ways[:, None]
