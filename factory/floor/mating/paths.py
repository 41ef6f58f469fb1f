"""How deep the bodies of a pair get into each other on their way along an axis.

The difference of bodies with very many faces has too many facets to list. Of these only the facets
that bound a depth are sought. Two bounds close in on it: the hull of the known points of the
difference lies inside, the half-spaces that touch it in known directions contain it. The facets of
the hull at which its depths are attained are the next directions, until the hull reaches as far
there as the difference does.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from factory.floor.mating.depth import Difference, distinct, summits
from factory.support.arrays import Array, Indices

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
    for the last bit of the way; `cuts` (n, 2): whether the way sweeps more of the other than both
    share in the finished product, however deep that is."""

    finished: Array
    path: Array
    shift: Array
    graze: Array
    cuts: NDArray[np.bool_]

    @property
    def faulty(self) -> NDArray[np.bool_]:
        """Which pairs (n, 2) overlap or scrape on the way from either side."""
        return np.asarray((self.path > TOLERANCE) | (self.graze > -CLEAR) | self.cuts)

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

    @property
    def columns(self) -> tuple[NDArray[Any], ...]:
        """Its arrays."""
        return self.finished, self.path, self.shift, self.graze, self.cuts

    def at(self, rows: Indices | slice) -> Depths:
        """Those of some of the pairs."""
        return Depths(*(column[rows] for column in self.columns))

    def put(self, rows: Indices | slice, depths: Depths) -> None:
        """Replaces those of some of the pairs."""
        for column, values in zip(self.columns, depths.columns, strict=True):
            column[rows] = values


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
    cuts = np.zeros((len(heights), 2), bool)
    depths = Depths(heights.min(axis=1), depth[:2].T, shift[:2].T, depth[2:].T, cuts)
    return depths, (begin[:, None] + shift) * ways[:, None]


MANY = 60_000
"""The facets of bodies with more pairs of vertices are sought."""

NEAR = 1e-7
"""Depths are sought up to this [m]."""

SAME = 1e-10
"""Facets bound a depth together if they differ by no more than this [m]."""

MOST = 200
"""So many times, at most, the hull grows; a depth is then found too large, never too small."""

_GRID = np.array([way for way in product((-1, 0, 1), repeat=3) if any(way)], float)
WAYS = _GRID / np.linalg.norm(_GRID, axis=1, keepdims=True)
"""The first directions (26, 3): along the axes and between them."""


def sought(p: Array, q: Array, apart: Array, axis: int) -> Depths:
    """The depths of a body P (n, 3) on its way along an axis through Q (k, 3), its place being
    `apart` (m, 3) from that of Q. Those of pairs that are not faulty may be too large."""
    outside, tips = _touching(WAYS, p, q)
    depths, _ = depths_of(outside.heights(apart), outside.normals[:, axis])
    for row in np.flatnonzero(depths.faulty.any(axis=1)).tolist():
        here = slice(row, row + 1)
        depths.put(here, _closed_in(p, q, apart[here], axis, outside, tips))
    return depths


def _closed_in(
    p: Array, q: Array, apart: Array, axis: int, outside: Difference, tips: Array
) -> Depths:
    """The depths in one place, `apart` (1, 3), from half-spaces that contain the difference, and
    the points at which they touch it."""
    from scipy.spatial import ConvexHull, QhullError

    depths, _ = depths_of(outside.heights(apart), outside.normals[:, axis])
    try:
        hull = ConvexHull(tips, incremental=True)
        for _ in range(MOST):
            binding = _binding(
                Difference(hull.equations[:, :3], -hull.equations[:, 3]), apart, axis
            )
            touching, tips = _touching(binding.normals, p, q)
            outside = outside.and_those_of(touching)
            depths, _ = depths_of(outside.heights(apart), outside.normals[:, axis])
            further = touching.bounds > binding.bounds + NEAR
            if not (further.any() and depths.faulty.any()):
                break
            hull.add_points(tips[further])
    except QhullError:  # the difference is flat, or nearly: what touches it is known
        pass
    return depths


def _touching(normals: Array, p: Array, q: Array) -> tuple[Difference, Array]:
    """The half-spaces (k, 3) with these normals that touch the difference of two bodies, and points
    (k, 3) at which they do."""
    tips = p[(normals @ p.T).argmax(axis=1)] - q[(normals @ q.T).argmin(axis=1)]
    return Difference(normals, np.einsum("ij,ij->i", normals, tips)), tips


def _binding(inside: Difference, apart: Array, axis: int) -> Difference:
    """The facets of a difference at which its depths in one place are attained."""
    heights, slopes = inside.heights(apart), inside.normals[:, axis]
    places = depths_of(heights, slopes)[1]
    lines = heights + np.concatenate([np.zeros((1, 1)), places]) * slopes
    binds = (lines <= lines.min(axis=1, keepdims=True) + SAME).any(axis=0)
    normals, bounds = inside.normals[binds], inside.bounds[binds]
    kept = distinct(normals)
    return Difference(normals[kept], bounds[kept])
