"""Convex bodies whose faces recede: what is left of a body without all that is nearer than a depth
to one of its faces.

Every width of what is left is smaller by twice the depth or more, so two bodies that get by D into
each other do so no more when their faces recede by D / 2 each.
"""

from __future__ import annotations

import numpy as np

from factory.geometry.meshes import Array
from factory.geometry.solids import Solid


def inset(vertices: Array, depth: float) -> Array:
    """The corners (n, 3) of a convex body, given by its vertices, whose faces have receded by
    `depth` [m], which is less than the radius of the largest ball in it."""
    from scipy.spatial import HalfspaceIntersection

    normals, bounds = _faces(vertices)
    centre, _ = _largest_ball(normals, bounds)
    receded = np.column_stack([normals, depth - bounds])
    return np.asarray(np.unique(HalfspaceIntersection(receded, centre).intersections, axis=0))


def breadth(solid: Solid, number: int) -> float:
    """The radius [m] of the largest ball in a convex body of a part."""
    if solid.mesh is None:
        return min(solid.size)
    return _largest_ball(*_faces(solid.pieces[number]))[1]


def _faces(vertices: Array) -> tuple[Array, Array]:
    """The outward normals (k, 3) of the hull of vertices, and how far it reaches along them."""
    from scipy.spatial import ConvexHull

    found = np.unique(ConvexHull(vertices).equations, axis=0)
    return found[:, :3], -found[:, 3]


def _largest_ball(normals: Array, bounds: Array) -> tuple[Array, float]:
    """Centre (3,) and radius of the largest ball that half-spaces n·x <= b contain [m]."""
    from scipy.optimize import linprog

    sides = np.column_stack([normals, np.ones(len(normals))])
    found = linprog([0, 0, 0, -1], sides, bounds, bounds=[(None, None)] * 3 + [(0, None)])
    return found.x[:3], float(found.x[3])
