"""The shapes of LDraw parts: the search for files, packed in the model, beside it, or in a library,
and the triangles of a file and of all files that it refers to."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable, Iterator, Set
from pathlib import Path

import numpy as np

from factory.api import Diagnostic, read_text
from factory.apps.importing.draft import ImportFaults
from factory.apps.importing.ldraw.lines import (
    LDrawFile,
    Reference,
    common_colours,
    key_of,
    read_lines,
)
from factory.apps.importing.mesh_files import first_file, obj_of, path_inside
from factory.support.arrays import Array
from factory.support.texts import quoted, source_of

ROOMS = ("parts", "p", "models", "unofficial/parts", "unofficial/p")
"""The folders of a library, in the order of the search."""


class Shelf:
    """The files that a model refers to, each read once, at the first reference."""

    def __init__(self, path: Path, library: Path | None, faults: ImportFaults) -> None:
        self.library, self.faults = library, faults
        self.folders = [path.parent, *([library / room for room in ROOMS] if library else [])]
        self.files: dict[str, LDrawFile | None] = {}
        self.refused: set[str] = set()
        self.main = self._read(path, path.name)
        self.colours = common_colours()
        config = library / "LDConfig.ldr" if library else None
        if config is not None and config.is_file():
            self.colours |= self._read(config, config.name).colours
        for file in list(self.files.values()):
            self.colours |= file.colours if file else {}

    def find(self, reference: Reference) -> LDrawFile | None:
        """The file that a line refers to; None if there is none. A name outside the folders is
        noted as a fault (BadPath)."""
        key = key_of(reference.file)
        if key not in self.files:
            self.files[key] = self._search(reference)
        return self.files[key]

    def _search(self, reference: Reference) -> LDrawFile | None:
        inside = path_inside(reference.file)
        if inside is None:
            message = f"{quoted(reference.file)} is outside the model's folder and the library"
            self.faults.add("BadPath", message, reference.position, "name a file in one of them")
            self.refused.add(key_of(reference.file))
            return None
        names = dict.fromkeys((str(inside), str(inside).lower()))
        path = first_file(folder / name for folder in self.folders for name in names)
        return None if path is None else self._read(path, reference.file)

    def _read(self, path: Path, name: str) -> LDrawFile:
        files = read_lines(source_of(read_text(path), str(path)), name, self.faults)
        for file in files:
            self.files.setdefault(key_of(file.name), file)
        return files[0]


def children_first(
    root: LDrawFile,
    below: Callable[[LDrawFile, Set[int]], Iterable[LDrawFile]],
    done: Container[int],
) -> Iterator[LDrawFile]:
    """All files that `below` leads to from the root, each after the files below it; without
    recursion. `below` is called with the ids of the files on the way down, which must not occur
    again. Files whose ids are `done` are skipped."""
    stack, path = [(root, False)], set[int]()
    while stack:
        file, expanded = stack.pop()
        if expanded:
            path.remove(id(file))
            yield file
        elif id(file) not in done:
            path.add(id(file))
            stack.append((file, True))
            stack += [(child, False) for child in below(file, path)]


LDU = 0.0004
"""[m]"""

UPRIGHT = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""From LDraw's axes, -y up, to the factory's, z up."""

MOST_TRIANGLES = 1_000_000
"""The most triangles of a part: nested files multiply them."""

LIBRARY = "--library DIR names a parts library (or LDRAWDIR does); --boxes does without"
"""The hint where a part file is missing."""


def matrix(reference: Reference) -> Array:
    """The matrix (3, 3) of a reference."""
    return np.array(reference.place[3:]).reshape(3, 3)


class Shapes:
    """The triangles (n, 3, 3) of files [LDU], computed once each, or the error that prevents it."""

    def __init__(self, shelf: Shelf) -> None:
        self.shelf = shelf
        self.triangles: dict[int, Array | Diagnostic] = {}

    def of(self, file: LDrawFile) -> Array | Diagnostic:
        """The triangles of a part, or the error that prevents them."""
        for current in children_first(file, self._below, self.triangles):
            if id(current) not in self.triangles:
                self._join(current)
        return self.triangles[id(file)]

    def _below(self, file: LDrawFile, path: Set[int]) -> list[LDrawFile]:
        files = []
        for reference in file.references:
            below = self.shelf.find(reference)
            if below is not None and id(below) in path:
                message = f"{quoted(reference.file)} contains itself"
                self._lacks(file, "CyclicModel", message, reference, "remove the line")
            elif below is not None:
                files.append(below)
        return files

    def _lacks(self, file: LDrawFile, code: str, message: str, at: Reference, hint: str) -> None:
        self.triangles.setdefault(id(file), Diagnostic(code, message, at.position, hint))

    def _join(self, file: LDrawFile) -> None:
        """The triangles of a file whose sub-files are done."""
        pieces, count = [np.array(file.triangles).reshape(-1, 3, 3)], len(file.triangles)
        for reference in file.references:
            below = self.shelf.find(reference)
            if below is None:
                message = f"there is no part file {quoted(reference.file)}"
                self._lacks(file, "MissingPart", message, reference, LIBRARY)
                return
            triangles = self.triangles[id(below)]
            if isinstance(triangles, Diagnostic):
                self.triangles[id(file)] = triangles
                return
            count += len(triangles)
            if count > MOST_TRIANGLES:
                message = f"{quoted(file.name)} has more than {MOST_TRIANGLES} triangles"
                self._lacks(file, "TooLarge", message, reference, "use a simpler part")
                return
            pieces.append(_placed(triangles, reference))
        self.triangles[id(file)] = np.concatenate(pieces)


def _placed(triangles: Array, reference: Reference) -> Array:
    """Triangles as a reference places them; a mirror reverses the order of their corners."""
    turn = matrix(reference)
    moved = triangles @ turn.T + np.array(reference.place[:3])
    inside_out = reference.inverted != (np.linalg.det(turn) < 0)
    return np.asarray(moved[:, ::-1] if inside_out else moved)


def mesh_of(triangles: Array, turn: Array) -> bytes | None:
    """An OBJ file [m], z up, of triangles [LDU] transformed by `turn`; None if it is empty."""
    import trimesh

    corners = triangles @ turn.T @ UPRIGHT.T * LDU
    if np.linalg.det(turn) < 0:
        corners = corners[:, ::-1]
    corners = np.round(corners, 7) + 0.0
    points, faces = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    body = trimesh.Trimesh(points, faces.reshape(-1, 3), process=False)
    body.update_faces(body.nondegenerate_faces())
    if not len(body.faces):
        return None
    if body.is_watertight and body.is_winding_consistent and body.volume < 0:
        body.invert()
    comment = "made by factory import from LDraw parts; metres, z up"
    return obj_of(points, np.asarray(body.faces), comment)
