"""A mesh that is not convex, as convex bodies that collide in its place.

What is open, or convex but for a fiftieth of its hull, keeps its hull. A mesh of several closed
convex bodies (a plate with a hole, written as wedges that touch) is exactly these bodies. What else
is closed is decomposed by CoACD, body by body, where that is installed (the extra `decompose`),
else it has its hull. Its results are kept in the user's cache.
"""

from __future__ import annotations

from dataclasses import replace
from threading import Lock
from typing import Any

import numpy as np

from factory.geometry.meshes import Array, Mesh, is_closed, volume_of
from factory.geometry.pieces import FLATNESS, closed_bodies, is_convex, joined
from factory.support.array_cache import PACKED, digest, find, keep, packed, unpacked
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
    if _fills(mesh, FULL) or not release("coacd"):
        return mesh
    alone = [Mesh(mesh.name, *body) for body in bodies]
    if any(volume_of(body.vertices, body.faces) <= 0 for body in alone):
        alone = [mesh]  # a cavity is no body
    pieces = tuple(piece for body in alone or [mesh] for piece in _decomposed(body))
    return replace(mesh, pieces=pieces) if len(pieces) > 1 else mesh


def _fills(mesh: Mesh, share: float) -> bool:
    """Whether a mesh is at least such a share of its hull, or bounds no volume."""
    return mesh.share >= share or mesh.share <= 0


def _decomposed(mesh: Mesh) -> tuple[Array, ...]:
    """The bodies that CoACD makes of a mesh, from the cache if it did so before; the mesh itself
    where it is convex, or CoACD fails."""
    if _fills(mesh, FULL):
        return (mesh.vertices,)
    parameters = sorted(_parameters(mesh).items())
    name = digest(release("coacd"), parameters, SLIVER, mesh.vertices, mesh.faces)
    kept = find(FOLDER, name, PACKED)
    found = _run_coacd(mesh) if kept is None else unpacked(kept)
    if kept is None:
        keep(FOLDER, name, packed(found))
    return found or (mesh.vertices,)


def _run_coacd(mesh: Mesh) -> tuple[Array, ...]:
    """The bodies that CoACD makes of a mesh, without slivers; none where it fails."""
    import trimesh

    try:
        coacd = _library()
        bodies = coacd.run_coacd(coacd.Mesh(mesh.vertices, mesh.faces), **_parameters(mesh))
        hulls = [trimesh.convex.convex_hull(np.asarray(vertices, float)) for vertices, _ in bodies]
    except Exception:  # CoACD raises anything on a strange mesh
        return ()
    least = SLIVER * sum(float(hull.volume) for hull in hulls)
    return tuple(np.asarray(hull.vertices) for hull in hulls if hull.volume > least)


def _parameters(mesh: Mesh) -> dict[str, float]:
    """What CoACD is called with."""
    _, middle, longest = np.sort(np.ptp(mesh.vertices, axis=0))
    return {"threshold": float(np.clip(SLENDER * middle / longest, *CONCAVITY)), **PARAMETERS}


def _library() -> Any:
    """CoACD with one thread a mesh: with several its bodies come, and are merged, in the order in
    which threads happen to end. OpenMP reads the number of threads when the library is loaded."""
    with LOADING, environment("OMP_NUM_THREADS", "1"):
        import coacd

        coacd.set_log_level("off")
    return coacd
