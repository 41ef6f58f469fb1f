"""Mesh files as triangles.

STL, PLY and OFF are read with trimesh. Of an OBJ file only vertices and faces are read: normals,
texture and materials would split a vertex at every seam. An error is a sentence about the file,
whatever message a library gives.
"""

from __future__ import annotations

import io
import logging
import warnings
from itertools import pairwise
from math import isfinite
from typing import TYPE_CHECKING

import numpy as np

from factory.support.arrays import Array, Indices
from factory.support.meshes.glb_reader import MOST, read_glb
from factory.support.meshes.mesh_file import EXPECTED, MeshFile, UnreadableMesh, checked

__all__ = ["read_mesh"]

if TYPE_CHECKING:
    import trimesh

EMPTY_STL = 84
"""The size of a binary STL file without triangles [bytes]."""

LINE = 100_000
"""The longest line of an OBJ file [characters]: a longer face is not a polygon."""


def read_mesh(content: bytes, suffix: str) -> MeshFile:
    """The triangles in a file with this suffix, lower case. Raises UnreadableMesh."""
    if not content.strip():
        raise UnreadableMesh("it is empty")
    if suffix == ".obj":
        return checked([_obj(content)], suffix)
    if suffix == ".glb":
        return checked([mesh for body in read_glb(content) for mesh in body.bodies], suffix)
    return checked(_by_trimesh(content, suffix), suffix)


def _by_trimesh(content: bytes, suffix: str) -> list[tuple[Array, Indices]]:
    """The bodies of a file that trimesh reads, in place."""
    bodies = _loaded(content, suffix)
    if suffix == ".stl" and not bodies and len(content) != EMPTY_STL and not _is_text(content):
        raise UnreadableMesh(f"it is not {EXPECTED[suffix]}")
    return [(np.array(b.vertices, float), np.array(b.faces, np.int64)) for b in bodies]


def _is_text(content: bytes) -> bool:
    try:
        content.decode()
    except UnicodeDecodeError:
        return False
    return True


def _loaded(content: bytes, suffix: str) -> list[trimesh.Trimesh]:
    """The meshes that trimesh reads, without its warnings. Raises UnreadableMesh."""
    import trimesh

    logger, level = logging.getLogger("trimesh"), logging.getLogger("trimesh").level
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            logger.setLevel(logging.CRITICAL)
            scene = trimesh.load_scene(io.BytesIO(content), file_type=suffix[1:], process=False)
            return [body for body in scene.dump() if isinstance(body, trimesh.Trimesh)]
    except MemoryError:
        raise UnreadableMesh("there is not enough memory to read it") from None
    except Exception as error:  # trimesh's readers raise anything on a broken file
        raise UnreadableMesh(f"it is not {EXPECTED[suffix]}") from error
    finally:
        logger.setLevel(level)


def _obj(content: bytes) -> tuple[Array, Indices]:
    """The vertices and triangles of an OBJ file; a face with more corners becomes a fan of
    triangles. Raises UnreadableMesh with the invalid line."""
    if (plain := _plain_obj(content)) is not None:
        return plain
    vertices: list[tuple[float, ...]] = []
    faces: list[tuple[int, ...]] = []
    text = content.decode("utf-8", "replace").replace("\\\r\n", " ").replace("\\\n", " ")
    for number, line in enumerate(text.split("\n"), 1):
        if len(line) > LINE:
            raise UnreadableMesh(f"line {number} has more than {LINE} characters")
        if max(len(vertices), len(faces)) > MOST:
            raise UnreadableMesh(f"it has more than {MOST} vertices or triangles")
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


def _plain_obj(content: bytes) -> tuple[Array, Indices] | None:
    """The vertices and triangles of a file of nothing but `v x y z`, `f a b c` and comments, read
    fast; None if it has anything else, or is not valid."""
    lines = content.split(b"\n")
    rows = [[line[2:] for line in lines if line.startswith(kind)] for kind in (b"v ", b"f ")]
    others = (line for line in lines if not line.startswith((b"v ", b"f ")))
    if any(line.strip() and not line.startswith(b"#") for line in others):
        return None
    try:
        vertices, faces = (
            np.array([row.split() for row in some], kind)
            for some, kind in zip(rows, (float, np.int64), strict=True)
        )
    except ValueError:
        return None
    shaped = vertices.shape[1:] == faces.shape[1:] == (3,) and max(map(len, rows)) <= MOST
    if not shaped or not np.isfinite(vertices).all():
        return None
    return (vertices, faces - 1) if 0 < faces.min() <= faces.max() <= len(vertices) else None


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
    """The vertices of a face, from 0, after `count` vertices: -1 is the last of these. Texture and
    normals after a slash are ignored."""
    try:
        numbers = [int(word.partition("/")[0]) for word in words]
    except ValueError:
        numbers = []
    if len(numbers) < 3:
        message = f"line {line} has no face: 'f 1 2 3' takes three vertices or more, by number"
        raise UnreadableMesh(message)
    corners = [n - 1 if n > 0 else n + count for n in numbers]
    if 0 in numbers or min(corners) < 0:
        wrong = next(n for n, at in zip(numbers, corners, strict=True) if n == 0 or at < 0)
        raise UnreadableMesh(f"line {line} has a face with a vertex that does not exist: {wrong}")
    return corners
