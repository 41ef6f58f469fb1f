"""Closing the seams of a mesh."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from factory.support.arrays import Array, Indices
from factory.support.meshes.mending import SLIVERS
from factory.support.meshes.triangles import areas_of


def zipped(vertices: Array, faces: Indices) -> Indices:
    """The faces of a mesh that is made of the faces of a solid, with triangles in the cracks along
    edges that two of these divide into different segments; the mesh as it is where it has none, or
    holes that are no cracks."""
    added = [_zip(vertices, rim) for rim in _rims(faces)]
    if added and areas_of(vertices, np.concatenate(added)).sum() <= SLIVERS * (
        areas_of(vertices, faces).sum()
    ):
        return np.concatenate([faces, *added])
    return faces


def _rims(faces: Indices) -> list[list[int]]:
    """The holes of a mesh: the shortest cycles of its open edges, each edge in one, in the
    orientation of the triangles that close them."""
    edges = np.concatenate([faces[:, [1, 0]], faces[:, [2, 1]], faces[:, [0, 2]]])
    low, high = edges.min(axis=1), edges.max(axis=1)
    key = low * (faces.max(initial=0) + 1) + high
    _, first, count = np.unique(key, return_index=True, return_counts=True)
    if not (count == 1).any():
        return []
    import networkx as nx

    border = nx.Graph(edges[first[count == 1]].tolist())
    rims: list[list[int]] = []
    for start, end in edges[first[count == 1]].tolist():
        if border.has_edge(start, end):
            border.remove_edge(start, end)
            if nx.has_path(border, end, start):
                rims.append(nx.shortest_path(border, end, start))
                border.remove_edges_from(pairwise(rims[-1]))
    return rims


def _zip(vertices: Array, rim: list[int]) -> Indices:
    """The triangles (m, 3) that close a hole. Each cuts off the corner whose neighbours are nearest
    to each other, so that a crack is closed from its ends."""
    corners, triangles = list(rim), []
    while len(corners) > 2:
        before, after = np.roll(corners, 1), np.roll(corners, -1)
        cut = int(np.linalg.norm(vertices[before] - vertices[after], axis=1).argmin())
        triangles.append((before[cut], corners.pop(cut), after[cut]))
    return np.array(triangles)
