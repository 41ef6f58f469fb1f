"""Parts of the same shape: the rigid motion that maps one to the other, if there is one.

Shapes are compared by their vertices and their surface. Copies of one mesh are recognised in any
place, however their vertices and triangles are numbered; one shape with two different sets of
vertices counts as two shapes. A mirror image is another kind, unless the shape is its own mirror
image.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from factory.support.arrays import Array, Indices
from factory.support.meshes.merging import merged_vertices

__all__ = ["PartShape", "RigidMotion", "motion_between", "shape_of"]

CLOSE, DIGITS = 2e-5, 1e-6
"""The tolerance for equal vertices: the first share of the shape's size, or the second share of its
distance from the origin (files have seven digits), whichever is greater."""

MOST_TRIES = 20_000
"""The most pairs of vertices that are compared with the two anchors."""

SAMPLE = 12
"""The number of vertices that are compared before all are."""


@dataclass(frozen=True)
class PartShape:
    """The surface of a part in place: vertices (n, 3), all of which are used, and faces (m, 3)."""

    vertices: Array = field(repr=False)
    faces: Indices = field(repr=False)

    @cached_property
    def size(self) -> float:
        """The diagonal of its box."""
        return float(np.linalg.norm(np.ptp(self.vertices, axis=0)))

    @cached_property
    def slack(self) -> float:
        """The tolerance for equal vertices."""
        return max(CLOSE * self.size, DIGITS * float(np.abs(self.vertices).max()))

    @cached_property
    def middle(self) -> Array:
        """The mean (3,) of its vertices."""
        return np.asarray(self.vertices.mean(axis=0))

    @cached_property
    def spokes(self) -> Array:
        """The vertices relative to the middle (n, 3)."""
        return self.vertices - self.middle

    @cached_property
    def radii(self) -> Array:
        """The distances of the vertices from the middle (n,)."""
        return np.asarray(np.linalg.norm(self.spokes, axis=1))

    @cached_property
    def surface(self) -> tuple[float, Array, Array]:
        """The area, first (3,) and second moment (3, 3) of the surface about the middle; they do
        not depend on the triangulation."""
        corners = self.spokes[self.faces]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        area, total = np.linalg.norm(normal, axis=1) / 2, corners.sum(axis=1)
        second = np.einsum("m,mki,mkj->ij", area, corners, corners)
        second += np.einsum("m,mi,mj->ij", area, total, total)
        return float(area.sum()), area @ total / 3, second / 12

    def mirrored(self) -> PartShape:
        """Its mirror image in the plane x = 0."""
        return PartShape(self.vertices * (-1.0, 1.0, 1.0), self.faces[:, ::-1])


@dataclass(frozen=True, slots=True, eq=False)
class RigidMotion:
    """A rigid motion: x goes to turn x + shift."""

    turn: Array = field(default_factory=lambda: np.eye(3))
    shift: Array = field(default_factory=lambda: np.zeros(3))


def shape_of(vertices: Array, faces: Indices) -> PartShape:
    """The shape of a mesh that may have duplicate and unused vertices."""
    return PartShape(*merged_vertices(vertices, faces))


def motion_between(one: PartShape, other: PartShape) -> RigidMotion | None:
    """The rigid motion that maps one shape to another; None if there is none."""
    slack = max(one.slack, other.slack)
    if len(one.vertices) != len(other.vertices) or not _may_fit(one, other, slack):
        return None
    straight = _turn(one.spokes, other.spokes)
    if np.abs(one.spokes @ straight.T - other.spokes).max() <= slack:
        return _fitted(one, other, np.arange(len(one.vertices)), slack)
    return _searched(one, other, slack)


def _may_fit(one: PartShape, other: PartShape, slack: float) -> bool:
    """Whether the invariants of rigid motions agree."""
    if np.abs(np.sort(one.radii) - np.sort(other.radii)).max() > slack:
        return False
    area, reach = one.surface[0], 8 * slack * max(one.size, slack) * len(one.faces) ** 0.5
    spread = np.linalg.eigvalsh(one.surface[2]) - np.linalg.eigvalsh(other.surface[2])
    close = abs(area - other.surface[0]) <= reach
    return bool(close and np.abs(spread).max() <= reach * one.size**2)


def _searched(one: PartShape, other: PartShape, slack: float) -> RigidMotion | None:
    """The shift, if that is enough, or the motion found by matching two anchors of one shape with
    pairs of vertices of the other: with the middles they determine the rotation, and anchors at
    rare distances have few candidates."""
    from scipy.spatial import cKDTree

    tree = cKDTree(other.spokes)
    gap, order = tree.query(one.spokes)
    unturned = gap.max() <= slack and len(np.unique(order)) == len(order)
    if unturned and (motion := _fitted(one, other, order, slack)) is not None:
        return motion
    first, second = _anchors(one, slack)
    anchors = one.spokes[[first, second]]
    near = np.flatnonzero(np.abs(other.radii - one.radii[first]) <= 2 * slack)
    far = np.flatnonzero(np.abs(other.radii - one.radii[second]) <= 2 * slack)
    span, tries = float(np.linalg.norm(anchors[0] - anchors[1])), 0
    sample = one.spokes[np.linspace(0, len(one.spokes) - 1, SAMPLE).astype(int)]
    lever = float(np.linalg.norm(np.cross(*anchors))) / max(
        float(np.linalg.norm(anchors[0])), 1e-30
    )
    loose = slack * max(1.0, one.size / lever)
    for start in near:
        gaps = np.linalg.norm(other.spokes[far] - other.spokes[start], axis=1)
        for end in far[np.abs(gaps - span) <= 4 * slack]:
            tries += 1
            if tries > MOST_TRIES:
                return None
            turn = _frame(other.spokes[[start, end]]) @ _frame(anchors).T
            if tree.query(sample @ turn.T)[0].max() > 8 * loose:
                continue
            gap, order = tree.query(one.spokes @ turn.T)
            if gap.max() > 8 * loose or len(np.unique(order)) < len(order):
                continue
            if (motion := _fitted(one, other, order, slack)) is not None:
                return motion
    return None


def _anchors(shape: PartShape, slack: float) -> tuple[int, int]:
    """Two anchors: vertices that are not collinear with the middle and share their distance from it
    with few others."""
    order = np.sort(shape.radii)
    count = np.searchsorted(order, shape.radii + 2 * slack, "right")
    count = count - np.searchsorted(order, shape.radii - 2 * slack)
    lever = shape.radii / max(float(shape.radii.max()), 1e-30)
    first = int(np.lexsort((-lever, np.where(lever > 0.3, count, len(count) + 1)))[0])
    away = np.linalg.norm(np.cross(shape.spokes, shape.spokes[first]), axis=1)
    away /= max(float(away.max()), 1e-30)
    second = int(np.lexsort((-away, np.where(away > 0.3, count, len(count) + 1)))[0])
    return first, second


def _frame(pair: Array) -> Array:
    """The right-handed frame (3, 3), as columns, of two vectors (2, 3)."""
    along = pair[0] / np.linalg.norm(pair[0])
    across = np.cross(pair[0], pair[1])
    across /= np.linalg.norm(across)
    return np.column_stack([along, np.cross(across, along), across])


def _fitted(one: PartShape, other: PartShape, order: Indices, slack: float) -> RigidMotion | None:
    """The best motion that maps vertex i to vertex order[i], if it maps the surfaces too."""
    turn = _turn(one.spokes, other.spokes[order])
    if np.abs(one.spokes @ turn.T - other.spokes[order]).max() > slack:
        return None
    reach = 8 * slack * one.size * len(one.faces) ** 0.5
    first = one.surface[1] @ turn.T - other.surface[1]
    second = turn @ one.surface[2] @ turn.T - other.surface[2]
    if np.abs(first).max() > reach * one.size or np.abs(second).max() > reach * one.size**2:
        return None
    return RigidMotion(turn, other.middle - turn @ one.middle)


def _turn(one: Array, other: Array) -> Array:
    """The rotation (3, 3) that maps vectors (n, 3) best to others (Kabsch algorithm)."""
    left, _, right = np.linalg.svd(other.T @ one)
    sign = np.sign(np.linalg.det(left @ right)) or 1.0
    return np.asarray(left @ np.diag([1.0, 1.0, sign]) @ right)


def moved(motion: RigidMotion, points: Array) -> Array:
    """Points (n, 3) after a motion."""
    return points @ motion.turn.T + motion.shift
