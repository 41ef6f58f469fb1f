"""The files of a plan: `plan.json`, a project with its plan, which is read in place of a PAG, and
`layout.json` beside it, its layout."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

from factory.api import (
    PAG,
    Diagnostic,
    Ground,
    InputError,
    LayoutTable,
    Project,
    Settings,
    read_text,
)
from factory.apps.log.cell_table import cell_in
from factory.apps.log.project_table import ProjectTable, project_of, project_table
from factory.support.errors import Position, usage_error
from factory.support.files import MESH, read_bytes
from factory.support.tables import MISFITS, misfit, table_of, value_of

PLAN_NAME, LAYOUT_NAME = "plan.json", "layout.json"

SCHEMA, LAYOUT_SCHEMA = "factory.plan.1", "factory.layout.2"

MISFIT = "no factory has this plan: its turns, forms and templates do not fit each other"

AGAIN = "write it again: `factory build FILE.pag -o DIR`"


@dataclass(frozen=True)
class PlanFile:
    """A `plan.json`, read and checked: its table, and the settings and ground in it."""

    path: Path
    table: Mapping[str, Any] = field(repr=False)
    settings: Settings
    ground: Ground

    def project(
        self, settings: Settings, ground: Ground, warn: Callable[[Diagnostic], None]
    ) -> Project:
        """The project for settings and a ground, with the layout beside the file where that is of
        this plan and for these; `warn` is told where it is not. Raises InputError."""
        if "cell" in self.table and ground.floor is not None:
            raise usage_error(
                f"--floor: '{self.path}' is a cell, as large as its arm", "leave it out"
            )
        with _fitting(self.path), _of_a_plan(self.path):
            made = project_of(self.table, self.path.parent, settings, ground)
        if "cell" in self.table:
            return made
        with _fitting(self.path):
            made.plain  # noqa: B018 (compiled once)
        path = self.path.parent / LAYOUT_NAME
        why = f"there is no '{path}'"
        if path.is_file():
            with _of_a_plan(path):
                table = _table(path, LAYOUT_SCHEMA)
                if table["plan"] == _digest(made.pag, self.table, made.settings, made.ground.floor):
                    return replace(made, laid=value_of(LayoutTable, table["layout"], "layout"))
            why = f"'{path}' is of another plan, or for other settings, meshes or floor"
        hint = "`factory build` with `-o DIR` writes both files"
        warn(Diagnostic("BadPlan", f"{why}: the plan is laid out again", None, hint))
        if made.plan.turns:
            with _fitting(self.path):
                made.layout  # noqa: B018 (laid out once)
        return made


def read_plan(path: Path) -> PlanFile:
    """The plan in a file. Raises InputError: BadFile where it cannot be read, BadPlan where it is
    none."""
    with _of_a_plan(path):
        table = _table(path, SCHEMA)
        made, ground = ProjectTable.of(table), value_of(Ground, table["ground"], "ground")
        if not made.pag.file.startswith("<"):
            table["pag"]["file"] = os.path.normpath(path.parent / made.pag.file)
        return PlanFile(path, table, made.settings, ground)


def plan_and_layout(path: Path) -> tuple[Path, ...]:
    """The file of a plan, the layout beside it where there is one, or else their folder."""
    beside = path.parent / LAYOUT_NAME
    return path, beside if beside.is_file() else path.parent


def plan_files(
    project: Project, folder: Path, text: str | None = None, laid: bool = True
) -> dict[Path, bytes]:
    """The two files of a project, for a folder, without the layout where it is not to be `laid`
    out, and of a cell, whose plan is its product with its arms; `text`: that of its PAG where its
    meshes are moved beside the folder. Raises OSError where a mesh cannot be read, InputError
    (Usage) for an arm that could not be read again."""
    if (cell := cell_in(project)) is not None:
        project, laid = cell[0], False
    pag, factory = project.pag, project.layout.factory if laid else project.plain
    table = project_table(pag, project.templates, factory, project.settings, text)
    if cell is not None:
        table["cell"] = table_of(cell[1])
    if text is not None:
        table["pag"]["file"] = f"{project.name}.pag"
    elif not pag.file.startswith("<"):
        table["pag"]["file"] = os.path.relpath(pag.file, folder)
    named = {PLAN_NAME: {"schema": SCHEMA, **table, "ground": table_of(project.ground)}}
    if laid:
        digest = _digest(pag, table, project.settings, project.ground.floor)
        layout = table_of(LayoutTable.of(project.layout))
        named[LAYOUT_NAME] = {"schema": LAYOUT_SCHEMA, "plan": digest, "layout": layout}
    return {folder / name: (json.dumps(table) + "\n").encode() for name, table in named.items()}


def _digest(
    pag: PAG, table: Mapping[str, Any], settings: Settings, floor: tuple[float, float] | None
) -> str:
    """Digest of the inputs of a layout: text, templates and plan of a table, the content of the
    meshes of its PAG, settings, floor."""
    values = [table["pag"]["text"], table["templates"], table["plan"], table_of(floor)]
    made = sha256(
        json.dumps([values, [getattr(settings, n) for n in LayoutTable.LAID_FOR]]).encode()
    )
    for mesh in dict.fromkeys(filter(None, (part.parameter("mesh") for part in pag.parts()))):
        made.update(sha256(read_bytes(Path(pag.folder) / str(mesh), MESH)).digest())
    return made.hexdigest()


def _table(path: Path, schema: str) -> dict[str, Any]:
    """The table in a file. Raises OSError, ValueError."""
    table = json.loads(read_text(path))
    if not isinstance(table, dict) or table.get("schema") != schema:
        stated = table.get("schema") if isinstance(table, dict) else table
        words = f"its schema must be '{schema}', not {stated!r:.40}"
        raise ValueError(words + "; give the plan.json beside it" * (stated == LAYOUT_SCHEMA))
    return table


@contextmanager
def _of_a_plan(path: Path) -> Iterator[None]:
    """Raises InputError for the errors of a file that is read."""
    try:
        yield
    except OSError as error:
        message = f"'{path}' cannot be read: {error.strerror}"
        raise InputError(Diagnostic("BadFile", message, None, AGAIN)) from error
    except json.JSONDecodeError as error:
        at = Position(str(path), error.lineno, error.colno)
        raise InputError(
            Diagnostic("BadPlan", f"it is not JSON: {error.msg}", at, AGAIN)
        ) from error
    except (ValueError, KeyError, RecursionError) as error:
        words = misfit(error)
        raise InputError(Diagnostic("BadPlan", words, Position(str(path), 1, 1), AGAIN)) from error


@contextmanager
def _fitting(path: Path) -> Iterator[None]:
    """Raises InputError (BadPlan) where the values of a plan do not fit each other."""
    try:
        yield
    except MISFITS as error:
        at = Position(str(path), 1, 1)
        raise InputError(Diagnostic("BadPlan", MISFIT, at, AGAIN)) from error
