"""The files from which a point of a front is made again: for each the PAG, its plan, and a
`factory.toml` with its settings; meshes and operations of the user's lie beside them."""

from __future__ import annotations

import json
import shlex
from collections.abc import Iterator, Mapping
from dataclasses import fields, replace
from pathlib import Path, PurePosixPath
from typing import Any

from factory.importing.mesh_files import MeshStore
from factory.lang.writer import write_pag, write_template
from factory.pipeline import Project
from factory.problem.pag import PAG, Assembly
from factory.problem.plan_file import PLAN_NAME, plan_table
from factory.study.pareto.front import FrontPoint, ParetoFront
from factory.support.files import MESH, read_bytes
from factory.support.resources import templates_folder
from factory.support.settings import Settings
from factory.support.user_defaults import NAME

PAG_NAME = "product.pag"

MESHES, OPERATIONS = "meshes", "operations"
"""Folders that all points share."""


def point_name(number: int) -> str:
    """The folder of a point of a front, counted from 0."""
    return f"p{number + 1:02d}"


def command_of(point: FrontPoint, file: Path) -> str:
    """The command that builds and runs a point whose plan is in a file."""
    return shlex.join(["factory", "run", str(file), *["--relay"] * bool(point.relays)])


def commands_of(front: ParetoFront, folder: Path) -> list[str]:
    """Those of all points, in their order."""
    return [
        command_of(point, folder / point_name(number) / PLAN_NAME)
        for number, point in enumerate(front.points)
    ]


def point_files(front: ParetoFront, folder: Path) -> dict[Path, bytes]:
    """The files of all points in a folder. What the input calls its meshes is not followed: each
    lies in the folder. Raises OSError where a mesh is no longer there."""
    store, found = MeshStore(MESHES), dict[Path, bytes]()
    kept: dict[tuple[str, str], str] = {}
    for number, point in enumerate(front.points):
        own, project = folder / point_name(number), point.project
        pag = write_pag(_with_meshes(project.pag, store, kept))
        found[own / PAG_NAME] = pag.encode()
        plan = plan_table(PAG_NAME, pag, project.plain.plan)
        found[own / PLAN_NAME] = (json.dumps(plan, indent=1) + "\n").encode()
        found[own / NAME] = "".join(f"{line}\n" for line in _settings(project)).encode()
    found |= {folder / path: content for path, content in store.files.items()}
    if front.points:
        found |= _operations(front.points[0].project, folder)
    return found


def _with_meshes(pag: PAG, store: MeshStore, kept: dict[tuple[str, str], str]) -> PAG:
    """A PAG whose meshes are those of a store, `kept` by folder and path."""
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
    own = kept[pag.folder, path]
    return replace(
        node,
        parameters=tuple(replace(p, value=own) if p.name == "mesh" else p for p in node.parameters),
    )


def _own_operations(project: Project) -> Mapping[str, str]:
    """The operations of a project that are not shipped, as texts by name."""
    return {
        name: write_template(template)
        for name, template in project.templates.items()
        if template.position is None or Path(template.position.file).parent != templates_folder()
    }


def _operations(project: Project, folder: Path) -> dict[Path, bytes]:
    texts = _own_operations(project)
    return {folder / OPERATIONS / f"{name}.op": text.encode() for name, text in texts.items()}


def _settings(project: Project) -> Iterator[str]:
    """The lines of the `factory.toml` of a point: what is not built in."""
    ground, plain = project.ground, Settings()
    for field in fields(Settings):
        value = getattr(project.settings, field.name)
        if value is not None and value != getattr(plain, field.name):
            yield f"{field.name} = {_written(value)}"
    if ground.floor is not None:
        yield f"floor = {_written('x'.join(map(str, ground.floor)))}"
    if _own_operations(project):
        yield f"templates = {_written([f'../{OPERATIONS}'])}"


def _written(value: Any) -> str:
    """A value in TOML, whose texts are those of JSON."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
