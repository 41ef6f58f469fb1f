"""The parts of a product, or of a sub-assembly of it, as triangle meshes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from factory.exporting.subject import Subject
from factory.geometry.meshes import Mesh
from factory.geometry.solids import Solid

ROUND = 64
"""Sides of a cylinder."""


def triangles(solid: Solid) -> Mesh:
    """A part's mesh in its own frame [m]: cylinders as prisms, spheres as polytopes with their
    vertices on the surface."""
    from trimesh import creation

    if solid.mesh is not None:
        return solid.mesh
    if solid.kind == "box":
        made = creation.box(extents=2 * np.array(solid.size))
    elif solid.kind == "cylinder":
        made = creation.cylinder(solid.size[0], 2 * solid.size[1], sections=ROUND)
    else:
        made = creation.icosphere(subdivisions=3, radius=solid.size[0])
    return Mesh(solid.kind, np.asarray(made.vertices, float), np.asarray(made.faces, np.int64))


def wanted(subject: Subject, ending: str) -> Iterator[tuple[str, str]]:
    """Labels to write, with the names of their files: the requested one, or the product, under "";
    for a whole folder every sub-assembly and part. Raises InputError."""
    pag = subject.project.pag
    if not subject.whole:
        yield subject.choose(list(dict.fromkeys((pag.root, *pag.by_label))), "labels"), ""
        return
    taken: set[str] = set()
    for node in pag.postorder():
        name = file_name(node.label, taken)
        yield node.label, f"{name}{ending}"


def file_name(label: str, taken: set[str]) -> str:
    """A file name for a label, distinct from those `taken` whatever the case; the label itself
    where that is a safe name."""
    safe = "".join(c if c.isalnum() or c in "-_." else "_" for c in label).strip(".") or "_"
    name, number = safe[:80], 2
    while name.casefold() in taken:
        name, number = f"{safe[:80]}~{number}", number + 1
    taken.add(name.casefold())
    return name
