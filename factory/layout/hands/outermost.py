"""How far out convex bodies reach within round pads, exactly.

Lines through a pad miss the crests and corners between them. Within a disc a body is highest on one
of its edges, where that is inside the disc, or where the face that rises least comes to the rim.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from factory.geometry.meshes import Array
from factory.layout.hands.surfaces import FLAT, Body

SAME = 1e-6
"""What reaches no further out by this is not looked at [m]."""


def outermost(
    bodies: Sequence[Body],
    points: Array,
    radius: Array | float,
    side: tuple[int, int],
    known: Array,
) -> Array:
    """How far bodies reach on a side, an axis and a way along it, within discs of some radii (n,)
    across it about points (n, 3), at least as far as is `known` (n,) [m]."""
    (axis, way), found = side, known.copy()
    one, other = (a for a in range(3) if a != axis)
    x, y = points[:, one], points[:, other]
    radii = np.broadcast_to(radius, x.shape)
    for body in bodies:
        out, low, high = way * (body.high if way > 0 else body.low)[axis], body.low, body.high
        beside = np.hypot(
            np.maximum(np.maximum(low[one] - x, x - high[one]), 0.0),
            np.maximum(np.maximum(low[other] - y, y - high[other]), 0.0),
        )
        near = np.flatnonzero((beside < radii) & (found < out - SAME))
        if len(near):
            reached = out if body.boxed else _within(body, points[near], radii[near], side)
            found[near] = np.maximum(found[near], reached)
    return found


def _within(body: Body, points: Array, radius: Array, side: tuple[int, int]) -> Array:
    """How far out one body reaches within discs about points (n, 3); -inf for nowhere."""
    axis, way = side
    across = [a for a in range(3) if a != axis]
    at = points[:, across]
    on_edges = _on_edges(body.edges[:, :, across], way * body.edges[:, :, axis], at, radius)
    normals, reach = body.faces
    facing = way * normals[:, axis] > FLAT
    if not facing.any():
        return on_edges
    up, slopes = np.abs(normals[facing, axis]), normals[facing][:, across]
    steep = np.hypot(*slopes.T)
    rises = (reach[facing] - at @ slopes.T + radius[:, None] * steep) / up
    # the body is below all its faces, so it rises no higher than the one that rises least
    least = rises.argmin(axis=1)
    rim = np.zeros((len(at), 3))
    rim[:, across] = at - radius[:, None] * (slopes / np.maximum(steep, FLAT)[:, None])[least]
    first, last = body.crossed(rim, axis)
    out = np.where(first <= last, last if way > 0 else -first, -np.inf)
    return np.asarray(np.maximum(on_edges, out))


def _on_edges(ends: Array, out: Array, at: Array, radius: Array) -> Array:
    """How far out edges reach within discs: their `ends` (e, 2, 2) in plan, how far `out` (e, 2)
    they are there."""
    begin, way = ends[:, 0] - at[:, None], ends[:, 1] - ends[:, 0]
    square, middle = (way**2).sum(axis=1), (begin * way).sum(axis=2)
    apart = (begin**2).sum(axis=2) - radius[:, None] ** 2
    upright = square < FLAT**2
    room = middle**2 - square * apart
    half = np.sqrt(np.maximum(room, 0.0))
    square = np.where(upright, 1.0, square)
    low = np.where(upright, 0.0, np.clip((-middle - half) / square, 0.0, 1.0))
    high = np.where(upright, 1.0, np.clip((-middle + half) / square, 0.0, 1.0))
    meets = np.where(upright, apart <= 0, (room > 0) & (low < high))
    rise = out[:, 1] - out[:, 0]
    most = out[:, 0] + np.maximum(low * rise, high * rise)
    return np.asarray(np.where(meets, most, -np.inf).max(axis=1))
