"""Triangle meshes as arrays: vertices (n, 3), and the three of them that each face (m, 3) joins."""

from __future__ import annotations

import struct
from collections.abc import Sequence

import numpy as np

from factory.support.arrays import Array, Indices
from factory.support.meshes.bodies import as_they_come, connected

__all__ = [
    "areas_of",
    "components",
    "convex_hull",
    "corner_normals",
    "is_closed",
    "joined",
    "moved_by",
    "normals_of",
    "stl",
    "submeshes",
    "volume_of",
]

CREASE = 31.0
"""Triangles that meet at a smaller angle are shaded as one rounded surface [degrees]."""


def normals_of(vertices: Array, faces: Indices) -> Array:
    """The normals (m, 3) of triangles, each twice as long as the area of its triangle."""
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    return np.asarray(np.cross(b - a, c - a))


def areas_of(vertices: Array, faces: Indices) -> Array:
    """The area of each triangle (m,)."""
    return np.asarray(np.linalg.norm(normals_of(vertices, faces), axis=1) / 2)


def volume_of(vertices: Array, faces: Indices) -> float:
    """The volume of a closed mesh; negative if it is inside out."""
    a, b, c = (vertices[faces[:, corner]] - vertices.mean(axis=0) for corner in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6


def is_closed(faces: Indices) -> bool:
    """Whether triangles (m, 3) form a closed surface: every edge occurs equally often in both
    directions. This also holds for bodies that share faces, edges or corners."""
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    edge = np.minimum(start, end) * (faces.max(initial=0) + 1) + np.maximum(start, end)
    forth, back = (np.sort(edge[way]) for way in (start < end, start >= end))
    return bool(np.array_equal(forth, back))


def convex_hull(points: Array) -> tuple[Array, Indices]:
    """The convex hull of points (n, 3) as a mesh, its triangles turned outwards."""
    import trimesh

    hull = trimesh.convex.convex_hull(points)
    return np.asarray(hull.vertices), np.asarray(hull.faces)


def components(count: int, faces: Indices) -> Indices:
    """The number of the connected component of each face (m, 3) of `count` vertices, in the order
    of their first triangles. Triangles that share a vertex are connected."""
    pairs = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]]])
    return as_they_come(connected(pairs, count)[faces[:, 0]])


def submeshes(vertices: Array, faces: Indices, number: Indices) -> list[tuple[Array, Indices]]:
    """The submeshes by which the faces of a mesh are numbered, as vertices (n, 3) and faces (m, 3)
    each."""
    order, ends = np.argsort(number, kind="stable"), np.cumsum(np.bincount(number))
    meshes = []
    for mine in np.split(faces[order], ends[:-1]):
        used, inverse = np.unique(mine, return_inverse=True)
        meshes.append((vertices[used], inverse.reshape(-1, 3)))
    return meshes


def joined(bodies: Sequence[tuple[Array, Indices]]) -> tuple[Array, Indices]:
    """Bodies as one mesh, without common vertices."""
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in bodies)])
    faces = [faces + start for (_, faces), start in zip(bodies, starts, strict=False)]
    return np.concatenate([vertices for vertices, _ in bodies]), np.concatenate(faces)


def moved_by(matrix: Array, vertices: Array, faces: Indices) -> tuple[Array, Indices]:
    """Triangles after an affine map (4, 4), still oriented outwards if it mirrors them."""
    flips = bool(np.linalg.det(matrix[:3, :3]) < 0)
    return vertices @ matrix[:3, :3].T + matrix[:3, 3], faces[:, ::-1] if flips else faces


def stl(vertices: Array, faces: Indices) -> bytes:
    """A mesh as a binary STL file."""
    corners: Array = vertices[faces]
    normal = face_normals(vertices, faces)
    record = np.zeros(
        len(corners), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("kind", "<u2")]
    )
    record["normal"], record["corners"] = normal, corners
    return b"\0" * 80 + struct.pack("<I", len(corners)) + record.tobytes()


def face_normals(vertices: Array, faces: Indices) -> Array:
    """Unit normals of the triangles (m, 3); zero where a triangle has no area."""
    normal = normals_of(vertices, faces)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    return np.asarray(np.divide(normal, length, out=np.zeros_like(normal), where=length > 0))


def corner_normals(vertices: Array, faces: Indices) -> Array:
    """The normal at each corner of each triangle (m, 3, 3): the mean over the triangles at that
    vertex that meet it at less than CREASE, whichever way round they are wound."""
    from scipy.sparse import csr_matrix

    normal, count = face_normals(vertices, faces), len(faces)
    area = np.linalg.norm(normals_of(vertices, faces), axis=1)
    at = csr_matrix(
        (np.ones(3 * count), (np.arange(3 * count), faces.ravel())),
        shape=(3 * count, len(vertices)),
    )
    here, there = (at @ at.T).nonzero()
    agree = np.einsum("ij,ij->i", normal[here // 3], normal[there // 3])
    near = np.abs(agree) > np.cos(np.radians(CREASE))
    here, there, agree = here[near], there[near], agree[near]
    weight = np.sign(agree) * area[there // 3]
    total = np.stack(
        [np.bincount(here, weight * normal[there // 3, k], 3 * count) for k in range(3)], axis=1
    )
    length = np.linalg.norm(total, axis=1, keepdims=True)
    at_corner = np.repeat(normal, 3, axis=0)
    at_corner[np.linalg.norm(at_corner, axis=1) == 0] = (0.0, 0.0, 1.0)
    return np.asarray(np.where(length > 0, total / np.maximum(length, 1e-300), at_corner)).reshape(
        -1, 3, 3
    )
