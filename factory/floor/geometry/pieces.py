"""The convex bodies that represent a part in collisions.

A box has its eight corners. A cylinder and a sphere have a *circumscribed* polytope: what is clear
of the polytope is clear of the body. It protrudes by at most ROUND [m] or, if that would take too
many corners, by 0.0075 % of the radius of a cylinder and 0.46 % of that of a sphere. A mesh has its
convex hull, unless it consists of several bodies: see `closed_bodies` here and
`factory.floor.geometry.decomposition`.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import combinations, product

import numpy as np

from factory.floor.geometry.meshes import hull_of
from factory.support.arrays import Array, Indices
from factory.support.meshes.bodies import bodies
from factory.support.meshes.triangles import submeshes

ROUND = 5e-6
"""The tolerated protrusion of the polytope round a round body [m]."""

CORNERS = np.array([*product((0.0, 1.0), repeat=3)])
"""The corners of a unit box."""

BOX_FACES = np.array(
    [
        *([0, 1, 2], [1, 2, 3], [4, 5, 6], [5, 6, 7], [0, 1, 4], [1, 4, 5]),
        *([2, 3, 6], [3, 6, 7], [0, 2, 4], [2, 4, 6], [1, 3, 5], [3, 5, 7]),
    ]
)
"""The triangles (12, 3) of its faces, by corner. SciPy finds those of any hull; to import it takes
longer than all else that is done before a run of boxes."""

EXACT = 1e-12
"""The rounding of corners [m]."""

SIDES = (16, 256)
"""Fewest and most sides of the prism round a cylinder."""

FREQUENCIES = (4, 6, 8)
"""The number of parts into which the edges of an icosahedron are divided for a sphere."""

MOST_PIECES = 512
"""A mesh of more bodies is represented by its hull."""

FLATNESS = 1e-4
"""A body is convex if its volume is less than that of its hull by no more than this share."""


def box_piece(half: Array) -> Array:
    """The corners (8, 3) of a box about the origin."""
    return np.asarray((2 * CORNERS - 1) * half)


def is_box(points: Array) -> bool:
    """Whether points (n, 3) are the corners of a box of any attitude, or of a sheared one, in the
    order of `box_piece`."""
    if len(points) != len(CORNERS):
        return False
    edges = points[[4, 2, 1]] - points[0]
    off = np.abs(points - points[0] - CORNERS @ edges).max()
    return bool(off < EXACT and abs(np.linalg.det(edges)) > EXACT**2)


def cylinder_piece(radius: float, half: float) -> Array:
    """The corners (2 n, 3) of a prism circumscribed about an upright cylinder at the origin."""
    least, most = SIDES
    needed = np.pi / np.arccos(radius / (radius + ROUND))
    sides = int(np.clip(8 * np.ceil(needed / 8), least, most))
    angles = 2 * np.pi * np.arange(sides) / sides
    rim = np.column_stack([np.cos(angles), np.sin(angles)]) * radius / np.cos(np.pi / sides)
    ends = np.repeat([-half, half], sides)
    return np.column_stack([np.concatenate([rim, rim]), ends])


def sphere_piece(radius: float) -> Array:
    """The corners (n, 3) of a polytope circumscribed about a sphere at the origin."""
    for frequency in FREQUENCIES:
        corners, error = _ball(frequency)
        if error * radius <= ROUND:
            break
    return np.asarray(corners * radius)


@lru_cache
def _ball(frequency: int) -> tuple[Array, float]:
    """A polytope circumscribed about the unit sphere, and its protrusion: an icosahedron with
    divided faces, projected onto the sphere and scaled."""
    golden = (1 + 5**0.5) / 2
    corners = np.array(
        [np.roll((0.0, a, b * golden), k) for k in range(3) for a in (-1, 1) for b in (-1, 1)]
    )
    edge = 2.0 + 1e-9
    faces = [
        (a, b, c)
        for a, b, c in combinations(corners, 3)
        if max(np.linalg.norm(a - b), np.linalg.norm(b - c), np.linalg.norm(c - a)) <= edge
    ]
    points, nearest = [], 1.0
    for a, b, c in faces:
        grid = {
            (i, j): _unit(i * a + j * b + (frequency - i - j) * c)
            for i in range(frequency + 1)
            for j in range(frequency + 1 - i)
        }
        points += list(grid.values())
        for i, j in grid:
            for p, q in (((i + 1, j), (i, j + 1)), ((i - 1, j), (i, j - 1))):
                if p in grid and q in grid:
                    normal = _unit(np.cross(grid[p] - grid[i, j], grid[q] - grid[i, j]))
                    nearest = min(nearest, abs(float(normal @ grid[i, j])))
    unique = np.unique(np.round(points, 12), axis=0)
    return unique / nearest, 1 / nearest - 1


def _unit(vector: Array) -> Array:
    return np.asarray(vector / np.linalg.norm(vector))


def closed_bodies(vertices: Array, faces: Indices) -> list[tuple[Array, Indices]]:
    """The bodies of a closed mesh, separated where they touch; empty if there are more than
    MOST_PIECES."""
    number = bodies(vertices, faces)
    return submeshes(vertices, faces, number) if number.max(initial=0) < MOST_PIECES else []


def is_convex(vertices: Array, faces: Indices) -> bool:
    """Whether a mesh bounds a convex body, with its triangles oriented outwards."""
    import trimesh

    body = trimesh.Trimesh(vertices, faces, process=False)
    if not (body.is_watertight and body.is_winding_consistent and body.volume > 0):
        return False
    return bool(body.volume >= (1 - FLATNESS) * hull_of(vertices).volume)
