"""Decomposition of a mesh that is not convex into convex bodies, which collide in its place.

A mesh that is open is represented by its hull. A mesh of several closed convex bodies (a plate with
a hole, written as wedges that touch) is exactly these bodies. Other closed meshes are decomposed
body by body. A body that has a hole through it, or that another part stands in, is decomposed
exactly if it is a body of few prisms (`prisms`). Such a body, and any that fills less than 98 % of
its hull, is otherwise decomposed into prisms that are a little larger (`slabs`) if most of its
surface is parallel or perpendicular to an axis, else by CoACD, if that is installed (the extra
`decompose`); else its hull is used. CoACD decomposes a body in the frame of its own sides, so the
result does not depend on its orientation. A mesh of many triangles is decimated first. Results are
cached, and reused for the same shape in any place.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from threading import Lock
from typing import Any

import numpy as np

from factory.floor.geometry.decimation import decimated
from factory.floor.geometry.meshes import Mesh, is_flat
from factory.floor.geometry.overlap import bounded, merged
from factory.floor.geometry.pieces import FLATNESS, closed_bodies, is_convex
from factory.floor.geometry.prisms import prisms
from factory.floor.geometry.slabs import SETTINGS, slabs
from factory.support.arrays import Array, Indices
from factory.support.cache import digest, load_arrays, packed, store_arrays, unpacked
from factory.support.environment import environment
from factory.support.meshes.alike import PartShape, motion_between, moved, shape_of
from factory.support.meshes.triangles import components, is_closed, joined, normals_of, volume_of
from factory.support.version import release

FOLDER = "pieces"
"""The folder of decompositions in the user's cache."""

CONCAVITY, SLENDER = (0.02, 0.05), 0.1
"""Bounds on the deviation that is allowed (CoACD's `threshold`), in units of about half the longest
edge of the mesh's box, and the bound relative to the middle edge."""

PARAMETERS = {
    "mcts_iterations": 30,
    "mcts_max_depth": 2,
    "resolution": 500,
    "preprocess_resolution": 30,
    "seed": 0,
}
"""Other arguments of CoACD: fewer cuts are tried than by default, and the grid for a mesh that
intersects itself has a third of the triangles."""

WITHIN = 1e-4, 0.05
"""A mesh may be decimated before it is decomposed within the first distance [m], and the second
share of the deviation that is allowed."""

ENOUGH = 600
"""A mesh of so many triangles is decomposed as it is."""

SAME_AREA, EXACT = 1e-4, 2e-6
"""Two shapes may be equal if their areas differ by less than the first share, and are if no vertex
is off by more than the second share of the size."""

ALONG, LEVEL = 0.1, 1e-6
"""A body is aligned with the axes of its file if the first share of its surface is; a side is if
the cosine of its normal and an axis differs from 1 by less than the second."""

Decompose = Callable[[Mesh, float], tuple[Array, ...]]
"""A method: the convex bodies of a mesh at a threshold; empty if it has none."""

AS_DRAWN = np.eye(3)
"""The axes of a file."""

LOADING = Lock()

SLIVER = 1e-6
"""Bodies below this share of the mesh's volume are omitted."""


def in_pieces(mesh: Mesh, stood_in: bool = False, decomposed: bool = True) -> Mesh:
    """The mesh with its convex bodies, if it has several, and without flat ones. `stood_in`:
    whether another part stands in it. Not `decomposed`: only a mesh whose bodies are convex as they
    are written has several."""
    if not is_closed(mesh.faces) or _fills(mesh, 1 - FLATNESS):
        return mesh
    shells = closed_bodies(mesh.vertices, mesh.faces)
    bodies = [shell for shell in shells if not is_flat(shell[0])]
    if 0 < len(bodies) < len(shells):
        mesh = Mesh(mesh.name, *joined(bodies))
    if len(bodies) > 1 and all(is_convex(*body) for body in bodies):
        return Mesh(mesh.name, *joined(bodies), tuple(vertices for vertices, _ in bodies))
    if not decomposed:
        return mesh
    alone = [Mesh(mesh.name, *body) for body in bodies]
    if len(alone) == 1 and len(alone[0].vertices) == len(mesh.vertices):
        alone = [mesh]  # whose hull is known
    if any(volume_of(body.vertices, body.faces) <= 0 for body in alone):
        alone = [mesh]  # a cavity is no body
    each = [_pieces(body, stood_in) for body in alone or [mesh]]
    pieces = tuple(piece for pieces in each for piece in pieces)
    is_apart = len(pieces) > 1 if can_decompose() else any(len(some) > 1 for some in each)
    return replace(mesh, pieces=pieces) if is_apart else mesh


def _pieces(body: Mesh, stood_in: bool) -> tuple[Array, ...]:
    """The convex bodies of one body of a mesh."""
    if not _fills(body, 1 - FLATNESS):
        is_entered = stood_in or has_hole(body)
        pieces = prisms(body.vertices, body.faces) if is_entered else ()
        if not pieces and (is_entered or not _fills(body, Mesh.FULL)):
            pieces = _decomposed(body)
        pieces = tuple(piece for piece in pieces if not is_flat(piece))
        return pieces or (body.vertices,)
    return (body.vertices,)


def has_hole(mesh: Mesh) -> bool:
    """Whether a closed surface has a hole through it, as a torus has: its Euler characteristic is
    less than that of its components, were they spheres."""
    sides = np.sort(np.concatenate([mesh.faces[:, [n, (n + 1) % 3]] for n in range(3)]), axis=1)
    used, edges = np.unique(mesh.faces), np.unique(sides, axis=0)
    count = components(len(mesh.vertices), mesh.faces).max(initial=-1) + 1
    return bool(len(used) - len(edges) + len(mesh.faces) < 2 * count)


def collides_as_hull(mesh: Mesh) -> bool:
    """Whether a closed mesh that is smaller than its hull collides as that."""
    return not mesh.pieces and is_closed(mesh.faces) and not _fills(mesh, 1 - FLATNESS)


def can_decompose() -> bool:
    """Whether CoACD is installed."""
    return bool(release("coacd"))


def _fills(mesh: Mesh, share: float) -> bool:
    """Whether a mesh fills at least such a share of its hull, or bounds no volume."""
    return mesh.share >= share or mesh.share <= 0


def _decomposed(mesh: Mesh) -> tuple[Array, ...]:
    """The convex bodies that a mesh nearly is, from the cache if they were computed before; the
    mesh itself if there are none."""
    shape = shape_of(mesh.vertices, mesh.faces)
    pieces = _kept(shape)
    if pieces is None:
        pieces = _finely(mesh, _by_slabs)
        if not pieces and can_decompose():
            pieces = _by_coacd(mesh)
        arrays = {"vertices": shape.vertices, "faces": shape.faces, **packed(pieces)}
        store_arrays(FOLDER, _names(shape)[0], arrays)
    return pieces or (mesh.vertices,)


def _by_slabs(mesh: Mesh, threshold: float) -> tuple[Array, ...]:
    return slabs(mesh.vertices, mesh.faces, *_tolerances(mesh, threshold))


def _by_coacd(mesh: Mesh) -> tuple[Array, ...]:
    """The bodies that CoACD makes of a mesh in its own frame."""
    axes = own_axes(mesh)
    if axes is AS_DRAWN:
        return _finely(mesh, _cut)
    turned = replace(mesh, vertices=mesh.vertices @ axes.T)
    return tuple(piece @ axes for piece in _finely(turned, _cut))


def _names(shape: PartShape) -> tuple[str, ...]:
    """The names of the cache entries that may hold a shape, its own first. They do not depend on
    the place of the shape, except for rounding of its area."""
    sizes = len(shape.vertices), len(shape.faces)
    step = np.log(shape.surface[0]) / SAME_AREA
    bounds = CONCAVITY, SLENDER, SLIVER, WITHIN, ENOUGH, SETTINGS
    settings = release("coacd"), sorted(PARAMETERS.items()), bounds, sizes
    numbers = dict.fromkeys(int(np.floor(step + off)) for off in (0.0, -0.01, 0.01))
    return tuple(digest(*settings, number) for number in numbers)


def _kept(shape: PartShape) -> tuple[Array, ...] | None:
    """The cached bodies of a shape, moved to its place; None if there are none."""
    for name in _names(shape):
        kept = load_arrays(FOLDER, name)
        if kept is None:
            continue
        if np.array_equal(kept["vertices"], shape.vertices):
            return unpacked(kept)
        motion = motion_between(PartShape(kept["vertices"], kept["faces"]), shape)
        if motion is None or _off(moved(motion, kept["vertices"]), shape) > EXACT * shape.size:
            continue
        return tuple(moved(motion, piece) for piece in unpacked(kept))
    return None


def _off(points: Array, shape: PartShape) -> float:
    """The greatest distance of points from the vertices of a shape [m]."""
    from scipy.spatial import cKDTree

    return float(cKDTree(shape.vertices).query(points)[0].max())


def own_axes(mesh: Mesh) -> Array:
    """The axes (3, 3) of a body's own frame, as rows: the normals of its largest sides; the axes of
    its file if a share of ALONG of its surface is aligned with them."""
    normals = normals_of(mesh.vertices, mesh.faces)
    areas = np.linalg.norm(normals, axis=1)
    normals /= np.maximum(areas, 1e-300)[:, None]
    flat = np.abs(normals).max(axis=1) > 1 - LEVEL
    if areas[flat].sum() >= ALONG * areas.sum():
        return AS_DRAWN
    first = _largest(normals, areas)
    across = np.abs(normals @ first) < LEVEL**0.5
    if across.any():
        second = _largest(normals[across], areas[across])
    else:
        second = np.eye(3)[np.abs(first).argmin()]
    second = second - (second @ first) * first
    second /= np.linalg.norm(second)
    return np.array([first, second, np.cross(first, second)])


def _largest(normals: Array, areas: Array) -> Array:
    """The normal (3,) of the largest area, opposite ones counted together."""
    ends = normals * np.sign(normals @ np.array([1.0, 1.1, 1.21]))[:, None]
    _, group = np.unique(np.round(ends, 4), axis=0, return_inverse=True)
    most = group == np.bincount(group.ravel(), areas).argmax()
    mean = areas[most.ravel()] @ ends[most.ravel()]
    return np.asarray(mean / np.linalg.norm(mean))


def _finely(mesh: Mesh, decompose: Decompose) -> tuple[Array, ...]:
    """What a method makes of a mesh. If that would be one body, as of a plate with a shallow
    groove, the finest threshold is used."""
    _, middle, longest = np.sort(np.ptp(mesh.vertices, axis=0))
    coarse, least = float(np.clip(SLENDER * middle / longest, *CONCAVITY)), CONCAVITY[0]
    pieces = decompose(mesh, coarse)
    return decompose(mesh, least) if len(pieces) == 1 and least < coarse else pieces


def _tolerances(mesh: Mesh, threshold: float) -> tuple[float, float]:
    """How far pieces may be outside a mesh, and by how much it may be simplified before [m]."""
    allowed = threshold * float(np.ptp(mesh.vertices, axis=0).max()) / 2
    return allowed, min(WITHIN[0], WITHIN[1] * allowed)


def _coarse(mesh: Mesh, threshold: float) -> tuple[Array, Indices]:
    """A mesh with fewer triangles, from which CoACD makes the same bodies faster: within a share
    of what these may be off."""
    body = bounded(mesh.vertices, mesh.faces) if len(mesh.faces) > ENOUGH else None
    if body is None:
        return mesh.vertices, mesh.faces
    coarse = decimated(body, _tolerances(mesh, threshold)[1], ENOUGH)
    return merged(coarse.body.to_mesh64()) if coarse.far else (mesh.vertices, mesh.faces)


def _cut(mesh: Mesh, threshold: float) -> tuple[Array, ...]:
    """The bodies that CoACD makes of a mesh, without slivers; empty if it fails."""
    import trimesh

    try:
        coacd = _library()
        source = coacd.Mesh(*_coarse(mesh, threshold))
        bodies = coacd.run_coacd(source, threshold=threshold, **PARAMETERS)
        hulls = [trimesh.convex.convex_hull(np.asarray(vertices, float)) for vertices, _ in bodies]
    except Exception:  # CoACD raises anything on a strange mesh
        return ()
    least = SLIVER * sum(float(hull.volume) for hull in hulls)
    return tuple(np.asarray(hull.vertices) for hull in hulls if hull.volume > least)


def _library() -> Any:
    """CoACD with one thread per mesh: with several, the order of the bodies, and so their merging,
    depends on the scheduling. OpenMP reads the number of threads when the library is loaded."""
    with LOADING, environment("OMP_NUM_THREADS", "1"):
        import coacd

        coacd.set_log_level("off")
    return coacd
