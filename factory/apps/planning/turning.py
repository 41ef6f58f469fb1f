"""Rotations of a product that bring the directions in which its parts can leave along axes.

A robot joins along an axis of the floor. A part that comes along another direction of its file,
such as the tail of a dovetail at 45°, comes along an axis once the whole product is turned. The
candidate directions follow from contacts: parts that touch with faces of two normals can slide only
across both, and parts that touch with one face separate along its normal.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace

import numpy as np

from factory.api import product_geometry
from factory.apps.planning.parts import InPlace, PlacedPart
from factory.apps.planning.source import surface
from factory.apps.planning.writing import planned_product
from factory.support.arrays import Array
from factory.support.meshes.triangles import normals_of

NEAR = 1e-3
"""Faces inside the box of another part, enlarged by this [m], may touch that part."""

NORMALS, WAYS, MOST = 40, 64, 8
"""The most normals (of the largest faces), directions, and rotations that are tried, the likeliest
first."""

SAME = 1e-3
"""Directions that differ by no more than this are equal."""

EXACT = 1e-7
"""The tolerance for a direction along an axis, or perpendicular to another."""


def turned(source: InPlace, turn: Array) -> InPlace:
    """A source whose product is turned by a rotation (3, 3) about the origin."""
    made = planned_product(source, tuple(label for label, _ in source.units()), turn)
    solids = product_geometry(made.pag, source.files).solids
    parts = tuple(
        replace(part, vertices=surface(solids[part.label])[0], solid=solids[part.label], node=node)
        for part in source.parts
        for node in [made.pag[part.label]]
    )
    return replace(source, parts=parts)


def only(source: InPlace, units: Collection[str]) -> InPlace:
    """A source with only some of its units."""
    kept = tuple(keep for keep in source.kept if keep.label in units)
    inside = {p.label for name, parts in source.units() if name in units for p in parts}
    parts = tuple(part for part in source.parts if part.label in inside)
    return replace(source, parts=parts, kept=kept)


def turns(source: InPlace, up: Array, tilted: bool) -> Iterator[tuple[Array, Array]]:
    """Rotations (3, 3) of a product, the likeliest first, that bring a direction (3,) in which its
    parts may leave along an axis, each with that direction: rotations about the direction `up`
    (3,), or `tilted` ones."""
    ways = directions(source.parts)
    seen = [np.eye(3)]
    for way in ways:
        along = np.abs(way).max() > 1 - EXACT
        if not tilted and (along or abs(way @ up) > EXACT):
            continue
        across = [up] if not tilted else [other for other in ways if abs(other @ way) < EXACT]
        for other in across[:2]:
            turn = _onto_axes(way, other, up)
            same = (np.abs(turn @ before.T).max(axis=1) > 1 - SAME**2 for before in seen)
            if not any(axes.all() for axes in same):  # in any order
                seen.append(turn)
                yield turn, way
        if len(seen) >= MOST:
            return


def _onto_axes(way: Array, other: Array, up: Array) -> Array:
    """The rotation that brings two perpendicular directions along axes, the more vertical one along
    the axis that is nearest to `up`."""
    if abs(other @ up) < abs(way @ up):
        way, other = other, way
    rows = np.array([np.cross(way, other), way, other])
    axis = int(np.abs(up).argmax())
    rows = np.roll(rows, axis - 2, axis=0)
    upright = rows[axis]
    if (upright @ up) * up[axis] < 0:
        rows[axis], rows[axis - 1] = -upright, -rows[axis - 1]
    return rows


def directions(parts: Sequence[PlacedPart]) -> list[Array]:
    """Unit vectors (3,) in which parts may leave others, the likeliest first: perpendicular to two
    of the contact normals, or along one of them."""
    normals, areas = _normals(parts)
    share = areas / areas.sum()
    crossed = np.cross(normals[:, None], normals[None]).reshape(-1, 3)
    lengths = np.linalg.norm(crossed, axis=1)
    weights = np.outer(share, share).ravel()
    sharp = lengths > 0.1
    ways = np.concatenate([crossed[sharp] / lengths[sharp, None], normals])
    merged, votes = _merged(ways, np.concatenate([weights[sharp], share**2]))
    return list(merged[np.argsort(-votes, kind="stable")][:WAYS])


def _normals(parts: Sequence[PlacedPart]) -> tuple[Array, Array]:
    """The normals (n, 3) of the largest faces near another part, opposite ones merged, and their
    areas (n,)."""
    normals, sizes = [], []
    for part in parts:
        corners = part.vertices[part.faces]
        normal = normals_of(part.vertices, part.faces)
        area = np.linalg.norm(normal, axis=1)
        low, high = corners.min(axis=1) - NEAR, corners.max(axis=1) + NEAR
        near = np.zeros(len(corners), bool)
        for other in parts:
            if other is not part:
                near |= (low <= other.solid.high).all(axis=1) & (high >= other.solid.low).all(
                    axis=1
                )
        near &= area > 0
        normals.append(normal[near] / area[near, None])
        sizes.append(area[near])
    merged, areas = _merged(np.concatenate(normals), np.concatenate(sizes))
    largest = np.argsort(-areas, kind="stable")[:NORMALS]
    return merged[largest], areas[largest]


def _merged(ways: Array, weights: Array) -> tuple[Array, Array]:
    """Unit vectors (n, 3) with equal and opposite ones merged into the one of largest weight, and
    the sums of their weights."""
    first = np.abs(ways) > SAME
    sign = np.sign(np.take_along_axis(ways, first.argmax(axis=1)[:, None], axis=1))
    ways = ways * sign
    order = np.argsort(-weights, kind="stable")
    key = np.round(ways[order] / SAME).astype(np.int64)
    _, chosen, group = np.unique(key, axis=0, return_index=True, return_inverse=True)
    return ways[order][chosen], np.bincount(group.ravel(), weights[order]).astype(float)
