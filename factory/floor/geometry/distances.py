"""Distances of points from triangles."""

from __future__ import annotations

import numpy as np

from factory.support.arrays import Array

MANY = 1 << 14
"""The most distances between points and triangles that are computed for each pair."""

ROUNDING = 1e-9
"""Distances that differ by no more may be equal [m]."""


def distances_to(points: Array, triangles: Array) -> Array:
    """The distance (n,) [m] of each point from the nearest of triangles (m, 3, 3); infinite if
    there are none."""
    if not len(triangles):
        return np.full(len(points), np.inf)
    middles = triangles.mean(axis=1)
    balls = np.linalg.norm(triangles - middles[:, None], axis=2).max(axis=1)
    return _to_nearest(points, triangles, middles, balls)


def _to_nearest(points: Array, triangles: Array, middles: Array, balls: Array) -> Array:
    """The same for triangles in balls of known radii (m,) about their `middles` (m, 3). Of many
    pairs the points are divided in halves, and those triangles are looked at that may be the
    nearest of any."""
    if len(points) * len(triangles) <= MANY or len(points) == 1:
        return _to_triangles(points, triangles, middles, balls)
    low, high = points.min(axis=0), points.max(axis=0)
    apart, across = np.linalg.norm(middles - (low + high) / 2, axis=1), np.linalg.norm(high - low)
    near = apart - balls <= apart.min() + across + ROUNDING
    order = np.argsort(points[:, (high - low).argmax()], kind="stable")
    distances = np.empty(len(points))
    for half in np.array_split(order, 2):
        distances[half] = _to_nearest(points[half], triangles[near], middles[near], balls[near])
    return distances


def _to_triangles(points: Array, triangles: Array, middles: Array, balls: Array) -> Array:
    """The same. Candidates are the triangles whose bounding balls are as near as the nearest
    middle."""
    squared = (points**2).sum(axis=1)[:, None] + (middles**2).sum(axis=1)
    apart = np.sqrt(np.maximum(squared - 2 * points @ middles.T, 0.0))
    row, column = np.nonzero(apart - balls <= apart.min(axis=1)[:, None] + ROUNDING)
    distances = np.full(len(points), np.inf)
    np.minimum.at(distances, row, _to_each(points[row], triangles[column]))
    return distances


def _to_each(points: Array, triangles: Array) -> Array:
    """The distance (n,) of each point from its own triangle (n, 3, 3)."""
    edges = np.roll(triangles, -1, axis=1) - triangles
    normals = np.cross(edges[:, 0], -edges[:, 2])
    area = np.einsum("ij,ij->i", normals, normals)
    inside, squared = area > 0, np.full(len(points), np.inf)
    height = np.einsum("ij,ij->i", points - triangles[:, 0], normals) ** 2
    for corner in range(3):
        off, edge = points - triangles[:, corner], edges[:, corner]
        length = np.maximum(np.einsum("ij,ij->i", edge, edge), 1e-300)
        share = np.clip(np.einsum("ij,ij->i", off, edge) / length, 0.0, 1.0)
        beside = off - share[:, None] * edge
        squared = np.minimum(squared, np.einsum("ij,ij->i", beside, beside))
        inside &= np.einsum("ij,ij->i", off, np.cross(normals, edge)) >= 0
    return np.asarray(np.sqrt(np.where(inside, height / np.where(area > 0, area, 1.0), squared)))
