"""glTF 2.0 in metres, y upwards as its standard has it: the finished product, or a sub-assembly
(`--of LABEL`), in the parts' colours, as a tree of nodes with the labels as names; .glb or .gltf by
the ending of the file; into a folder, a .glb for every label."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from factory.export.bodies import triangles, wanted
from factory.export.subject import Subject
from factory.geometry.meshes import Array, Indices, Mesh
from factory.geometry.solids import Product, Solid, rotation
from factory.mjcf.mesh_files import corner_normals
from factory.problem.pag import PAG

FORMAT, TAKES, BINARY, FOLDER, OF = "gltf", "pag", True, True, "a label"

UPRIGHT = ((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.0, -1.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
"""From z upwards to y upwards."""

WORLD, PRODUCT = "/world", "/product"
"""The outermost nodes; no label has a slash."""


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
    import trimesh

    scene = trimesh.Scene(base_frame=WORLD)
    scene.graph.update(PRODUCT, WORLD, matrix=np.array(UPRIGHT))
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
            scene.geometry[shared[key]] = _shaded(solid)
        scene.graph.update(name, parent, matrix=_pose(solid), geometry=shared[key])
    gltf = trimesh.exchange.gltf
    if binary:
        return bytes(gltf.export_glb(scene, include_normals=True))
    inside = {"merge_buffers": True, "embed_buffers": True}
    return bytes(gltf.export_gltf(scene, include_normals=True, **inside)["model.gltf"])


def _pose(solid: Solid) -> Array:
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation(solid.quaternion), solid.position
    return matrix


def _shaded(solid: Solid) -> Any:
    """A part with normals that are smooth on rounded surfaces and sharp at edges."""
    import trimesh

    mesh = triangles(solid)
    vertices, faces, normals = _unwelded(mesh)
    body = trimesh.Trimesh(vertices, faces, vertex_normals=normals, process=False)
    closed = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).is_watertight
    material = trimesh.visual.material.PBRMaterial(
        baseColorFactor=np.array([round(255 * c) for c in solid.rgba], np.uint8),
        metallicFactor=0.1,
        roughnessFactor=0.6,
        doubleSided=not closed,
        alphaMode="BLEND" if solid.rgba[3] < 1 else "OPAQUE",
    )
    body.visual = trimesh.visual.TextureVisuals(material=material)
    return body


def _unwelded(mesh: Mesh) -> tuple[Array, Indices, Array]:
    """Vertices, faces and normals in which a corner has a vertex for each of its normals."""
    corners = np.concatenate(
        [mesh.vertices[mesh.faces], np.round(corner_normals(mesh), 6)], axis=2
    ).reshape(-1, 6)
    found, index = np.unique(corners, axis=0, return_inverse=True)
    return found[:, :3], index.reshape(-1, 3).astype(np.int64), found[:, 3:]
