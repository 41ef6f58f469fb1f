"""Convex bodies of fewer corners, for layouts that are tried and not kept.

A round part of 20,000 triangles has a hull of thousands of corners, and the places of hands are
sought on each of its faces. The hull of some of the corners lies within that of all, and as near to
it as is asked.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import product as pairs

import numpy as np

from factory.floor.geometry.solids import Solid
from factory.support.arrays import Array

ENOUGH = 400
"""A convex body of so many corners is not thinned."""

WITHIN = 5e-5
"""How far a thinned body may be from the body [m]: half the gap under a feeder's pad."""

SIDES = np.array([way for way in pairs((-1.0, 0.0, 1.0), repeat=3) if any(way)])
"""The directions (26, 3) to the sides, edges and corners of a cube."""


def thinned_solid(solid: Solid) -> Solid:
    """A part whose convex bodies of more than ENOUGH corners are thinned; itself if it has none.
    Its surface as drawn, its mass and its box are the same."""
    if all(len(piece) <= ENOUGH for piece in (solid.corners, *solid.pieces)):
        return solid
    pieces = tuple(thinned(piece) for piece in solid.pieces)
    corners = pieces[0] if solid.pieces[0] is solid.corners else thinned(solid.corners)
    return replace(solid, corners=corners, pieces=pieces)


def thinned(points: Array, within: float = WITHIN) -> Array:
    """Some of the corners (n, 3) of a convex body, beyond whose hull no other is by more than a
    distance [m]; the same corners if they are no more than ENOUGH, or coplanar. Corners that
    reach furthest beyond a face are added until none does."""
    from scipy.spatial import ConvexHull, QhullError

    if len(points) <= ENOUGH:
        return points
    extent = np.ptp(points, axis=0)
    chosen = np.unique((points @ SIDES.T).argmax(axis=0))
    while True:
        try:
            hull = ConvexHull(points[chosen] / extent)
        except QhullError:
            return points
        normals, offsets = hull.equations[:, :3] / extent, hull.equations[:, 3]
        beyond = points @ normals.T + offsets
        beyond /= np.linalg.norm(normals, axis=1)
        more = np.union1d(chosen, beyond.argmax(axis=0)[beyond.max(axis=0) > within])
        if len(more) == len(chosen):
            return np.asarray(points[chosen])
        chosen = more
