"""The convex bodies that a part is made of, as the engine collides them.

A box has its eight corners. A cylinder and a sphere have a polytope *around* them, so that what is
clear of the polytope is clear of the body; it reaches at most ROUND [m] too far, or, where that
would take too many corners, 0.0075 % of the radius of a cylinder and 0.46 % of that of a sphere. A
mesh has its convex hull, unless it is found to be made of several bodies: see `closed_bodies` here
and `factory.geometry.decomposition`.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from itertools import combinations

import numpy as np

from factory.geometry.meshes import Array, Indices, hull_of
from factory.geometry.touching import as_they_come, bodies, connected

ROUND = 5e-6
"""How far the polytope round a round body may reach outside it [m]."""

SIDES = (16, 256)
"""Fewest and most sides of the prism round a cylinder."""

FREQUENCIES = (4, 6, 8)
"""Into how many parts the edges of an icosahedron are divided for a sphere."""

MOST_PIECES = 512
"""A mesh of more bodies has its hull."""

FLATNESS = 1e-4
"""A body whose volume is less than that of its hull by no more than this share of it is convex."""


def box_piece(half: Array) -> Array:
    """The corners (8, 3) of a box about the origin."""
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    return np.asarray(signs * half)


def cylinder_piece(radius: float, half: float) -> Array:
    """The corners (2 n, 3) of a prism round an upright cylinder about the origin; the middles of
    its sides touch it."""
    least, most = SIDES
    needed = np.pi / np.arccos(radius / (radius + ROUND))
    sides = int(np.clip(8 * np.ceil(needed / 8), least, most))
    angles = 2 * np.pi * np.arange(sides) / sides
    rim = np.column_stack([np.cos(angles), np.sin(angles)]) * radius / np.cos(np.pi / sides)
    ends = np.repeat([-half, half], sides)
    return np.column_stack([np.concatenate([rim, rim]), ends])


def sphere_piece(radius: float) -> Array:
    """The corners (n, 3) of a polytope round a sphere about the origin; its faces do not cut it."""
    for frequency in FREQUENCIES:
        corners, error = _ball(frequency)
        if error * radius <= ROUND:
            break
    return np.asarray(corners * radius)


@lru_cache
def _ball(frequency: int) -> tuple[Array, float]:
    """A polytope round the unit sphere, and how far it reaches outside: an icosahedron whose faces
    are divided and blown up."""
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


def components(count: int, faces: Indices) -> Indices:
    """The number of the connected part that each face (m, 3) of `count` vertices is of, in the
    order of their first triangle: triangles that use a vertex in common are connected."""
    pairs = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]]])
    return as_they_come(connected(pairs, count)[faces[:, 0]])


def _split(vertices: Array, faces: Indices, number: Indices) -> list[tuple[Array, Indices]]:
    """The parts that the faces of a mesh are numbered by, as vertices (n, 3) and faces (m, 3)
    each."""
    order, ends = np.argsort(number, kind="stable"), np.cumsum(np.bincount(number))
    found = []
    for mine in np.split(faces[order], ends[:-1]):
        used, inverse = np.unique(mine, return_inverse=True)
        found.append((vertices[used], inverse.reshape(-1, 3)))
    return found


def joined(bodies: Sequence[tuple[Array, Indices]]) -> tuple[Array, Indices]:
    """Bodies as one mesh, that share no vertex."""
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in bodies)])
    faces = [faces + start for (_, faces), start in zip(bodies, starts, strict=False)]
    return np.concatenate([vertices for vertices, _ in bodies]), np.concatenate(faces)


def closed_bodies(vertices: Array, faces: Indices) -> list[tuple[Array, Indices]]:
    """The bodies of a closed mesh, told apart where they touch; none where they are more than
    MOST_PIECES."""
    number = bodies(vertices, faces)
    return _split(vertices, faces, number) if number.max(initial=0) < MOST_PIECES else []


def is_convex(vertices: Array, faces: Indices) -> bool:
    """Whether a mesh bounds a convex body, its triangles turned outwards."""
    import trimesh

    body = trimesh.Trimesh(vertices, faces, process=False)
    if not (body.is_watertight and body.is_winding_consistent and body.volume > 0):
        return False
    return bool(body.volume >= (1 - FLATNESS) * hull_of(vertices).volume)
