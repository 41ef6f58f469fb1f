"""Mesh files: what the engine reads and draws. Shape and mass are settled elsewhere; this is about
looks.

A closed mesh is written as STL. One that is open, or wound to and fro, as most CAD exports are,
would be drawn with holes: it is written as OBJ with every triangle seen from both sides, and with
normals that are smooth over rounded surfaces and sharp at edges. So is a mesh of several bodies,
that is to look as if of one; what collides in its place is written as STL, a file a body."""

from __future__ import annotations

import io

import numpy as np

from factory.floor.geometry.insets import inset
from factory.floor.geometry.meshes import Mesh
from factory.support.arrays import Array, Indices
from factory.support.meshes.triangles import convex_hull, corner_normals, stl


def mesh_file(mesh: Mesh) -> tuple[str, bytes]:
    """The file of a mesh: name and content."""
    import trimesh

    body = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    if mesh.pieces:
        body.merge_vertices()
        outside = Mesh(mesh.name, np.asarray(body.vertices), np.asarray(body.faces))
        return f"{mesh.name}.obj", obj(
            outside.vertices, outside.faces, corner_normals(outside.vertices, outside.faces)
        )
    if body.is_watertight and body.is_winding_consistent and body.volume > 0:
        return f"{mesh.name}.stl", stl(mesh.vertices, mesh.faces)
    return f"{mesh.name}.obj", two_sided_obj(mesh)


def piece_files(mesh: Mesh) -> list[tuple[str, bytes]]:
    """The files of the convex bodies that collide in a mesh's place: names, counted from 1, and
    contents."""
    named = ((f"{mesh.name}.{n}", vertices) for n, vertices in enumerate(mesh.pieces, 1))
    return [(f"{name}.stl", stl(*convex_hull(vertices))) for name, vertices in named]


def inset_name(mesh: Mesh, number: int, depth: float) -> str:
    """The name of a mesh's convex body, counted from 0, whose faces recede by `depth` [m]."""
    receded = f"-{round(depth * 1e6)}" if depth else ""
    return f"{mesh.name}.{number + 1}{receded}"


def inset_file(mesh: Mesh, number: int, depth: float) -> tuple[str, bytes]:
    """The file of that body: name and content. A mesh without pieces has one, its hull."""
    name = inset_name(mesh, number, depth)
    whole = mesh.pieces[number] if mesh.pieces else mesh.vertices
    return f"{name}.stl", stl(*convex_hull(inset(whole, depth)))


def two_sided_obj(mesh: Mesh) -> bytes:
    """A mesh as an OBJ file in which every triangle has a back too, lit from its own side."""
    normals = corner_normals(mesh.vertices, mesh.faces)
    return obj(
        mesh.vertices,
        np.concatenate([mesh.faces, mesh.faces[:, ::-1]]),
        np.concatenate([normals, -normals[:, ::-1]]),
    )


def obj(vertices: Array, faces: Indices, normals: Array) -> bytes:
    """An OBJ file of triangles (m, 3) with a normal at each corner (m, 3, 3)."""
    across, inverse = np.unique(np.round(normals.reshape(-1, 3), 4), axis=0, return_inverse=True)
    indices = np.stack([faces, inverse.reshape(-1, 3)], axis=2).reshape(-1, 6) + 1
    text = io.StringIO()
    np.savetxt(text, vertices, fmt="v %.9g %.9g %.9g")
    np.savetxt(text, across, fmt="vn %.4f %.4f %.4f")
    np.savetxt(text, indices, fmt="f %d//%d %d//%d %d//%d")
    return text.getvalue().encode()
