"""The exact extent of convex bodies within round pads.

Lines through a pad miss the crests and corners between them. Within a disc a body is highest on one
of its edges, where that is inside the disc, or where its flattest face meets the rim.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from factory.floor.layout.hands.envelopes import FLAT
from factory.floor.layout.hands.surfaces import Body
from factory.support.arrays import Array, Index

MANY = 1 << 14
"""The most pairs of discs and edges that are looked at each."""

SAME = 1e-6
"""What reaches no further out by this is not looked at [m]."""


def outermost(
    bodies: Sequence[Body],
    points: Array,
    radius: Array | float,
    side: tuple[int, int],
    at_least: Array,
) -> Array:
    """How far bodies reach on a side, an axis and a way along it, within discs of some radii (n,)
    across it about points (n, 3), at least as far as is `at_least` (n,) [m]."""
    reach, (one, other) = at_least.copy(), (a for a in range(3) if a != side[0])
    x, y = points[:, one], points[:, other]
    radii, least = np.broadcast_to(radius, x.shape), float(reach.min(initial=np.inf))
    for body in bodies:
        out, low, high = body.out(side), body.low, body.high
        if out - SAME <= least:
            continue
        beside = np.hypot(
            np.maximum(np.maximum(low[one] - x, x - high[one]), 0.0),
            np.maximum(np.maximum(low[other] - y, y - high[other]), 0.0),
        )
        near = np.flatnonzero((beside < radii) & (reach < out - SAME))
        if len(near):
            reached = (
                out if body.boxed else _within(body, points[near], radii[near], side, reach[near])
            )
            reach[near] = np.maximum(reach[near], reached)
    return reach


def _within(body: Body, points: Array, radius: Array, side: tuple[int, int], least: Array) -> Array:
    """How far out one body reaches within discs about points (n, 3), or less where that is no
    further than is `least` (n,); -inf for nowhere."""
    axis, way = side
    if body.ball:
        half = body.dome(points, axis, radius)
        return np.where(half < 0, -np.inf, way * (body.low + body.high)[axis] / 2 + half)
    across = [a for a in range(3) if a != axis]
    at = points[:, across]
    every = np.arange(len(body.edges))
    on_edges = _highest_edge(body, every, at, radius, side, least)
    faces = body.facing[axis][1 if way < 0 else 2]
    if not len(faces):
        return on_edges
    # the body is below all its faces, so it rises no higher than the one that rises least
    lowest = faces.nearest(at, radius)
    slopes, steep = faces.across.T[lowest], faces.steep[lowest]
    rim = np.zeros((len(at), 3))
    rim[:, across] = at - radius[:, None] * (slopes / np.maximum(steep, FLAT)[:, None])
    first, last = body.crossed(rim, axis)
    out = np.where(first <= last, last if way > 0 else -first, -np.inf)
    return np.asarray(np.maximum(on_edges, out))


def _highest_edge(
    body: Body, edges: Index, at: Array, radius: Array, side: tuple[int, int], least: Array
) -> Array:
    """How far out some edges of a body reach within discs about points (n, 2), or less where that
    is no further than is `least` (n,). Of many discs and edges the discs are divided in halves,
    and of edges those are looked at that are near, and reach further."""
    (axis, way), (low, high) = side, body.edge_boxes
    across = [a for a in range(3) if a != axis]
    begin, end = at.min(axis=0) - radius.max() - FLAT, at.max(axis=0) + radius.max() + FLAT
    near = (high[axis, edges] if way > 0 else -low[axis, edges]) > least.min()
    for line, first, last in zip(across, begin, end, strict=True):
        near &= (high[line, edges] >= first) & (low[line, edges] <= last)
    edges = edges[near]
    if len(at) * len(edges) <= MANY or len(at) == 1:
        ends = body.edges[edges]
        return _on_edges(ends[:, :, across], way * ends[:, :, axis], at, radius)
    measures = np.column_stack([at, 2 * radius, least])
    order = np.argsort(measures[:, np.ptp(measures, axis=0).argmax()], kind="stable")
    reach = np.empty(len(at))
    for half in np.array_split(order, 2):
        reach[half] = _highest_edge(body, edges, at[half], radius[half], side, least[half])
    return reach


def _on_edges(ends: Array, out: Array, at: Array, radius: Array) -> Array:
    """How far out edges reach within discs: their `ends` (e, 2, 2) in plan, how far `out` (e, 2)
    they are there."""
    (x, y), (along, across) = ends[:, 0].T[:, None] - at.T[..., None], (ends[:, 1] - ends[:, 0]).T
    square, middle = along**2 + across**2, x * along + y * across
    apart = x**2 + y**2 - radius[:, None] ** 2
    upright, room = square < FLAT**2, middle**2 - square * apart
    disc, edge = np.nonzero(np.where(upright, apart <= 0, room > 0))
    half, middle = np.sqrt(np.maximum(room[disc, edge], 0.0)), middle[disc, edge]
    square, upright = np.where(upright, 1.0, square)[edge], upright[edge]
    low = np.where(upright, 0.0, np.clip((-middle - half) / square, 0.0, 1.0))
    high = np.where(upright, 1.0, np.clip((-middle + half) / square, 0.0, 1.0))
    begin, rise = out[edge, 0], (out[:, 1] - out[:, 0])[edge]
    most = begin + np.maximum(low * rise, high * rise)
    reach = np.full(len(at), -np.inf)
    np.maximum.at(reach, disc, np.where(low < high, most, -np.inf))
    return reach
