"""Exact decomposition of a body of prisms into convex ones: of a plate with holes, a bush, a
stepped housing.

A *body of prisms* has an axis to which each of its faces is parallel or perpendicular. Planes
through the perpendicular ones cut it into slabs of constant cross-section. Each cross-section is
triangulated; triangles are joined across the longest common sides, as long as the result is convex
(Hertel and Mehlhorn, Fast triangulation of simple polygons, 1983).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import islice, pairwise
from typing import Any

import numpy as np

from factory.floor.geometry.overlap import bounded
from factory.floor.geometry.pieces import MOST_PIECES
from factory.support.arrays import Array, Indices
from factory.support.meshes.triangles import normals_of, volume_of

EXACT = 1e-6
"""Two heights, and two volumes, are equal if they differ by no more than this share of the size of
the body; a face is parallel to the axis if the cosine of its normal with it is at most SQUARE."""

SQUARE = 1e-3

AXES = 6
"""The number of directions that are tried: those of the largest faces."""

THIN, FEW = (5e-5, 1e-3), 1e-3
"""Prisms that are thinner than the first [m], and than the second share of the body, and have
others along their sides but for a share of OPEN, are omitted, the thinnest first, up to a share of
FEW of its volume: a thin one has no room to recede in a close fit, and what is beside it is solid.
A thin wall stays."""

OPEN = 0.25

Loop = tuple[int, ...]
"""The corners of a convex polygon by number, anticlockwise."""


def prisms(vertices: Array, faces: Indices) -> tuple[Array, ...]:
    """The corners (n, 3) of convex prisms that a closed mesh consists of; empty if it is no body of
    prisms, or of more than MOST_PIECES."""
    volume, size = volume_of(vertices, faces), float(np.ptp(vertices, axis=0).max())
    for frame in frames(vertices, faces):
        placed = vertices @ frame.T / size
        levels = _levels(placed, faces)
        if len(levels) < 2:
            continue
        stack = [*islice(_stacked(bounded(placed, faces), levels), MOST_PIECES + 1)]
        volumes = np.array([_area(base) * (high - low) for base, low, high in stack]) * size**3
        if len(stack) <= MOST_PIECES and abs(volumes.sum() - volume) <= EXACT * volume:
            thick = np.array([_breadth(base) for base, _, _ in stack]) * size
            order = np.argsort(thick, kind="stable")
            few = np.cumsum(volumes[order]) <= FEW * volume
            slight = (thick < min(THIN[0], THIN[1] * size)) & (_open(stack) < OPEN)
            thin = {*order[few & slight[order]].tolist()}
            kept = (each for number, each in enumerate(stack) if number not in thin)
            return tuple(prism(*each) @ frame * size for each in kept)
    return ()


def frames(vertices: Array, faces: Indices) -> Iterator[Array]:
    """Frames (3, 3), axes as rows, the last of which is normal to one of the largest faces."""
    normals = normals_of(vertices, faces)
    areas = np.linalg.norm(normals, axis=1)
    ways = normals / np.maximum(areas, 1e-300)[:, None]
    ways *= np.where(ways @ np.array([1.0, 1.1, 1.21]) < 0, -1.0, 1.0)[:, None]
    _, group = np.unique(np.round(ways, 3), axis=0, return_inverse=True)
    total = np.bincount(group.ravel(), areas)
    for number in np.argsort(-total, kind="stable")[:AXES].tolist():
        mine = group.ravel() == number
        axis = areas[mine] @ ways[mine]
        axis /= np.linalg.norm(axis)
        if np.abs(axis).max() > 1 - EXACT:
            axis = np.round(axis)
        across = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
        across /= np.linalg.norm(across)
        yield np.array([across, np.cross(axis, across), axis])


def _levels(vertices: Array, faces: Indices) -> list[float]:
    """The heights of the faces of a body of prisms of size 1 whose axis is z; empty if it is
    none."""
    heights = vertices[faces][:, :, 2]
    normals = normals_of(vertices, faces)
    upright = np.abs(normals[:, 2]) <= SQUARE * np.linalg.norm(normals, axis=1)
    if not (upright | (np.ptp(heights, axis=1) <= EXACT)).all():
        return []
    return distinct(heights, EXACT)


def distinct(heights: Array, apart: float) -> list[float]:
    """Heights in ascending order; those that are nearer than a distance to the next are one, their
    mean."""
    each = np.sort(heights, axis=None)
    groups = np.split(each, np.flatnonzero(np.diff(each) > apart) + 1)
    return [float(group.mean()) for group in groups]


def _stacked(body: Any, levels: Sequence[float]) -> Iterator[tuple[Array, float, float]]:
    """The prisms of a body: base (n, 2), lower and upper end. Slabs of one cross-section are
    joined."""
    low, section = levels[0], None
    for start, end in pairwise(levels):
        here = body.slice((start + end) / 2)
        if section is not None and not _same(section, here):
            yield from ((base, low, start) for base in _convex(section))
            low = start
        section = here
    if section is not None:
        yield from ((base, low, levels[-1]) for base in _convex(section))


def _same(one: Any, other: Any) -> bool:
    return bool((one - other).area() + (other - one).area() <= EXACT**1.5)


def _convex(section: Any) -> list[Array]:
    """Convex polygons (n, 2) that make up a cross-section."""
    points, loops = convex_loops(section)
    return [points[list(loop)] for loop in loops]


def convex_loops(section: Any) -> tuple[Array, list[Loop]]:
    """The corners (n, 2) of a cross-section, and convex polygons of them that make it up."""
    from manifold3d import triangulate

    contours = section.to_polygons()
    points = np.concatenate([np.zeros((0, 2)), *contours])
    triangles = triangulate(contours).tolist() if contours else []
    return points, _joined(points, [tuple(corners) for corners in triangles])


def _joined(points: Array, loops: list[Loop]) -> list[Loop]:
    """Convex polygons, joined across common sides as far as the results are convex."""
    owner = {side: number for number, loop in enumerate(loops) for side in sides_of(loop)}
    common = [(u, v) for u, v in owner if u < v and (v, u) in owner]
    common.sort(key=lambda side: -float(np.linalg.norm(points[side[0]] - points[side[1]])))
    for u, v in common:
        one, other = owner[u, v], owner[v, u]
        if one == other:
            continue
        first, second = _from(loops[one], v), _from(loops[other], u)  # from v to u, from u to v
        at_u = _turns_left(points, first[-2], u, second[1])
        if at_u and _turns_left(points, second[-2], v, first[1]):
            loops[one], loops[other] = first[:-1] + second[:-1], ()
            owner.update(dict.fromkeys(sides_of(loops[one]), one))
    return [loop for loop in loops if loop]


def sides_of(loop: Loop) -> list[tuple[int, int]]:
    return [*zip(loop, loop[1:] + loop[:1], strict=True)]


def _from(loop: Loop, corner: int) -> Loop:
    """A loop from one of its corners on."""
    at = loop.index(corner)
    return loop[at:] + loop[:at]


def _turns_left(points: Array, a: int, b: int, c: int) -> bool:
    """Whether a way does not turn right at b, up to rounding."""
    (x, y), (u, v) = points[b] - points[a], points[c] - points[b]
    return bool(x * v - y * u >= -EXACT * 1e-3 * np.hypot(x, y))


def _area(base: Array) -> float:
    x, y = base.T
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


def _breadth(base: Array) -> float:
    """A lower bound on the radius of the largest circle in a convex polygon."""
    rim = np.linalg.norm(np.roll(base, -1, axis=0) - base, axis=1).sum()
    return _area(base) / float(rim)


def _open(stack: Sequence[tuple[Array, float, float]]) -> Array:
    """The share of the sides of each prism (n,) along which there is no other of its slab."""
    keys = [
        [(low, *u, *v) for u, v in zip(base.tolist(), np.roll(base, -1, 0).tolist(), strict=True)]
        for base, low, _ in stack
    ]
    sides = {key for rim in keys for key in rim}
    shares = []
    for rim in keys:
        lengths = np.array([np.hypot(u - x, v - y) for _, x, y, u, v in rim])
        alone = [(low, u, v, x, y) not in sides for low, x, y, u, v in rim]
        shares.append(lengths[alone].sum() / lengths.sum())
    return np.array(shares)


def prism(base: Array, low: float, high: float) -> Array:
    ends = np.repeat([low, high], len(base))
    return np.column_stack([np.concatenate([base, base]), ends])
