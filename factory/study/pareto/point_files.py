"""The files that reproduce a point of a front: its plan and its layout, with the meshes of all
points beside them."""

from __future__ import annotations

import shlex
from dataclasses import replace
from pathlib import Path, PurePosixPath

from factory.importing.mesh_files import MeshStore
from factory.lang.writer import write_pag
from factory.problem.pag import PAG, Assembly
from factory.record.plan_file import PLAN_NAME, plan_files
from factory.study.pareto.front import ParetoFront
from factory.support.files import MESH, read_bytes

MESHES = "meshes"
"""A folder that all points share."""


def point_name(number: int) -> str:
    """The folder of a point of a front, counted from 0."""
    return f"p{number + 1:02d}"


def command_of(file: Path) -> str:
    """The command that builds and runs a point whose plan is in a file."""
    return shlex.join(["factory", "run", str(file)])


def commands_of(front: ParetoFront, folder: Path) -> list[str]:
    """The commands of all points, in their order."""
    return [
        command_of(folder / point_name(number) / PLAN_NAME) for number in range(len(front.points))
    ]


def point_files(front: ParetoFront, folder: Path) -> dict[Path, bytes]:
    """The files of all points in a folder. Meshes are copied into the folder, whatever their paths
    in the input. Raises OSError where a mesh no longer exists."""
    store, files = MeshStore(MESHES), dict[Path, bytes]()
    kept: dict[tuple[str, str], str] = {}
    for number, point in enumerate(front.points):
        pag = write_pag(_with_meshes(point.project.pag, store, kept))
        laid = point.predicted is not None
        files |= plan_files(point.project, folder / point_name(number), pag, laid)
    return files | {folder / path: content for path, content in store.files.items()}


def _with_meshes(pag: PAG, store: MeshStore, kept: dict[tuple[str, str], str]) -> PAG:
    """The PAG with its meshes in a store; `kept`: their paths there, by folder and path."""
    return replace(pag, nodes=tuple(_with_mesh(node, pag, store, kept) for node in pag.nodes))


def _with_mesh(
    node: Assembly, pag: PAG, store: MeshStore, kept: dict[tuple[str, str], str]
) -> Assembly:
    mesh = node.parameter("mesh")
    if mesh is None:
        return node
    path = str(mesh)
    if (pag.folder, path) not in kept:
        name = PurePosixPath(path.replace("\\", "/"))
        content = read_bytes(Path(pag.folder) / path, MESH)
        kept[pag.folder, path] = f"../{store.add(name.stem, name.suffix.lower(), content)}"
    stored = kept[pag.folder, path]
    return replace(
        node,
        parameters=tuple(
            replace(p, value=stored) if p.name == "mesh" else p for p in node.parameters
        ),
    )
