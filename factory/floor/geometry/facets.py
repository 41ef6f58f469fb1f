"""The flat facets by which a mesh represents a round surface, and how far they are off.

A *facet* is a plane region of a mesh that meets two neighbours or more at small angles, in edges
that are all convex or all concave. Round surfaces of one size overlap by their facets if these are
turned against each other: by at most the *sagitta*, the height of an arc over its chord. Facets of
width w that are turned by θ against each other have the sagitta w/2 tan(θ/4).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from factory.floor.geometry.overlap import merged
from factory.support.arrays import Array, Indices
from factory.support.meshes.bodies import connected
from factory.support.meshes.triangles import normals_of

LEAST, MOST = np.deg2rad([1.0, 36.5])
"""The angles between two facets of a round surface [rad], which has ten of them at least. Triangles
that meet at less are in one plane; those that meet at more, in an edge or a chamfer."""


def sagitta(body: Any, low: Array, high: Array) -> float:
    """The greatest sagitta [m] of the facets of a body that meet in the box from low to high (3,);
    0 if there are none."""
    vertices, faces = merged(body.to_mesh64())
    edges, beside = _edges(faces)
    normals = normals_of(vertices, faces)
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
    one, other = normals[beside[:, 0]], normals[beside[:, 1]]
    angle = 2 * np.arcsin(np.minimum(np.linalg.norm(one - other, axis=1) / 2, 1.0))
    region = connected(beside[angle < LEAST], len(faces))[beside]
    apart = vertices[faces].mean(axis=1)[beside]
    convex = np.einsum("ij,ij->i", one, apart[:, 1] - apart[:, 0]) < 0
    ends, smooth = vertices[edges], (angle >= LEAST) & (angle <= MOST)
    facets = _facets(region[smooth], convex[smooth])
    near = (ends.min(axis=1) <= high).all(axis=1) & (ends.max(axis=1) >= low).all(axis=1)
    corners, most = _corners(region, edges), 0.0
    for row in np.flatnonzero(smooth & near).tolist():
        along = ends[row, 1] - ends[row, 0]
        widths = [
            float(np.ptp(vertices[corners[place]] @ np.cross(normals[face], along)))
            for place, face in zip(region[row].tolist(), beside[row].tolist(), strict=True)
            if (place, bool(convex[row])) in facets
        ]
        width = min(widths, default=0.0) / float(np.linalg.norm(along))
        most = max(most, width / 2 * float(np.tan(angle[row] / 4)))
    return most


def _edges(faces: Indices) -> tuple[Indices, Indices]:
    """The edges (k, 2) of a closed mesh at which two triangles meet, and these triangles (k, 2)."""
    ends = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    order = np.lexsort(ends.T)
    same = (ends[order[:-1]] == ends[order[1:]]).all(axis=1)
    first = np.flatnonzero(same)
    return ends[order[first]], np.column_stack([order[first], order[first + 1]]) // 3


def _facets(region: Indices, convex: Array) -> set[tuple[int, bool]]:
    """The regions that meet two others or more in convex edges (True), or in concave ones, given
    the regions (k, 2) on both sides of edges."""
    both = np.concatenate([region, region[:, ::-1]])
    sides = np.unique(np.column_stack([both[:, 0], np.tile(convex, 2), both[:, 1]]), axis=0)
    places, count = np.unique(sides[:, :2], axis=0, return_counts=True)
    return {(place, bool(way)) for place, way in places[count > 1].tolist()}


def _corners(region: Indices, edges: Indices) -> dict[int, Indices]:
    """The vertices of each region, given the regions (k, 2) on both sides of edges (k, 2)."""
    place, corner = np.repeat(region.ravel(), 2), np.repeat(edges, 2, axis=0).ravel()
    order = np.argsort(place, kind="stable")
    places, starts = np.unique(place[order], return_index=True)
    return dict(zip(places.tolist(), np.split(corner[order], starts[1:]), strict=True))
