"""Meshes that the engine can use, and their mass properties."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from factory.support.arrays import Array, Indices
from factory.support.meshes.triangles import convex_hull, is_closed, volume_of

if TYPE_CHECKING:
    import trimesh


MOST_FACES = 150_000
"""A mesh of more faces is replaced by its convex hull."""

LEAST_BOX = 1e-12
"""A mesh in a smaller box [m³] has no volume for the engine."""

LEAST_MASS, LEAST_INERTIA = 1e-9, 1e-12
"""The least mass [kg] and principal moments [kg m²] that the engine accepts."""

THINNEST, LEAST_PIECE = 1e-6, 1e-13
"""The engine takes convex bodies for flat that are thinner than the first [m], or than this share
of their distance from the origin, or are in a smaller box than the second [m³]."""

TOO_FAR = 1e-5
"""Pieces that protrude from their mesh by no more than this are accurate [m]."""

MARGIN = 1e-8
"""The share by which the sum of any two principal moments exceeds the third, so that rounding in
the MJCF does not turn the inertia of a sheet or a rod into an impossible one."""


@dataclass(frozen=True)
class Mesh:
    """A triangle mesh in its own frame.

    Attributes:
        FULL: a closed mesh that fills more than this share of its hull is represented by it, unless
            it has a hole through it, or another part stands in it.
        name: of its file.
        vertices: [m] (n, 3).
        faces: vertices of each triangle (m, 3).
        pieces: vertices of the convex bodies that collide in its place [m] (k, 3) each; empty if
            its hull does.
    """

    FULL: ClassVar[float] = 0.98

    name: str
    vertices: Array = field(repr=False)
    faces: Indices = field(repr=False)
    pieces: tuple[Array, ...] = field(default=(), repr=False)

    @cached_property
    def hull(self) -> Hull:
        """The convex hull, computed once: that of a fine mesh takes as long as everything else."""
        return hull_of(self.vertices)

    @cached_property
    def reach(self) -> float:
        """The distance by which the pieces protrude from the box of the mesh [m]: positive if CoACD
        has put a mesh that intersects itself on a grid."""
        if not self.pieces:
            return 0.0
        points = np.concatenate(self.pieces)
        below = self.vertices.min(axis=0) - points.min(axis=0)
        above = points.max(axis=0) - self.vertices.max(axis=0)
        return float(np.maximum(below, above).max())

    @cached_property
    def share(self) -> float:
        """The volume of a closed mesh as a share of that of its hull; not positive if it bounds
        none."""
        return volume_of(self.vertices, self.faces) / self.hull.volume


@dataclass(frozen=True, slots=True)
class Hull:
    """A convex hull: its vertices (k, 3) and volume."""

    corners: Array
    volume: float


def hull_of(points: Array) -> Hull:
    """The convex hull of points (n, 3). Raises QhullError if they are coplanar."""
    from scipy.spatial import ConvexHull

    hull, box = ConvexHull(points, qhull_options="QbB Pp Qt"), np.ptp(points, axis=0)
    volume = float(hull.volume * box.prod())  # Qhull has scaled the points to a unit cube
    return Hull(points[np.sort(hull.vertices)], volume)


@dataclass(frozen=True, slots=True)
class Remark:
    """A remark on a mesh: "is flat; its box is used instead"; `many`: the text for several meshes,
    "meshes are flat: ..."; `hint`: how to avoid it, "" for none."""

    text: str
    many: str
    hint: str = ""


@dataclass(frozen=True, slots=True)
class MassProperties:
    """A mesh, a remark on it, and its mass properties for unit density."""

    mesh: Mesh
    remark: Remark | None
    volume: float
    centre: Array
    inertia: Array
    hull: Array


FLAT = Remark(
    "is flat; its box is used instead",
    "meshes are flat: their boxes are used",
    "a body has three extents: give it a thickness of a thousandth of its length at least",
)
TINY = Remark(
    "is tiny; its box is used instead",
    "meshes are tiny: their boxes are used",
    "lengths are in metres, unless the text says its unit: `scale` makes a mesh larger",
)
OPEN = Remark(
    "is open (not watertight); its convex hull is used instead",
    "meshes are open: their convex hulls are used",
    "a closed mesh has its own mass, and collides as it is drawn",
)
SHEETS = Remark(
    "has flat bodies, which are left out",
    "meshes have flat bodies, which are left out",
    "a body has three extents: give it a thickness",
)
HOLLOW = Remark(
    "bounds no volume; its convex hull is used instead",
    "meshes bound no volume: their convex hulls are used",
    "two sides of a sheet, or bodies inside each other, cancel: give it a thickness",
)


def mend_remark(was: str) -> Remark:
    """The remark on a mesh that was repaired."""
    return Remark(f"{was}; it was repaired", "meshes were repaired: closed, or turned outwards")


def usable(name: str, vertices: Array, faces: Indices) -> tuple[Mesh, Remark | None]:
    """A mesh that the engine accepts, and a remark if it is not the given one."""
    for axes in (np.eye(3), _principal_axes(vertices)):
        low, high = (vertices @ axes.T).min(axis=0), (vertices @ axes.T).max(axis=0)
        extent = high - low
        if extent.min() < 1e-3 * extent.max() or extent.min() < 1e-5:
            return _box_mesh(name, low, high, axes), FLAT
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    if float(np.prod(high - low)) < LEAST_BOX:
        return _box_mesh(name, low, high, np.eye(3)), TINY
    if len(faces) > MOST_FACES:
        return _coarse_hull(name, vertices), Remark(
            f"has {len(faces)} triangles; its convex hull is used instead",
            f"meshes have more than {MOST_FACES} triangles: their convex hulls are used",
            f"simplify it to {MOST_FACES} triangles at most",
        )
    return Mesh(name, vertices, faces), None


def is_flat(points: Array) -> bool:
    """Whether the convex hull of points (n, 3) is too thin, or too small, to be a body."""
    across = np.ptp(points @ _principal_axes(points).T, axis=0)
    least = THINNEST * max(1.0, float(np.abs(points).max()))
    return bool(across.min() < least or across.prod() < LEAST_PIECE)


def _principal_axes(vertices: Array) -> Array:
    """The axes (3, 3) of a mesh's own frame, as rows; a flat mesh has no extent along the first."""
    spread = vertices - vertices.mean(axis=0)
    axes = np.linalg.eigh(spread.T @ spread)[1].T
    return np.asarray(axes if np.linalg.det(axes) > 0 else -axes)


def _box_mesh(name: str, low: Array, high: Array, axes: Array) -> Mesh:
    """The box from low to high (3,) along `axes` as a mesh, thick enough for the engine."""
    import trimesh

    extent = high - low
    box = trimesh.creation.box(np.maximum(extent, max(1e-4, 2e-3 * float(extent.max()))))
    return Mesh(name, (np.asarray(box.vertices) + (low + high) / 2) @ axes, np.asarray(box.faces))


def _coarse_hull(name: str, vertices: Array) -> Mesh:
    """The convex hull; if it has too many faces, that of the vertices rounded to a grid."""
    hull = Mesh(name, *convex_hull(vertices))
    if len(hull.faces) <= MOST_FACES:
        return hull
    step = float(np.ptp(vertices, axis=0).max()) / 250
    return Mesh(name, *convex_hull(np.unique(np.round(vertices / step), axis=0) * step))


def measured(mesh: Mesh, remark: Remark | None = None) -> MassProperties:
    """The volume, centre of mass, inertia for unit density, and hull vertices. A mesh that is open,
    or bounds no volume, has those of its convex hull. If its pieces protrude too far, the hull is
    that of the pieces, which collide."""
    import trimesh

    body = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    closed = is_closed(mesh.faces)
    for solid in _body_or_hull(body):
        if (solid is body and not closed) or not solid.volume > 0:
            continue
        properties = solid.mass_properties
        inertia = np.asarray(properties.inertia) / float(properties.density)
        if is_inertia(inertia):
            break
    if solid is not body and (closed or remark is None):
        remark = HOLLOW if closed else OPEN
    hull = mesh.hull
    if mesh.reach > TOO_FAR:
        hull = hull_of(np.concatenate(mesh.pieces))
        far = f"the bodies that collide for it reach {1000 * mesh.reach:.2g} mm too far"
        remark = remark or Remark(
            f"intersects itself: {far}",
            "meshes intersect themselves: the bodies that collide for them reach too far",
            "join what intersects, or write it as bodies that are closed",
        )
    centre, volume = np.asarray(properties.center_mass), float(properties.volume)
    return MassProperties(mesh, remark, volume, centre, inertia, hull.corners)


def _body_or_hull(body: trimesh.Trimesh) -> Iterator[trimesh.Trimesh]:
    """A body, its hull and the box of that, each computed on demand."""
    yield body
    yield body.convex_hull
    yield body.convex_hull.bounding_box


def is_inertia(matrix: Array) -> bool:
    """Whether a symmetric matrix (3, 3) can be the inertia of a body: principal moments
    positive, and none larger than the sum of the others."""
    low, middle, high = np.linalg.eigvalsh(matrix)
    return bool(low > 1e-6 * high and high <= (low + middle) * (1 + 1e-6))


def sound(inertia: Array) -> Array:
    """An inertia (3, 3) with moments that the engine accepts. If one is too small, or as large as
    the other two together, the same amount is added to all, so that a body can have it. Infinite
    values are unchanged."""
    if not np.isfinite(inertia).all():
        return inertia
    low, middle, high = np.linalg.eigvalsh(inertia)
    lacking = max(LEAST_INERTIA - low, high * (1 + MARGIN) - low - middle)
    return inertia + np.eye(3) * max(0.0, float(lacking))
