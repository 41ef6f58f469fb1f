"""From the PAG of a source to its parts in place, with their solids."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from factory.geometry.meshes import Array, Indices, hull_mesh
from factory.geometry.product import product_geometry
from factory.geometry.solids import Solid, rotation
from factory.planning.parts import PlacedPart
from factory.planning.source.alike import PartShape, shape_of
from factory.problem.pag import PAG
from factory.support.errors import Diagnostic


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
    return tuple(parts), product.warnings


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
