"""STL, binary, in millimetres, the unit of slicers and CAD: the finished product, or a sub-assembly
(`--of LABEL`), in the product's frame; into a folder, a file for every label."""

from __future__ import annotations

from collections.abc import Mapping

from factory.apps.exports.subject import Subject, triangles, wanted
from factory.support.meshes.triangles import joined, stl
from factory.support.rotations import rotation

FORMAT, TAKES, BINARY, FOLDER, OF = "stl", "pag", True, True, "a label"

MILLIMETRES = 1e3
"""To a metre."""


def export(subject: Subject) -> bytes | Mapping[str, bytes]:
    """The file, or those of a folder."""
    made = {name: write_stl(subject, label) for label, name in wanted(subject, ".stl")}
    return made if subject.whole else made[""]


def write_stl(subject: Subject, label: str) -> bytes:
    """A sub-assembly as one STL."""
    project, bodies = subject.project, []
    for part in project.pag.product(label).parts():
        solid = project.product.solids[part.label]
        mesh, turn = triangles(solid), rotation(solid.quaternion)
        bodies.append((mesh.vertices @ turn.T + solid.position, mesh.faces))
    vertices, faces = joined(bodies)
    return stl(vertices * MILLIMETRES, faces)
