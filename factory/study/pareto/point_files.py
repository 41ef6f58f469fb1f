"""The files that reproduce a point of a front: its plan and its layout, with the meshes of all
points beside them."""

from __future__ import annotations

import shlex
from dataclasses import replace
from pathlib import Path

from factory.importing.mesh_files import MeshStore
from factory.lang.writer import write_pag
from factory.record.plan_file import PLAN_NAME, plan_files
from factory.study.pareto.front import ParetoFront

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
    for number, point in enumerate(front.points):
        pag, laid = point.project.pag, point.predicted is not None
        nodes = tuple(store.keep(node, pag.folder, "../") for node in pag.nodes)
        text = write_pag(replace(pag, nodes=nodes))
        files |= plan_files(point.project, folder / point_name(number), text, laid)
    return files | {folder / path: content for path, content in store.files.items()}
