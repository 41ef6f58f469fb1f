"""The triangles of a mesh file, separated by bodies, and the reason why a file has none."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from factory.support.arrays import Array, Indices
from factory.support.meshes.merging import merged_vertices
from factory.support.meshes.triangles import areas_of, joined

__all__ = ["ANEW", "EXPECTED", "MeshFile", "UnreadableMesh", "checked"]

EXPECTED = {
    ".obj": "an OBJ file (lines 'v x y z' for vertices, 'f 1 2 3' for faces)",
    ".stl": "an STL file (84 bytes and 50 more a triangle, or a text that begins with 'solid')",
    ".ply": "a PLY file (a header from 'ply' to 'end_header', then all its vertices and faces)",
    ".glb": "a GLB file (binary glTF 2.0, complete, with triangles that are not compressed)",
    ".off": "an OFF file (a line 'OFF', numbers of vertices, faces and edges, then these)",
    ".3mf": "a 3MF file (a ZIP archive with 3D/3dmodel.model)",
    ".step": "a STEP file (ISO 10303-21, which begins with 'ISO-10303-21;', with solids in it)",
}
"""A description of each file format."""

ANEW = "export it again as .obj, .stl, .ply or .glb with triangles"
"""The hint for a file that cannot be read."""


class UnreadableMesh(Exception):
    """The reason why a file is not a mesh, as a sentence about the file: "it has no triangles"."""


@dataclass(frozen=True, slots=True)
class MeshFile:
    """The triangles of a file by body: vertices (n, 3) and faces (m, 3) of each, in the file's
    unit."""

    bodies: tuple[tuple[Array, Indices], ...] = field(repr=False)

    def merged(self) -> tuple[Array, Indices]:
        """All triangles, with vertices merged; degenerate triangles are omitted, unless all are."""
        return _merged(*joined(self.bodies))

    def areas(self) -> Array:
        """The area of each body."""
        return np.array([areas_of(*body).sum() for body in self.bodies])


def checked(bodies: Iterable[tuple[Array, Indices]], suffix: str) -> MeshFile:
    """The bodies that have triangles. Raises UnreadableMesh if none has, or one is invalid."""
    meshes = [(vertices, faces) for vertices, faces in bodies if len(faces)]
    if not meshes:
        raise UnreadableMesh(f"it has no triangles; it should be {EXPECTED[suffix]}")
    for vertices, faces in meshes:
        if not 0 <= faces.min() <= faces.max() < len(vertices):
            raise UnreadableMesh("a triangle refers to a vertex that does not exist")
        if not np.isfinite(vertices[faces]).all():
            raise UnreadableMesh("it has vertices that are not finite (nan or inf)")
    return MeshFile(tuple(meshes))


def _merged(vertices: Array, faces: Indices) -> tuple[Array, Indices]:
    vertices, merged = merged_vertices(vertices, faces)
    whole = (merged != np.roll(merged, 1, axis=1)).all(axis=1)
    return vertices, merged[whole] if whole.any() else merged
