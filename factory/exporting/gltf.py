"""glTF 2.0 in metres, y upwards (the standard's axes): the finished product, or a sub-assembly
(`--of LABEL`), in the parts' colours, as a tree of nodes with the labels as names; .glb or .gltf by
the ending of the file; into a folder, a .glb for every label."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from factory.exporting.bodies import triangles, wanted
from factory.exporting.gltf_scene import new_scene, pose, shaded, written
from factory.exporting.subject import Subject
from factory.geometry.solids import Product, rotation
from factory.problem.pag import PAG

FORMAT, TAKES, BINARY, FOLDER, OF = "gltf", "pag", True, True, "a label"

PRODUCT = "/product"
"""The outermost node of the product; no label has a slash."""


def export(subject: Subject) -> bytes | Mapping[str, bytes]:
    """The file, or those of a folder."""
    pag, product = subject.project.pag, subject.project.product
    binary = subject.whole or subject.name.lower().endswith(".glb")
    made = {
        name: write_gltf(pag, product, label, binary) for label, name in wanted(subject, ".glb")
    }
    return made if subject.whole else made[""]


def write_gltf(pag: PAG, product: Product, label: str, binary: bool) -> bytes:
    """A sub-assembly as a glTF, binary or as JSON with its buffer inside (section 4.4); parts of
    equal shape and colour share a mesh."""
    scene = new_scene(PRODUCT)
    shared: dict[object, str] = {}
    stack = [(label, PRODUCT)]
    while stack:
        name, parent = stack.pop()
        node = pag[name]
        if node.inputs:
            scene.graph.update(name, parent, matrix=np.eye(4))
            stack += [(child, name) for child in reversed(node.inputs)]
            continue
        solid = product.solids[name]
        key = (solid.kind, solid.size, solid.mesh and solid.mesh.name, solid.rgba)
        if key not in shared:
            shared[key] = f"mesh{len(shared)}"
            scene.geometry[shared[key]] = shaded(triangles(solid), solid.rgba)
        scene.graph.update(
            name,
            parent,
            matrix=pose(solid.position, rotation(solid.quaternion)),
            geometry=shared[key],
        )
    return written(scene, binary)
