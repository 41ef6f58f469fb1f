"""The bodies of a closed mesh, separated where they touch.

Bodies that share a side have four or more triangles at its edges once their vertices are merged, as
in every STL file. Around such an edge, solid and empty wedges alternate: the two triangles that
bound one solid wedge belong to one body.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from factory.support.arrays import Array, Indices

__all__ = ["bodies", "connected"]

Mask = NDArray[np.bool_]

SAME = 1e-4
"""Triangles round an edge whose angles differ by no more than this coincide [rad]."""


def bodies(vertices: Array, faces: Indices) -> Indices:
    """The number of the body that each triangle (m, 3) of a closed mesh bounds, in the order of
    their first triangles; the triangles are oriented outwards. An edge joins two triangles into one
    body: the two at the edge, or, if there are more, those on both sides of a solid wedge."""
    return as_they_come(connected(_pairs(vertices, faces), len(faces)))


def connected(pairs: Indices, count: int) -> Indices:
    """The number (count,) of the connected component of each of `count` items, given connected
    pairs (n, 2)."""
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import connected_components

    graph = csr_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1])


def as_they_come(labels: Indices) -> Indices:
    """Labels (n,) renumbered from 0, in the order of their first occurrences."""
    _, first, inverse = np.unique(labels, return_index=True, return_inverse=True)
    return np.asarray(np.argsort(np.argsort(first))[inverse])


def _pairs(vertices: Array, faces: Indices) -> Indices:
    """The pairs (n, 2) of triangles that an edge joins."""
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    low, high = np.minimum(start, end), np.maximum(start, end)
    order = np.lexsort((start < end, high, low))
    edge = np.flatnonzero(np.diff(low[order], prepend=-1) | np.diff(high[order], prepend=-1))
    count = np.diff(edge, append=len(order))
    plain = edge[count == 2]
    pairs = [np.column_stack([order[plain], order[plain + 1]]) // 3]
    for first, many in zip(edge[count > 2], count[count > 2], strict=True):
        sides = order[first : first + many]
        pairs.append(_wedges(vertices, faces, sides, start[sides] < end[sides]))
    return np.concatenate(pairs)


def _wedges(vertices: Array, faces: Indices, sides: Indices, ends: Mask) -> Indices:
    """The pairs (n, 2) of triangles that bound the solid wedges round one edge. `sides`: the
    indices of their sides at the edge in the flattened faces. Seen against the edge's direction, a
    wedge goes anticlockwise from a triangle that traverses the edge backwards to one (`ends`) that
    traverses it forwards; where two coincide, one wedge ends before the next begins."""
    triangle, corner = np.divmod(sides, 3)
    a, b = faces[triangle, corner], faces[triangle, (corner + 1) % 3]
    origin, along = vertices[min(a[0], b[0])], vertices[max(a[0], b[0])]
    along = (along - origin) / np.linalg.norm(along - origin)
    across = np.cross(along, np.eye(3)[np.abs(along).argmin()])
    third = vertices[faces[triangle, (corner + 2) % 3]] - origin
    angle = np.arctan2(third @ np.cross(along, across), third @ across)
    turn = np.argsort(angle)
    # Angles as steps, so that those of triangles that lie on each other are the same number.
    gaps = np.append(np.diff(angle[turn]), angle[turn[0]] + 2 * np.pi - angle[turn[-1]])
    widest = int(gaps.argmax())
    turn, gaps = np.roll(turn, -1 - widest), np.roll(gaps, -1 - widest)
    step = np.cumsum(np.append(0, gaps[:-1] > SAME))
    turn = turn[np.lexsort((~ends[turn], step))]
    open_wedges = np.cumsum(np.where(ends[turn], -1, 1))
    turn = np.roll(turn, -1 - int(open_wedges.argmin()))
    begun, ended = turn[~ends[turn]], turn[ends[turn]]
    return np.column_stack([triangle[begun], triangle[ended]])
