"""From the PAG of a source to its parts in place, with their solids."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from factory.geometry.alike import PartShape, shape_of
from factory.geometry.decomposition import can_decompose
from factory.geometry.meshes import Array, Indices, hull_mesh
from factory.geometry.product import product_geometry
from factory.geometry.solids import Solid, rotation
from factory.planning.hulls import EXTRA, hull_stands
from factory.planning.parts import PlacedPart
from factory.problem.pag import PAG
from factory.support.errors import Diagnostic

DECOMPOSE = f"{EXTRA}: then it is decomposed into convex bodies"

AS_BODIES = "CoACD finds no bodies in it: write it as closed convex bodies that touch"


def placed(
    pag: PAG, files: Mapping[str, bytes]
) -> tuple[tuple[PlacedPart, ...], tuple[Diagnostic, ...]]:
    """The parts of a PAG, each as a kind of its own, and what there is to warn about. Raises
    InputError (BadMesh, BadValue)."""
    product = product_geometry(pag, files)
    parts = []
    for node in pag.parts():
        solid = product.solids[node.label]
        parts.append(PlacedPart(node.label, *surface(solid), node.label, solid, node))
    return tuple(parts), (*product.warnings, *_hulls(parts))


def _hulls(parts: Sequence[PlacedPart]) -> list[Diagnostic]:
    """A warning for each closed mesh whose hull stands for it though it is not convex: what goes
    into it, or through it, seems to overlap with it."""
    found = {}
    for part in parts:
        file = str(part.node.parameter("mesh"))
        if file not in found and hull_stands(part.solid.mesh):
            message = f"{file} is not convex; its convex hull stands for it"
            hint = AS_BODIES if can_decompose() else DECOMPOSE
            many = f"meshes are not convex: their convex hulls stand for them ({hint})"
            found[file] = Diagnostic("BadMesh", message, part.node.position, hint, many)
    return list(found.values())


def surface(solid: Solid) -> tuple[Array, Indices]:
    """The surface of a solid in place: vertices (n, 3) [m] and faces (m, 3). That of a round one is
    the polytope around it."""
    if solid.mesh is None:
        mesh = hull_mesh(solid.label, solid.pieces[0])
        return mesh.vertices, mesh.faces
    turn = rotation(solid.quaternion)
    return solid.mesh.vertices @ turn.T + solid.position, np.asarray(solid.mesh.faces)


def shape_in_place(part: PlacedPart) -> PartShape:
    """The shape of a part, to be compared with others."""
    return shape_of(part.vertices, part.faces)
