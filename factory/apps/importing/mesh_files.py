"""Mesh files of an imported product: the search for them, and their names in the output."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace
from hashlib import sha256
from pathlib import Path, PurePosixPath

import numpy as np

from factory.api import Assembly
from factory.apps.importing.draft import file_stem
from factory.support.arrays import Array, Indices
from factory.support.files import MESH, read_bytes


def path_inside(name: str) -> PurePosixPath | None:
    """The relative path of a name in a file; None if it leads out of its folder."""
    inside = PurePosixPath(name.replace("\\", "/"))
    if inside.is_absolute() or ".." in inside.parts or ":" in name or "\0" in name:
        return None
    return inside


def first_file(paths: Iterable[Path]) -> Path | None:
    """The first of these paths that is a file."""
    for path in paths:
        try:
            if path.is_file():
                return path
        except (OSError, ValueError):
            continue
    return None


class MeshStore:
    """The mesh files to be written: contents by path in the output folder. Equal contents are
    stored once, under names that stay in their folder."""

    def __init__(self, folder: str) -> None:
        self.folder = folder
        self.files: dict[str, bytes] = {}
        self._names: dict[tuple[str, str], str] = {}
        self._taken: set[str] = set()
        self._read: dict[Path, str] = {}

    def add(self, name: str, suffix: str, content: bytes) -> str:
        """The path of a mesh with this content, named as similar to `name` as possible."""
        stem, digest = file_stem(name), sha256(content).hexdigest()
        key = (digest, suffix)
        if key not in self._names:
            if f"{stem}{suffix}".lower() in self._taken:
                stem = f"{stem}-{digest[:12]}"
            self._taken.add(f"{stem}{suffix}".lower())
            self._names[key] = path = f"{self.folder}/{stem}{suffix}"
            self.files[path] = content
        return self._names[key]

    def keep(self, node: Assembly, folder: str, above: str = "") -> Assembly:
        """A node whose mesh, if it has one, is in this store, which lies in a folder `above` it.
        Raises OSError where the mesh cannot be read from the node's `folder`."""
        if (mesh := node.parameter("mesh")) is None:
            return node
        path = Path(folder) / str(mesh)
        if path not in self._read:
            name = PurePosixPath(str(mesh).replace("\\", "/"))
            self._read[path] = self.add(name.stem, name.suffix.lower(), read_bytes(path, MESH))
        kept = above + self._read[path]
        values = (replace(p, value=kept) if p.name == "mesh" else p for p in node.parameters)
        return replace(node, parameters=tuple(values))


def obj_of(vertices: Array, faces: Indices, comment: str) -> bytes:
    """An OBJ file with a comment in its first line."""
    lines = [f"# {comment}"]
    lines += [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in (np.round(vertices, 9) + 0.0).tolist()]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces.tolist()]
    return ("\n".join(lines) + "\n").encode()


def natural(name: str) -> tuple[tuple[int, str], ...]:
    """Sort key of names with numbers: `part2` comes before `part10`."""
    words = re.split(r"(\d+)", name.lower())
    return tuple((int(word), "") if word.isdigit() else (-1, word) for word in words)
