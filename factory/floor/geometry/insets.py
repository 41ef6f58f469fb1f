"""Insets of convex bodies: the points that are farther than a depth from each face.

Every width of the inset is smaller by at least twice the depth. So two bodies that penetrate each
other by D do not touch if the faces of both recede by D / 2.
"""

from __future__ import annotations

import numpy as np

from factory.floor.geometry.solids import Solid
from factory.support.arrays import Array


def inset(vertices: Array, depth: float) -> Array:
    """The corners (n, 3) of the inset of a convex body, given by its vertices; `depth` [m] is less
    than the radius of the largest ball inside it."""
    from scipy.spatial import HalfspaceIntersection

    normals, bounds = _faces(vertices)
    centre, _ = _largest_ball(normals, bounds)
    receded = np.column_stack([normals, depth - bounds])
    return np.asarray(np.unique(HalfspaceIntersection(receded, centre).intersections, axis=0))


def breadth(solid: Solid, number: int) -> float:
    """The radius [m] of the largest ball inside a convex body of a part."""
    if solid.mesh is None:
        return min(solid.size)
    return _largest_ball(*_faces(solid.pieces[number]))[1]


def _faces(vertices: Array) -> tuple[Array, Array]:
    """The outward normals (k, 3) of the hull of vertices, and its support along them."""
    from scipy.spatial import ConvexHull

    planes = np.unique(ConvexHull(vertices).equations, axis=0)
    return planes[:, :3], -planes[:, 3]


def _largest_ball(normals: Array, bounds: Array) -> tuple[Array, float]:
    """Centre (3,) and radius of the largest ball [m] inside the half-spaces n·x <= b."""
    from scipy.optimize import linprog

    sides = np.column_stack([normals, np.ones(len(normals))])
    solution = linprog([0, 0, 0, -1], sides, bounds, bounds=[(None, None)] * 3 + [(0, None)])
    return solution.x[:3], float(solution.x[3])
