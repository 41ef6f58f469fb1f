"""glTF 2.0 in metres, y upwards (the standard's axes): the finished product, or a sub-assembly
(`--of LABEL`), in the parts' colours, as a tree of nodes with the labels as names; .glb or .gltf by
the ending of the file; into a folder, a .glb for every label."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from factory.api import PAG, Mesh, Product
from factory.apps.exports.subject import Subject, triangles, wanted
from factory.support.arrays import Array, Indices
from factory.support.meshes.glb_reader import UPRIGHT
from factory.support.meshes.triangles import corner_normals
from factory.support.rotations import rotation

WORLD = "/world"
"""The outermost node."""


def new_scene(root: str) -> Any:
    """An empty scene with a node, in whose frame z is upwards."""
    import trimesh

    scene = trimesh.Scene(base_frame=WORLD)
    scene.graph.update(root, WORLD, matrix=UPRIGHT.T)
    return scene


def written(scene: Any, binary: bool) -> bytes:
    """A scene as a file, binary or as JSON with its buffer inside (section 4.4)."""
    import trimesh

    gltf = trimesh.exchange.gltf
    options: dict[str, Any] = {"tree_postprocessor": _linear_colours}
    if binary:
        return bytes(gltf.export_glb(scene, include_normals=True, **options))
    options |= {"merge_buffers": True, "embed_buffers": True}
    return bytes(gltf.export_gltf(scene, include_normals=True, **options)["model.gltf"])


def _linear_colours(document: Any) -> None:
    """Make the colours of a document, which are in sRGB, linear (section 3.9.2)."""
    for material in document.get("materials", ()):
        surface = material["pbrMetallicRoughness"]
        *light, opacity = surface["baseColorFactor"]
        surface["baseColorFactor"] = [*map(linear, light), opacity]


def pose(position: ArrayLike, turn: ArrayLike) -> Array:
    """A place (3,) and a rotation (3, 3) as one matrix (4, 4)."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn, position
    return matrix


def shaded(mesh: Mesh, rgba: ArrayLike) -> Any:
    """A mesh in a colour, with normals smooth on rounded surfaces and discontinuous at edges."""
    import trimesh

    vertices, faces, normals = _unwelded(mesh)
    body = trimesh.Trimesh(vertices, faces, vertex_normals=normals, process=False)
    closed = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).is_watertight
    paint = np.round(255 * np.asarray(rgba, float)).astype(np.uint8)
    material = trimesh.visual.material.PBRMaterial(
        baseColorFactor=paint,
        metallicFactor=0.1,
        roughnessFactor=0.6,
        doubleSided=not closed,
        alphaMode="BLEND" if paint[3] < 255 else "OPAQUE",
    )
    body.visual = trimesh.visual.TextureVisuals(material=material)
    return body


def _unwelded(mesh: Mesh) -> tuple[Array, Indices, Array]:
    """Vertices, faces and normals, with a vertex for each distinct normal at a corner."""
    corners = np.concatenate(
        [mesh.vertices[mesh.faces], np.round(corner_normals(mesh.vertices, mesh.faces), 6)], axis=2
    ).reshape(-1, 6)
    distinct, index = np.unique(corners, axis=0, return_inverse=True)
    return distinct[:, :3], index.reshape(-1, 3).astype(np.int64), distinct[:, 3:]


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


def linear(component: float) -> float:
    """The inverse of `gamma_encoded`."""
    encoded = component / 12.92 if component <= 0.04045 else ((component + 0.055) / 1.055) ** 2.4
    return float(encoded)
