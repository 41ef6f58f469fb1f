"""A project as a table: in the header of a log, and in the file of a plan.

It holds the PAG as it was read, the templates that it uses, its plan and its settings. Meshes are
not in it: they are read from the folder of the PAG, or from beside the file with the table.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, fields
from functools import lru_cache
from pathlib import Path
from typing import Any

from factory.api import (
    PAG,
    Diagnostic,
    Factory,
    Ground,
    InputError,
    LayoutTable,
    Plan,
    Project,
    Settings,
    Template,
    all_templates,
    load_catalogue,
    read_pag,
    read_template,
    write_pag,
    write_template,
)
from factory.apps.log.cell_table import CellTable
from factory.apps.log.content import AGAIN
from factory.engine.record.history import firings
from factory.support.tables import MISFITS, misfit, table_of, value_of


@dataclass(frozen=True, slots=True)
class PagTable:
    """A PAG as it was read: the name of its `file`, its `text`, and the SHA-256 of that."""

    file: str
    text: str
    sha256: str

    def __post_init__(self) -> None:
        if "\0" in self.file:
            raise ValueError("file must be the name of a file, without NUL")


@dataclass(frozen=True, slots=True)
class ProjectTable:
    """The table of a project: the name of its `product`, the texts of its `templates` by name, and
    its other inputs."""

    product: str
    pag: PagTable
    plan: Plan
    templates: Mapping[str, str]
    settings: Settings

    @classmethod
    def of(cls, table: Mapping[str, Any]) -> ProjectTable:
        """The fields in a table, which may have other keys. Raises ValueError."""
        return value_of(cls, {f.name: table[f.name] for f in fields(cls) if f.name in table})


def project_table(
    pag: PAG,
    templates: Mapping[str, Template],
    factory: Factory,
    settings: Settings,
    text: str | None = None,
) -> dict[str, Any]:
    """The table of a factory, of the PAG and templates that it was compiled from, and of settings;
    `text`: that of the PAG where it is not as it was read."""
    file = Path(pag.file)
    if text is None:
        written = file.is_file() and all(allowed.position for allowed in pag.allowed)
        text = file.read_text("utf-8", errors="replace") if written else write_pag(pag)
    named = {node.operation for node in pag.nodes} & templates.keys()
    used = {name: templates[name] for name in named}
    used |= {o.template.name: o.template for o in factory.operations}
    return {
        "product": file.stem.strip("<>") or "factory",
        "pag": {
            "file": str(file),
            "text": text,
            "sha256": hashlib.sha256(text.encode()).hexdigest(),
        },
        "plan": table_of(factory.plan),
        "templates": {name: write_template(made) for name, made in sorted(used.items())},
        "settings": asdict(settings),
    }


def project_of(
    table: Mapping[str, Any],
    beside: Path,
    settings: Settings | None = None,
    ground: Ground = Ground(),  # noqa: B008 (frozen)
) -> Project:
    """The project in a table of a file in the folder `beside`, with its layout, if any; `settings`
    replace those of the table. Of a cell the project of its arms. Raises InputError where its PAG
    cannot be read, or meshes are missing, ValueError where the table is not valid."""
    if "cell" in table:
        return _cell_of(table, beside, settings)
    made, kept = ProjectTable.of(table), table.get("layout")
    templates = _templates(made)
    pag = _pag(made.pag, templates, beside)
    laid = None if kept is None else value_of(LayoutTable, kept, "layout")
    settings = settings or made.settings
    return Project(pag, templates, load_catalogue(), settings, ground, made.plan, laid)


def _cell_of(table: Mapping[str, Any], beside: Path, settings: Settings | None) -> Project:
    """The project of the cell in a table: laid out once, however often it is asked for."""
    names = [*(f.name for f in fields(ProjectTable)), "cell"]
    text = json.dumps({name: table[name] for name in names if name in table}, sort_keys=True)
    try:
        project = _cell(text, Path())
    except InputError:
        project = _cell(text, beside)
    return project.with_settings(settings) if settings else project


@lru_cache(maxsize=2)
def _cell(text: str, beside: Path) -> Project:
    """The project of the cell in a table in JSON."""
    table = json.loads(text)
    cell = value_of(CellTable, table.pop("cell"), "cell")
    return cell.project(project_of(table, beside))


def settings_of(table: Mapping[str, Any]) -> Settings:
    """The settings in a table. Raises ValueError."""
    return value_of(Settings, table["settings"], "settings")


@contextmanager
def of_its_factory() -> Iterator[None]:
    """Raises InputError (BadLog) for the errors of a log that differs from the factory in its
    header."""
    try:
        yield
    except MISFITS as error:
        raise _of_another(misfit(error)) from error
    except InputError as error:
        if error.diagnostics[0].code != "BadPlan":
            raise
        raise _of_another(error.diagnostics[0].message) from error


@of_its_factory()
def factory_of(header: Mapping[str, Any]) -> Factory:
    """The factory that a log's PAG, templates and plan compile to; meshes are read for a cell only.

    Raises InputError (BadLog) where its names are not those of the header, or the run's first
    marking is not one of its own.
    """
    factory = project_of(header, Path()).plain if "cell" in header else _compiled(header)
    check_names(factory, header)
    firings(factory.net, frozenset(header["start"]))
    return factory


def _compiled(header: Mapping[str, Any]) -> Factory:
    """The factory on rails of a header."""
    made = ProjectTable.of(header)
    templates = _templates(made)
    pag = read_pag(made.pag.text, templates, made.pag.file, None)
    return Project(pag, templates, load_catalogue(), plan=made.plan).unshaped


def check_names(factory: Factory, header: Mapping[str, Any]) -> None:
    """Raises ValueError where a factory has other names than those in the header of a log."""
    net = factory.net.threaded
    names = [[x.name for x in items] for items in (net.transitions, net.places, factory.robots)]
    if names != [header["transitions"], header["places"], header["robots"]]:
        raise ValueError("its net is not that of its PAG")


def _of_another(words: str) -> InputError:
    message = f"the log differs from the factory in its header: {words}"
    return InputError(Diagnostic("BadLog", message, None, AGAIN))


def _templates(table: ProjectTable) -> dict[str, Template]:
    """The templates of a table, and the shipped ones where it has no others."""
    shipped = all_templates()
    changed = {
        name: read_template(text, name)
        for name, text in table.templates.items()
        if name not in shipped or write_template(shipped[name]) != text
    }
    return {**shipped, **changed}


def _pag(kept: PagTable, templates: Mapping[str, Template], beside: Path) -> PAG:
    """The PAG in a table, with its meshes from the folder that the PAG was in or, where they are
    not there, from beside the table. Raises InputError where they are in neither."""
    try:
        return read_pag(kept.text, templates, kept.file, os.path.dirname(kept.file) or ".")
    except InputError:
        with suppress(InputError):
            return read_pag(kept.text, templates, kept.file, str(beside))
        raise
