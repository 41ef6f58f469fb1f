"""Mesh files as triangles.

STL, PLY and GLB are read with trimesh. Of an OBJ the corners and faces alone are read: normals,
texture and materials would split a vertex at every seam. What is wrong with a file is a sentence
about the file, whatever a library says of it.
"""

from __future__ import annotations

import io
import logging
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import pairwise
from math import isfinite

import numpy as np

from factory.geometry.meshes import Array, Indices
from factory.geometry.pieces import joined

EXPECTED = {
    ".obj": "an OBJ file (lines 'v x y z' for vertices, 'f 1 2 3' for faces)",
    ".stl": "an STL file (84 bytes and 50 more a triangle, or a text that begins with 'solid')",
    ".ply": "a PLY file (a header from 'ply' to 'end_header', then all its vertices and faces)",
    ".glb": "a GLB file (binary glTF 2.0, complete, with triangles that are not compressed)",
    ".off": "an OFF file (a line 'OFF', numbers of vertices, faces and edges, then these)",
    ".3mf": "a 3MF file (a ZIP archive with 3D/3dmodel.model)",
    ".step": "a STEP file (ISO 10303-21, which begins with 'ISO-10303-21;', with solids in it)",
}
"""What a file of a suffix should hold."""

EMPTY_STL = 84
"""Bytes of a binary STL file without triangles."""

ANEW = "export it again as .obj, .stl, .ply or .glb with triangles"
"""The way out of a file that cannot be read."""


class UnreadableMesh(Exception):
    """Why a file is no mesh, as a sentence about the file: "it has no triangles"."""


@dataclass(frozen=True, slots=True)
class MeshFile:
    """The triangles of a file, by the bodies that it keeps apart: vertices (n, 3) and faces (m, 3)
    of each, in the file's unit."""

    bodies: tuple[tuple[Array, Indices], ...] = field(repr=False)

    def merged(self) -> tuple[Array, Indices]:
        """All triangles, with one vertex at a place; those with fewer than three corners are left
        out, if any others are there."""
        return _merged(*joined(self.bodies))


def read_mesh(content: bytes, suffix: str) -> MeshFile:
    """The triangles in a file with this suffix, lower case. Raises UnreadableMesh."""
    if not content.strip():
        raise UnreadableMesh("it is empty")
    return checked([_obj(content)] if suffix == ".obj" else _by_trimesh(content, suffix), suffix)


def checked(bodies: Iterable[tuple[Array, Indices]], suffix: str) -> MeshFile:
    """The bodies that have triangles. Raises UnreadableMesh where none has, or one is broken."""
    found = [(vertices, faces) for vertices, faces in bodies if len(faces)]
    if not found:
        raise UnreadableMesh(f"it has no triangles; it should be {EXPECTED[suffix]}")
    for vertices, faces in found:
        if not 0 <= faces.min() <= faces.max() < len(vertices):
            raise UnreadableMesh("a triangle has a vertex that is not there")
        if not np.isfinite(vertices[faces]).all():
            raise UnreadableMesh("it has vertices that are not finite (nan or inf)")
    return MeshFile(tuple(found))


def _merged(vertices: Array, faces: Indices) -> tuple[Array, Indices]:
    import trimesh

    body = trimesh.Trimesh(vertices, faces, process=False)
    body.merge_vertices()
    found = np.asarray(body.faces)
    whole = (found != np.roll(found, 1, axis=1)).all(axis=1)
    return np.asarray(body.vertices), found[whole] if whole.any() else found


def _by_trimesh(content: bytes, suffix: str) -> list[tuple[Array, Indices]]:
    """The bodies of a file that trimesh reads, where they stand."""
    import trimesh

    with reading(suffix):
        scene = trimesh.load_scene(io.BytesIO(content), file_type=suffix[1:], process=False)
        found = [body for body in scene.dump() if isinstance(body, trimesh.Trimesh)]
        if suffix == ".stl" and not found and len(content) != EMPTY_STL:
            content.decode()  # without triangles it is a text, or no STL file at all
        return [(np.array(b.vertices, float), np.array(b.faces, np.int64)) for b in found]


@contextmanager
def reading(suffix: str) -> Iterator[None]:
    """Within it trimesh reads a file with this suffix, without a word; what it raises is an
    UnreadableMesh, unless it is one already."""
    logger, level = logging.getLogger("trimesh"), logging.getLogger("trimesh").level
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            logger.setLevel(logging.CRITICAL)
            yield
    except UnreadableMesh:
        raise
    except Exception as error:  # trimesh's readers raise anything on a broken file
        raise UnreadableMesh(f"it is not {EXPECTED[suffix]}") from error
    finally:
        logger.setLevel(level)


def _obj(content: bytes) -> tuple[Array, Indices]:
    """The vertices and triangles of an OBJ file; a face of more corners is a fan of triangles.
    Raises UnreadableMesh with the line that is wrong."""
    vertices: list[tuple[float, ...]] = []
    faces: list[tuple[int, ...]] = []
    text = content.decode("utf-8", "replace").replace("\\\r\n", " ").replace("\\\n", " ")
    for number, line in enumerate(text.split("\n"), 1):
        words = line.partition("#")[0].split()
        if words[:1] == ["v"]:
            vertices.append(_vertex(words[1:4], number))
        elif words[:1] == ["f"]:
            first, *others = _corners(words[1:], number, len(vertices))
            faces += [(first, *pair) for pair in pairwise(others)]
    if not vertices and not faces:
        raise UnreadableMesh(f"it is not {EXPECTED['.obj']}")
    if max(map(max, faces), default=-1) >= len(vertices):
        message = f"a face has the vertex {max(map(max, faces)) + 1}, but there are {len(vertices)}"
        raise UnreadableMesh(message)
    return np.array(vertices, float).reshape(-1, 3), np.array(faces, np.int64).reshape(-1, 3)


def _vertex(words: list[str], line: int) -> tuple[float, ...]:
    try:
        x, y, z = map(float, words)
    except ValueError:
        raise UnreadableMesh(f"line {line} has no vertex: 'v x y z' takes three numbers") from None
    if not all(map(isfinite, (x, y, z))):
        message = f"line {line} has a vertex that is not finite: {' '.join(words)}"
        raise UnreadableMesh(message)
    return x, y, z


def _corners(words: list[str], line: int, count: int) -> list[int]:
    """The vertices of a face, from 0, given `count` of them so far: -1 is the last of these. What
    follows a slash is about texture and normals."""
    try:
        given = [int(word.partition("/")[0]) for word in words]
    except ValueError:
        given = []
    if len(given) < 3:
        message = f"line {line} has no face: 'f 1 2 3' takes three vertices or more, by number"
        raise UnreadableMesh(message)
    found = [n - 1 if n > 0 else n + count for n in given]
    if 0 in given or min(found) < 0:
        wrong = next(n for n, at in zip(given, found, strict=True) if n == 0 or at < 0)
        raise UnreadableMesh(f"line {line} has a face with a vertex that is not there: {wrong}")
    return found
