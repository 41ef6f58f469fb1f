"""Mesh files of an imported product: where they are found, and what they are called when copied."""

from __future__ import annotations

from collections.abc import Iterable
from hashlib import sha256
from pathlib import Path, PurePosixPath

from factory.geometry.mesh_file import ANEW, UnreadableMesh
from factory.geometry.mesh_reader import read_mesh
from factory.importing.draft import ImportFaults
from factory.importing.labels import file_stem
from factory.lang.operations import MESHES
from factory.lang.source import near_file, quoted
from factory.support.errors import Position
from factory.support.files import MESH, read_bytes


def path_inside(name: str) -> PurePosixPath | None:
    """The relative path that a name in a file stands for; None where it leads out of its folder."""
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
    """The mesh files to be written: contents by path in the output folder. Equal ones are there
    once, under names that stay in their folder."""

    def __init__(self, folder: str) -> None:
        self.folder = folder
        self.files: dict[str, bytes] = {}
        self._names: dict[tuple[str, str], str] = {}
        self._taken: set[str] = set()

    def add(self, name: str, suffix: str, content: bytes) -> str:
        """The path of a mesh with this content, called as nearly as can be `name`."""
        stem, digest = file_stem(name), sha256(content).hexdigest()
        key = (digest, suffix)
        if key not in self._names:
            if f"{stem}{suffix}".lower() in self._taken:
                stem = f"{stem}-{digest[:12]}"
            self._taken.add(f"{stem}{suffix}".lower())
            self._names[key] = path = f"{self.folder}/{stem}{suffix}"
            self.files[path] = content
        return self._names[key]


class MeshFolder:
    """The folder that the meshes of a tree or a bill are in. Each is read once, and put in the
    store."""

    def __init__(self, folder: Path, store: MeshStore, faults: ImportFaults) -> None:
        self.folder, self.store, self.faults = folder, store, faults
        self.found: dict[str, str | None] = {}

    def path(self, name: str, position: Position) -> str | None:
        """Where a mesh is in the output; None where something is wrong with it, which is noted for
        each place that names it (BadPath, UnknownMesh, BadMesh)."""
        if self.found.get(name) is None:
            self.found[name] = self._fetch(name, position)
        return self.found[name]

    def _fetch(self, name: str, position: Position) -> str | None:
        inside = path_inside(name)
        if inside is None:
            message = f"{quoted(name)} leads out of the folder of the meshes"
            hint = "put the mesh in that folder, or name another by --meshes DIR"
            self.faults.add("BadPath", message, position, hint)
            return None
        named = inside.suffix.lower() in MESHES
        suffixes = ([""] if named else []) + list(MESHES)
        path = first_file(self.folder / f"{inside}{suffix}" for suffix in suffixes)
        if path is None:
            message = f"there is no mesh {quoted(name)} in {quoted(str(self.folder))}"
            wanted = str(inside) if named else f"{inside}{MESHES[1]}"
            hint = near_file(str(self.folder), wanted) or "--meshes DIR names another folder"
            self.faults.add("UnknownMesh", message, position, hint)
            return None
        content = read_bytes(path, MESH)
        try:
            read_mesh(content, path.suffix.lower())
        except UnreadableMesh as error:
            self.faults.add("BadMesh", f"cannot read {quoted(name)}: {error}", position, ANEW)
            return None
        return self.store.add(str(inside.with_suffix("")), path.suffix.lower(), content)
