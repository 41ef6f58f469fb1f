"""Approximate decomposition of a body into convex prisms: of a cover with many holes, a gear, a
housing.

The body is cut into *slabs* perpendicular to an axis: where it has faces perpendicular to that, and
in halves where its cross-section changes in between. Its projection along the axis, which contains
it, stands for a slab. The projection is cut into convex polygons, and neighbours are merged into
their hull, the least first, as long as that is off by no more than is allowed (approximate convex
decomposition: Lien and Amato, 2006; there a pocket is measured by its depth). A difference of two
areas is off by less than a distance if it contains no disc of that diameter.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from heapq import heappop, heappush
from itertools import pairwise
from math import ceil, pi
from typing import Any

import numpy as np

from factory.floor.geometry.overlap import bounded
from factory.floor.geometry.prisms import (
    SQUARE,
    Loop,
    convex_loops,
    distinct,
    frames,
    prism,
    sides_of,
)
from factory.support.arrays import Array, Indices
from factory.support.meshes.triangles import normals_of

SHARE = 0.9
"""A body is decomposed so if at least this share of its surface is parallel or perpendicular to an
axis."""

MOST, CORNERS = 160, 1500
"""The most prisms of a body, and corners of a projection: merging takes their square."""

LEVEL, INSIDE = 1e-5, 1e-3
"""Faces of one height differ by no more than the first share of the body's size; a slab is measured
without the second share of its thickness at either end."""

ALIKE = 0.25
"""Neighbouring slabs are joined if their projections are off by less than this share of what is
allowed."""

SETTINGS = SHARE, MOST, CORNERS, LEVEL, INSIDE, ALIKE
"""What the prisms of a mesh depend on."""

Slab = tuple[float, float, Any]
"""Lower end, upper end, and projection, a `manifold3d.CrossSection`."""


def slabs(vertices: Array, faces: Indices, allowed: float, within: float) -> tuple[Array, ...]:
    """The corners (n, 3) of convex prisms that together are nearly a closed mesh; empty if too
    little of its surface is parallel or perpendicular to an axis, or the body has too many holes.

    Args:
        vertices: (n, 3) [m].
        faces: (m, 3).
        allowed: how far prisms may be outside the projection of their slab, and that outside the
            body [m].
        within: how far the outline of a projection may be off before it is cut [m].
    """
    frame, size = _frame(vertices, faces), float(np.ptp(vertices, axis=0).max())
    if frame is None:
        return ()
    placed = vertices @ frame.T / size
    body, pieces = bounded(placed, faces), list[Array]()
    if body is None:
        return ()
    for low, high, projection in _stacked(body, _levels(placed, faces), allowed / size):
        section = _without_narrow_holes(projection.simplify(within / size), allowed / size)
        if section.num_vert() > CORNERS:
            return ()
        polygons = _convex(section, allowed / size)
        pieces += [prism(polygon, low, high) @ frame * size for polygon in polygons]
    return tuple(pieces) if len(pieces) <= MOST else ()


def _frame(vertices: Array, faces: Indices) -> Array | None:
    """The frame (3, 3), axes as rows, the last of which is parallel or perpendicular to most of
    the surface; None if that is less than SHARE."""
    normals = normals_of(vertices, faces)
    areas = np.linalg.norm(normals, axis=1)
    shares = []
    for frame in frames(vertices, faces):
        along = np.abs(normals @ frame[2]) / np.maximum(areas, 1e-300)
        square = (along <= SQUARE) | (along >= 1 - SQUARE**2)
        shares.append((float(areas[square].sum() / areas.sum()), frame))
    share, frame = max(shares, key=lambda one: one[0])
    return frame if share >= SHARE else None


def _levels(vertices: Array, faces: Indices) -> list[float]:
    """The heights of a body's ends, and of its faces perpendicular to z."""
    normals = normals_of(vertices, faces)
    flat = np.abs(normals[:, 2]) >= (1 - SQUARE**2) * np.linalg.norm(normals, axis=1)
    ends = vertices[:, 2].min(), vertices[:, 2].max()
    return distinct(np.array([*ends, *vertices[faces[flat], 2].mean(axis=1)]), LEVEL)


def _stacked(body: Any, levels: Sequence[float], allowed: float) -> list[Slab]:
    """The slabs of a body, from below; those that are nearly alike joined."""
    stack: list[Slab] = []
    for low, high in pairwise(levels):
        for start, end, section in _cut(body, low, high, allowed):
            if stack and _alike(stack[-1][2], section, ALIKE * allowed):
                start, section = stack[-1][0], section + stack.pop()[2]
            stack.append((start, end, section))
    return stack


def _cut(body: Any, low: float, high: float, allowed: float) -> Iterator[Slab]:
    """A slab, or its halves, as far as its cross-section changes: looked at in heights that are no
    farther apart than is allowed."""
    thick = high - low
    upper = body.trim_by_plane((0.0, 0.0, 1.0), low + INSIDE * thick)
    section = upper.trim_by_plane((0.0, 0.0, -1.0), INSIDE * thick - high).project()
    heights = np.linspace(low + INSIDE * thick, high - INSIDE * thick, ceil(thick / allowed) + 1)
    if thick > allowed and any(_is_wide(section - body.slice(at), allowed) for at in heights):
        middle = (low + high) / 2
        yield from _cut(body, low, middle, allowed)
        yield from _cut(body, middle, high, allowed)
    elif not section.is_empty():
        yield low, high, section


def _alike(one: Any, other: Any, width: float) -> bool:
    return not (_is_wide(one - other, width) or _is_wide(other - one, width))


def _is_wide(area: Any, width: float) -> bool:
    """Whether an area contains a disc of such a diameter."""
    from manifold3d import JoinType

    if area.area() < pi / 4 * width**2:
        return False
    return not area.offset(-width / 2, JoinType.Miter).is_empty()


def _without_narrow_holes(section: Any, width: float) -> Any:
    """A section without those holes that contain no disc of such a diameter."""
    from manifold3d import CrossSection

    outlines = [(outline, CrossSection([outline[::-1]])) for outline in section.to_polygons()]
    stay = [line for line, hole in outlines if hole.is_empty() or _is_wide(hole, width)]
    return CrossSection(stay)


def _convex(section: Any, allowed: float) -> list[Array]:
    """Convex polygons (n, 2) that cover a section and are outside of it by less than allowed."""
    points, loops = convex_loops(section)
    return _Merging(section, allowed, [points[list(loop)] for loop in loops], loops).merged()


class _Merging:
    """Convex polygons that cover a section, while neighbours are merged.

    Attributes:
        polygons: each (n, 2), those that have been merged too.
        beside: of each that is left, its neighbours.
        queue: pairs that may be merged, by the area that their hull adds to the section.
    """

    def __init__(
        self, section: Any, allowed: float, polygons: list[Array], loops: Sequence[Loop]
    ) -> None:
        self.section, self.allowed, self.polygons = section, allowed, polygons
        owner = {side: number for number, loop in enumerate(loops) for side in sides_of(loop)}
        self.beside: dict[int, set[int]] = {number: set() for number in range(len(loops))}
        for (u, v), number in owner.items():
            if (v, u) in owner:
                self.beside[number].add(owner[v, u])
        self.queue: list[tuple[float, int, int]] = []
        for number, near in self.beside.items():
            self._offer(number, near)

    def merged(self) -> list[Array]:
        """The polygons when no two neighbours can be merged any more."""
        while self.queue:
            _, one, other = heappop(self.queue)
            if one in self.beside and other in self.beside:
                self._merge(one, other)
        return [self.polygons[number] for number in sorted(self.beside)]

    def _offer(self, number: int, near: set[int]) -> None:
        """Put the pairs of a polygon with older neighbours into the queue."""
        for other in sorted(near):
            if other < number:
                added = self._hull(number, other) - self.section
                if not _is_wide(added, self.allowed):
                    heappush(self.queue, (added.area(), other, number))

    def _merge(self, one: int, other: int) -> None:
        """The hull of two, as a new one in their place."""
        new = len(self.polygons)
        self.polygons.append(self._hull(one, other).to_polygons()[0])
        near = (self.beside.pop(one) | self.beside.pop(other)) - {one, other}
        for number in near:
            self.beside[number] = self.beside[number] - {one, other} | {new}
        self.beside[new] = near
        self._offer(new, near)

    def _hull(self, one: int, other: int) -> Any:
        from manifold3d import CrossSection

        return CrossSection.hull_points(np.concatenate([self.polygons[one], self.polygons[other]]))
