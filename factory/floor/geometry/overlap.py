"""The overlap of two solids as drawn: exact, by boolean operations on their surfaces.

The convex bodies that collide for a part (`pieces`) may be larger than the part as drawn: the hull
of a plate closes its holes. Here a part is the volume that its own surface bounds. The *depth* of
an overlap of A and B is the least distance by which one of the two must be eroded so that they are
disjoint: 0.4 mm for a peg of 40.8 mm in a hole of 40 mm, the radius of a pin in a plate that has no
hole for it. It is attained in the common volume,

    depth = min over S in {A, B} of max over p in A ∩ B of |p, ∂S|,

and is sampled at the corners of the common volume and along chords that are normal to its faces. A
common volume may be a film that is thinner than rounding, as that of a rod in a bore of the same
diameter. A chord may then begin outside the film and cross the bore, so its middle counts only if
it is in A and in B.

The volume that A sweeps when it is shifted by v is the union of A and the prisms over its triangles
that face v. They form one body that may overlap itself: it is solid wherever A passes.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from operator import itemgetter
from pathlib import Path
from typing import Any
from weakref import finalize

import numpy as np

from factory.floor.geometry.distances import distances_to
from factory.floor.geometry.pieces import closed_bodies
from factory.floor.geometry.solids import Solid
from factory.support import meshes
from factory.support.arrays import Array, Indices
from factory.support.meshes.bodies import connected
from factory.support.meshes.triangles import is_closed, normals_of
from factory.support.rotations import rotation

SUPPORT = Path(meshes.__file__).parent

MODULES = Path(__file__).parent, SUPPORT, SUPPORT.parent
"""Folders of the modules that shapes depend on: what they computed is kept by their content."""

ROUND = 5e-6
"""The largest deviation of the polytope that represents a round body [m]."""

SIDES = (24, 1024)
"""The fewest and the most sides of the polygon that represents a circle."""

FACING = 1e-9
"""Triangles with a cosine of at most this between normal and shift slide along themselves."""

SAMPLES = 128
"""The most corners, and the most chords, of a common volume at which its depth is sampled."""

LEAST = 1e-15
"""Smaller common volumes are rounding errors [m³]: a millionth of a cubic millimetre."""

ON, SEEN = 1e-12, 32
"""A vertex is on a body that is so near [m]; and how many are looked at."""

BEYOND = 1e-9
"""The distance behind its face at which a chord begins [m]."""

RAY = np.array([1.0, 1e-3 * 2**0.5, 1e-3 * 3**0.5]) / np.sqrt(1 + 5e-6)
"""The direction of rays that tell inside from outside: no special one, but nearly along an axis, so
that the box of a ray has few triangles."""

AT_ONCE = 16
"""So many points are measured before it is looked whether others may be deeper."""


@dataclass(frozen=True, slots=True)
class Common:
    """The common volume [m³] of two solids, and its depth [m]; both 0 if they are disjoint.
    `deepest` (3,): a point at that depth; `box` (2, 3): the corners of its box."""

    volume: float
    depth: float
    deepest: Array = field(default_factory=lambda: np.zeros(3), compare=False, repr=False)
    box: Array = field(default_factory=lambda: np.zeros((2, 3)), compare=False, repr=False)


APART = Common(0.0, 0.0)
"""The result for disjoint solids."""


_DRAWN: dict[int, Any] = {}
"""The volumes of existing solids, by identity."""


def drawn(solid: Solid) -> Any:
    """The volume that a part's surface bounds, as a `manifold3d.Manifold` in the frame of the
    finished product, computed once; None for a mesh that bounds none."""
    key = id(solid)
    if key not in _DRAWN:
        _DRAWN[key] = _made(solid)
        finalize(solid, _DRAWN.pop, key, None)
    return _DRAWN[key]


_SHARED: dict[tuple[int, int], Common] = {}
"""The overlaps of existing solids, by identity."""


def overlap_of(one: Solid, other: Solid) -> Common:
    """The overlap of two parts that bound volumes, computed once."""
    if one.label > other.label:
        one, other = other, one
    key = id(one), id(other)
    if key not in _SHARED:
        _SHARED[key] = common(drawn(one), drawn(other))
        for solid in (one, other):
            finalize(solid, _SHARED.pop, key, None)
    return _SHARED[key]


def _made(solid: Solid) -> Any:
    from manifold3d import Manifold

    turn = rotation(solid.quaternion)
    if solid.kind == "mesh":
        mesh = solid.mesh
        if mesh is None or not is_closed(mesh.faces):
            return None
        return bounded(mesh.vertices @ turn.T + solid.position, mesh.faces)
    if solid.kind == "box":
        body = Manifold.cube(2 * np.array(solid.size), True)
    elif solid.kind == "cylinder":
        radius, half = solid.size[:2]
        sides = _sides(radius)
        between = radius * (1 + 1 / np.cos(np.pi / sides)) / 2
        body = Manifold.cylinder(2 * half, between, -1.0, sides, True)
    else:
        sides = 2 * _sides(solid.size[0])
        body = Manifold.sphere(solid.size[0], sides)
    return body.transform(np.column_stack([turn, solid.position]))


def _sides(radius: float) -> int:
    needed = np.pi / np.sqrt(2 * ROUND / max(radius, ROUND))
    return int(np.clip(np.ceil(needed), *SIDES))


def bounded(vertices: Array, faces: Indices) -> Any:
    """The volume that a closed mesh bounds; None if it bounds none. Its bodies that share an edge
    are separated, then united."""
    from manifold3d import Error, Manifold, OpType

    whole = _surface(vertices, faces)
    if whole.status() != Error.NoError:
        bodies = [_surface(*body) for body in closed_bodies(vertices, faces)]
        if not bodies or any(body.status() != Error.NoError for body in bodies):
            return None
        filled = Manifold.batch_boolean([b for b in bodies if b.volume() > 0], OpType.Add)
        cavities = [body for body in bodies if body.volume() < 0]
        whole = filled + Manifold.batch_boolean(cavities, OpType.Add) if cavities else filled
    return whole if whole.volume() > 0 else None


def _surface(vertices: Array, faces: Indices) -> Any:
    from manifold3d import Manifold, Mesh64

    return Manifold(Mesh64(np.ascontiguousarray(vertices), faces.astype(np.uint64)))


@dataclass(frozen=True, slots=True)
class Sweep:
    """The volume that a body sweeps, as bodies whose union it is. These are large and overlap all
    along the way: what each has in common with another body is united instead."""

    bodies: tuple[Any, ...]

    def __xor__(self, other: Any) -> Any:
        from manifold3d import Manifold, OpType

        return Manifold.batch_boolean([body ^ other for body in self.bodies], OpType.Add)

    def translate(self, shift: Array) -> Sweep:
        """The sweep, shifted (3,) [m]."""
        return Sweep(tuple(body.translate(shift) for body in self.bodies))

    def min_gap(self, other: Any, most: float) -> float:
        """Its distance from a body [m], at most `most`."""
        return float(min(body.min_gap(other, most) for body in self.bodies))

    def ray_cast(self, start: Array, end: Array) -> list[Any]:
        """Where a ray enters and leaves its bodies."""
        return [hit for body in self.bodies for hit in body.ray_cast(start, end)]

    def bounding_box(self) -> Array:
        """The corners of its box, low and high (6,)."""
        boxes = np.array([body.bounding_box() for body in self.bodies])
        return np.concatenate([boxes[:, :3].min(axis=0), boxes[:, 3:].max(axis=0)])

    def decompose(self) -> list[Any]:
        """The connected ones of its bodies."""
        return [part for body in self.bodies for part in body.decompose()]


def swept(body: Any, shift: Array) -> Sweep:
    """The volume that a body sweeps when it is shifted by `shift` (3,) [m]."""
    vertices, faces = merged(body.to_mesh64())
    normals = normals_of(vertices, faces)
    lengths = np.linalg.norm(normals, axis=1) * np.linalg.norm(shift)
    front = faces[normals @ shift > FACING * lengths]
    if not len(front):
        return Sweep((body,))
    points, near = _fanned(vertices, front)
    count = len(points)
    start, end = near.ravel(), np.roll(near, -1, axis=1).ravel()
    rim = ~np.isin(start * count + end, end * count + start)
    start, end = start[rim], end[rim]
    walls = np.concatenate(
        [
            np.column_stack([start, end, end + count]),
            np.column_stack([start, end + count, start + count]),
        ]
    )
    ahead = np.concatenate([near[:, ::-1], near + count, walls])
    return Sweep((body, _surface(np.concatenate([points, points + shift]), ahead)))


def _fanned(vertices: Array, faces: Indices) -> tuple[Array, Indices]:
    """Part of a closed surface, vertices and faces (m, 3), with a vertex for each fan: triangles
    round a vertex that are joined edge to edge. Fans that meet in a vertex alone are separated, so
    prisms over the part touch in no edge."""
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    begins = np.arange(faces.size)
    ends = np.roll(begins.reshape(-1, 3), -1, axis=1).ravel()
    edge, back = start * len(vertices) + end, end * len(vertices) + start
    _, there, twin = np.intersect1d(edge, back, return_indices=True)
    one, other = [begins[there], ends[there]], [ends[twin], begins[twin]]
    fan = connected(np.stack([one, other], axis=-1).reshape(-1, 2), faces.size)
    first = np.unique(fan, return_index=True)[1]
    return vertices[start[first]], fan.reshape(-1, 3)


def merged(mesh: Any) -> tuple[Array, Indices]:
    """The vertices (n, 3) and faces (m, 3) of a manifold mesh, with vertices merged."""
    vertices = np.asarray(mesh.vert_properties)[:, :3]
    target = np.arange(len(vertices))
    target[np.asarray(mesh.merge_from_vert, np.int64)] = np.asarray(mesh.merge_to_vert, np.int64)
    return vertices, target[np.asarray(mesh.tri_verts, np.int64)]


def united(bodies: Iterable[Any]) -> float:
    """The volume of the union of bodies [m³]."""
    from manifold3d import Manifold, OpType

    return float(Manifold.batch_boolean([*bodies], OpType.Add).volume())


def may_share(one: Any, other: Any) -> bool:
    """Whether the boxes of two bodies have a volume in common that is no rounding error: those of
    plates that lie on each other have none, whose common volume takes long to be found."""
    (low, high), (least, most) = (np.reshape(body.bounding_box(), (2, 3)) for body in (one, other))
    return bool(np.prod(np.maximum(np.minimum(high, most) - np.maximum(low, least), 0.0)) > LEAST)


def is_seen_near(one: Any, other: Any, gap: float = ON) -> bool:
    """Whether a vertex of one body is seen to be so near the surface of the other [m]: SEEN at most
    are looked at."""
    low, high = np.reshape(other.bounding_box(), (2, 3))
    vertices = merged(one.to_mesh64())[0]
    beside = ((vertices >= low - gap) & (vertices <= high + gap)).all(axis=1)
    near = vertices[beside][:: max(1, -(-beside.sum() // SEEN))]
    if not len(near):
        return False
    surface, faces = merged(other.to_mesh64())
    return bool(distances_to(near, surface[faces]).min() <= gap)


def common(
    one: Any, other: Any, both: bool = True, samples: int = SAMPLES, shared: Any = None
) -> Common:
    """The overlap of two bodies. `both`: the depth is the lesser of the two erosions; otherwise
    that of the `other`. With few `samples` the depth is a lower bound, computed faster. `shared`:
    their common volume, where it is known."""
    if not may_share(one, other):
        return APART
    shared = one ^ other if shared is None else shared
    volume = float(shared.volume())
    if shared.is_empty() or volume <= LEAST:
        return APART
    points = _within(shared, one, other, samples)
    bodies = (one, other) if both else (other,)
    box = np.array(shared.bounding_box()).reshape(2, 3)
    depth, deepest = min((_deepest(points, body, box) for body in bodies), key=itemgetter(0))
    return Common(volume, depth, points[deepest], box)


def _within(shared: Any, one: Any, other: Any, samples: int) -> Array:
    """Sample points (n, 3) of the volume that two bodies share: corners, and the ends and middles
    of chords from the centres of triangles, the larger triangles first. A volume with few triangles
    is subdivided."""
    fine = max(1, int(np.sqrt(samples / shared.num_tri())))
    vertices, faces = merged(shared.refine(fine).to_mesh64())
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    normals = np.cross(b - a, c - a)
    areas = np.linalg.norm(normals, axis=1)
    reach = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    boxed = [(body, np.array(body.bounding_box()).reshape(2, 3)) for body in (one, other)]
    points = [vertices[np.unique(faces)]]
    points[0] = points[0][:: -(-len(points[0]) // samples)]
    for row in np.argsort(-areas, kind="stable")[:samples].tolist():
        if areas[row] > 0:
            begin, inward = (a[row] + b[row] + c[row]) / 3, -normals[row] / areas[row]
            hits = shared.ray_cast(begin + BEYOND * inward, begin + reach * inward)
            ends = [np.asarray(hit.position) for hit in hits[:1]]
            middles = [(begin + end) / 2 for end in ends]
            inside = [m for m in middles if all(_is_inside(m, *body) for body in boxed)]
            points.append(np.array([begin, *ends, *inside]))
    return np.concatenate(points)


def _is_inside(point: Array, body: Any, box: Array) -> bool:
    """Whether a point is inside a body with a box (2, 3): a ray from it leaves the body more often
    than it enters."""
    beyond = point + RAY * 2 * (np.linalg.norm(box[1] - box[0]) + np.abs(point - box).max())
    return bool(sum(np.sign(hit.normal @ RAY) for hit in body.ray_cast(point, beyond)) > 0)


def _deepest(points: Array, body: Any, box: Array) -> tuple[float, int]:
    """The greatest distance of points from the surface of a body [m], at most the longest edge of
    the box (2, 3) of the common volume, and the number of the first point at it. A point that is
    nearer to a corner or middle of a triangle is not measured."""
    from scipy.spatial import cKDTree

    vertices, faces = merged(body.to_mesh64())
    most = float((box[1] - box[0]).max())
    corners = vertices[faces]
    near = (corners.max(axis=1) >= box[0] - most).all(axis=1)
    near &= (corners.min(axis=1) <= box[1] + most).all(axis=1)
    corners = corners[near]
    if not len(corners):
        return most, 0
    some = np.concatenate([vertices[np.unique(faces[near])], corners.mean(axis=1)])
    bounds = np.minimum(most, cKDTree(some).query(points)[0] + BEYOND)
    order, distances = np.argsort(-bounds, kind="stable"), np.full(len(points), -np.inf)
    for first in range(0, len(points), AT_ONCE):
        rows = order[first : first + AT_ONCE]
        if bounds[rows[0]] < distances.max():
            break
        distances[rows] = np.minimum(most, distances_to(points[rows], corners))
    return float(distances.max()), int(distances.argmax())
