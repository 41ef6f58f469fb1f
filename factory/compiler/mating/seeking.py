"""The depths of bodies with very many faces, whose difference has too many facets to list.

Only the facets of the Minkowski difference that bound a depth are sought. Two bounds close in on
it: the hull of the points of the difference that are known lies inside, the half-spaces that touch
it in known directions contain it. The facets of the hull at which its depths are attained are the
next directions, until the hull reaches as far there as the difference does.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from factory.compiler.mating.depth import Difference, distinct
from factory.compiler.mating.paths import Depths, depths_of
from factory.geometry.meshes import Array

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
    found, _ = depths_of(outside.heights(apart), outside.normals[:, axis])
    for row in np.flatnonzero(found.faulty.any(axis=1)).tolist():
        here = slice(row, row + 1)
        found.put(here, _closed_in(p, q, apart[here], axis, outside, tips))
    return found


def _closed_in(
    p: Array, q: Array, apart: Array, axis: int, outside: Difference, tips: Array
) -> Depths:
    """The depths in one place, `apart` (1, 3), from half-spaces that contain the difference, and
    the points at which they touch it."""
    from scipy.spatial import ConvexHull, QhullError

    found, _ = depths_of(outside.heights(apart), outside.normals[:, axis])
    try:
        hull = ConvexHull(tips, incremental=True)
        for _ in range(MOST):
            binding = _binding(
                Difference(hull.equations[:, :3], -hull.equations[:, 3]), apart, axis
            )
            touching, tips = _touching(binding.normals, p, q)
            outside = outside.and_those_of(touching)
            found, _ = depths_of(outside.heights(apart), outside.normals[:, axis])
            further = touching.bounds > binding.bounds + NEAR
            if not (further.any() and found.faulty.any()):
                break
            hull.add_points(tips[further])
    except QhullError:  # the difference is flat, or nearly: what touches it is known
        pass
    return found


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
