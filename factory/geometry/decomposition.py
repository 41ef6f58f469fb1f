"""A mesh that is not convex, as convex bodies that collide in its place.

What is open, or convex but for a fiftieth of its hull, keeps its hull. A mesh of several closed
convex bodies (a plate with a hole, written as wedges that touch) is exactly these bodies. What else
is closed is decomposed by CoACD, body by body, where that is installed (the extra `decompose`),
else it has its hull. A body is decomposed in the frame of its own sides, so however it is turned.
The results are kept in the user's cache, and serve for the same shape wherever it is.
"""

from __future__ import annotations

from dataclasses import replace
from threading import Lock
from typing import Any

import numpy as np

from factory.geometry.alike import PartShape, motion_between, moved, shape_of
from factory.geometry.meshes import Array, Mesh, is_closed, normals_of, volume_of
from factory.geometry.pieces import FLATNESS, closed_bodies, is_convex, joined
from factory.support.cache import digest, load_arrays, packed, store_arrays, unpacked
from factory.support.environment import environment
from factory.support.version import release

FOLDER = "pieces"
"""Where decompositions are kept, in the user's cache."""

FULL = 0.98
"""A closed mesh that fills more than this share of its hull collides as its hull."""

CONCAVITY, SLENDER = (0.02, 0.05), 0.1
"""How far, at most, CoACD lets a body differ from its mesh (its `threshold`), in about half the
longest edge of the mesh's box: between these, and no more than the last of the middle edge."""

PARAMETERS = {
    "mcts_iterations": 30,
    "mcts_max_depth": 2,
    "resolution": 500,
    "preprocess_resolution": 30,
    "seed": 0,
}
"""What else CoACD is called with: it tries fewer cuts than it does by itself, and has a third of
the triangles where it puts a mesh that intersects itself on a grid."""

SAME_AREA, EXACT = 1e-4, 2e-6
"""Areas that differ by less than the first share may be of one shape, of which no vertex is off by
more than the second share of its size."""

ALONG, LEVEL = 0.1, 1e-6
"""A body stands along the axes of its file of whose surface the first share does; a side lies along
an axis whose normal has a cosine to it that is off 1 by less than the second."""

AS_DRAWN = np.eye(3)
"""The axes of a file."""

LOADING = Lock()

SLIVER = 1e-6
"""A body of less than this share of the mesh's volume is left out: the engine refuses flat ones."""


def in_pieces(mesh: Mesh) -> Mesh:
    """The mesh with its convex bodies, where it is found to have several."""
    if not is_closed(mesh.faces) or _fills(mesh, 1 - FLATNESS):
        return mesh
    bodies = closed_bodies(mesh.vertices, mesh.faces)
    if len(bodies) > 1 and all(is_convex(*body) for body in bodies):
        return Mesh(mesh.name, *joined(bodies), tuple(vertices for vertices, _ in bodies))
    if _fills(mesh, FULL) or not can_decompose():
        return mesh
    alone = [Mesh(mesh.name, *body) for body in bodies]
    if any(volume_of(body.vertices, body.faces) <= 0 for body in alone):
        alone = [mesh]  # a cavity is no body
    pieces = tuple(piece for body in alone or [mesh] for piece in _decomposed(body))
    return replace(mesh, pieces=pieces) if len(pieces) > 1 else mesh


def can_decompose() -> bool:
    """Whether CoACD is installed."""
    return bool(release("coacd"))


def _fills(mesh: Mesh, share: float) -> bool:
    """Whether a mesh is at least such a share of its hull, or bounds no volume."""
    return mesh.share >= share or mesh.share <= 0


def _decomposed(mesh: Mesh) -> tuple[Array, ...]:
    """The bodies that CoACD makes of a mesh, from the cache if it did so before; the mesh itself
    where it is convex, or CoACD fails."""
    if _fills(mesh, FULL):
        return (mesh.vertices,)
    shape = shape_of(mesh.vertices, mesh.faces)
    found = _kept(shape)
    if found is None:
        axes = own_axes(mesh)
        turned = replace(mesh, vertices=mesh.vertices @ axes.T) if axes is not AS_DRAWN else mesh
        found = _run_coacd(turned)
        if axes is not AS_DRAWN:
            found = tuple(piece @ axes for piece in found)
        arrays = {"vertices": shape.vertices, "faces": shape.faces, **packed(found)}
        store_arrays(FOLDER, _names(shape)[0], arrays)
    return found or (mesh.vertices,)


def _names(shape: PartShape) -> tuple[str, ...]:
    """The names under which a shape may be kept; the first is its own. What they depend on is the
    same wherever it is, but for the last digits of its area."""
    sizes = len(shape.vertices), len(shape.faces)
    step = np.log(shape.surface[0]) / SAME_AREA
    given = release("coacd"), sorted(PARAMETERS.items()), CONCAVITY, SLENDER, SLIVER, sizes
    numbers = dict.fromkeys(int(np.floor(step + off)) for off in (0.0, -0.01, 0.01))
    return tuple(digest(*given, number) for number in numbers)


def _kept(shape: PartShape) -> tuple[Array, ...] | None:
    """The bodies that were found of a shape, here or elsewhere, moved with it; None for none."""
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
    """How far points are from the vertices of a shape at most [m]."""
    from scipy.spatial import cKDTree

    return float(cKDTree(shape.vertices).query(points)[0].max())


def own_axes(mesh: Mesh) -> Array:
    """The axes (3, 3) of a body's own frame, as rows: the normals of its largest sides. Those of
    its file, where a share of ALONG of its surface lies along them."""
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
    """The normal (3,) that, with its opposite, has the largest area."""
    ends = normals * np.sign(normals @ np.array([1.0, 1.1, 1.21]))[:, None]
    _, group = np.unique(np.round(ends, 4), axis=0, return_inverse=True)
    most = group == np.bincount(group.ravel(), areas).argmax()
    mean = areas[most.ravel()] @ ends[most.ravel()]
    return np.asarray(mean / np.linalg.norm(mean))


def _run_coacd(mesh: Mesh) -> tuple[Array, ...]:
    """The bodies that CoACD makes of a mesh, without slivers; none where it fails. Where it would
    leave one, as of a plate with a shallow groove, it may differ from the mesh by the least."""
    coarse, least = _threshold(mesh), CONCAVITY[0]
    found = _cut(mesh, coarse)
    return _cut(mesh, least) if len(found) == 1 and least < coarse else found


def _cut(mesh: Mesh, threshold: float) -> tuple[Array, ...]:
    import trimesh

    try:
        coacd = _library()
        given = coacd.Mesh(mesh.vertices, mesh.faces)
        bodies = coacd.run_coacd(given, threshold=threshold, **PARAMETERS)
        hulls = [trimesh.convex.convex_hull(np.asarray(vertices, float)) for vertices, _ in bodies]
    except Exception:  # CoACD raises anything on a strange mesh
        return ()
    least = SLIVER * sum(float(hull.volume) for hull in hulls)
    return tuple(np.asarray(hull.vertices) for hull in hulls if hull.volume > least)


def _threshold(mesh: Mesh) -> float:
    """How far a body may differ from the mesh, as CoACD counts it."""
    _, middle, longest = np.sort(np.ptp(mesh.vertices, axis=0))
    return float(np.clip(SLENDER * middle / longest, *CONCAVITY))


def _library() -> Any:
    """CoACD with one thread a mesh: with several its bodies come, and are merged, in the order in
    which threads happen to end. OpenMP reads the number of threads when the library is loaded."""
    with LOADING, environment("OMP_NUM_THREADS", "1"):
        import coacd

        coacd.set_log_level("off")
    return coacd
