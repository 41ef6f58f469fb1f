"""The folder that a tree's or a bill's meshes are in."""

from __future__ import annotations

import io
from pathlib import Path, PurePosixPath

import numpy as np

from factory.importing.draft import ImportFaults
from factory.importing.mesh_store import MeshStore
from factory.lang.operations import MESHES
from factory.lang.source import near_file, quoted
from factory.support.errors import Position


class MeshFolder:
    """Finds meshes by name, reads each once, and puts them in the store."""

    def __init__(self, folder: Path, store: MeshStore, faults: ImportFaults) -> None:
        self.folder, self.store, self.faults = folder, store, faults
        self.found: dict[str, str | None] = {}

    def path(self, name: str, position: Position) -> str | None:
        """Where a mesh is in the output; None where something is wrong with it, which is noted for
        each place that names it (BadPath, UnknownMesh, BadMesh)."""
        if name not in self.found or self.found[name] is None:
            self.found[name] = self._fetch(name, position)
        return self.found[name]

    def _fetch(self, name: str, position: Position) -> str | None:
        inside = PurePosixPath(name.replace("\\", "/"))
        if inside.is_absolute() or ".." in inside.parts or ":" in name or "\0" in name:
            message = f"{quoted(name)} leads out of the folder of the meshes"
            hint = "put the mesh in that folder, or name another by --meshes DIR"
            self.faults.add("BadPath", message, position, hint)
            return None
        path = self._file(inside)
        if path is None:
            message = f"there is no mesh {quoted(name)} in {quoted(str(self.folder))}"
            wanted = str(inside) if inside.suffix.lower() in MESHES else f"{inside}{MESHES[1]}"
            hint = near_file(str(self.folder), wanted) or "--meshes DIR names another folder"
            self.faults.add("UnknownMesh", message, position, hint)
            return None
        content = path.read_bytes()
        trouble = _trouble(content, path.suffix.lower())
        if trouble:
            hint = "export it again as .obj, .stl, .ply or .glb with triangles"
            self.faults.add("BadMesh", f"cannot read {quoted(name)}: {trouble}", position, hint)
            return None
        return self.store.add(str(inside.with_suffix("")), path.suffix.lower(), content)

    def _file(self, inside: PurePosixPath) -> Path | None:
        """The file of a name; its suffix may be left out."""
        names = [str(inside)] if inside.suffix.lower() in MESHES else []
        names += [f"{inside}{suffix}" for suffix in MESHES]
        for name in names:
            try:
                if (self.folder / name).is_file():
                    return self.folder / name
            except (OSError, ValueError):
                continue
        return None


def _trouble(content: bytes, suffix: str) -> str:
    """What keeps a file from being a mesh; "" if nothing does."""
    import trimesh

    try:
        found = trimesh.load(io.BytesIO(content), file_type=suffix[1:], force="mesh")
        if len(found.faces) == 0 or not np.isfinite(np.asarray(found.vertices)).all():
            return "it has no triangles, or vertices that are not finite"
    except ImportError:
        return "its content is no mesh"
    except Exception as error:  # trimesh's readers raise anything on a broken file
        return str(error) or type(error).__name__
    return ""
