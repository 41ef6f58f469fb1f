"""The files of a build: the model, the floor plan, the programs, the net and the proofs."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from factory.api import (
    Certificate,
    LayoutMachines,
    Model,
    Project,
    RunError,
    Timing,
    Verdict,
    physical_model,
)
from factory.apps.drawing.tables import titled
from factory.apps.exports import arm_program, joints
from factory.apps.exports.binary import beside, kept, key_of, packed, seal_of, sealed
from factory.apps.exports.certificate.writer import certificate
from factory.apps.exports.dot import write_dot
from factory.apps.exports.floor_sheet import write_svg
from factory.apps.exports.goals import goals
from factory.apps.exports.pnml import write_pnml
from factory.apps.exports.program_text import write_program
from factory.apps.exports.stock import model_files, write
from factory.apps.exports.subject import Subject
from factory.apps.exports.ways import ways
from factory.apps.log.plan_file import LAYOUT_NAME, PLAN_NAME, plan_files
from factory.support.files import own_names, write_all
from factory.theory.plant.programs import Program


def _json(document: object) -> str:
    return json.dumps(document, ensure_ascii=False) + "\n"


@dataclass(frozen=True)
class _Drawn:
    """What the documents of a build are about."""

    project: Project
    clearance: Certificate
    verdict: Verdict
    model: Model


def _programs(what: _Drawn) -> str:
    factory = what.project.layout.factory
    programs = (write_program(Program.of(factory, robot.index)) for robot in factory.robots)
    return "\n\n".join(programs) + "\n"


DOCUMENTS: Mapping[str, Callable[[_Drawn], str]] = {
    "svg": lambda what: write_svg(what.project.layout),
    "programs.txt": _programs,
    "proof.json": lambda what: _json(certificate(what.project.layout.factory.net, what.verdict)),
    "clearance.json": lambda what: _json(what.clearance.as_json()),
    "dot": lambda what: write_dot(what.project.layout.factory.net),
    "pnml": lambda what: write_pnml(what.project.layout.factory.net),
    "coordinated.pnml": lambda what: write_pnml(
        LayoutMachines(what.project.layout).coordinated.net
    ),
    "goals.json": lambda what: _json(goals(what.model)),
    "ways.json": lambda what: _json(ways(what.model)),
}
"""Everything about a factory but the model: by the endings of their files, what writes the text."""

OF_RAILS = "goals.json", "ways.json"
"""What is about guidepaths."""


@dataclass(frozen=True, slots=True)
class BuildRequest:
    """What a build writes: the model at `mjcf`, and everything into the folder `output`. The model
    has parts for so many `units` (None: for ever) with `wip` units inside at once."""

    mjcf: Path | None = None
    output: Path | None = None
    units: int | None = None
    wip: int | None = None

    def model_path(self, name: str) -> Path | None:
        """Where the model of a product of this `name` is written; None where it is not."""
        return self.mjcf or (self.output and self.output / f"{name}.xml")

    def claim(self, name: str) -> None:
        """Declare the files that a build of this `name` writes, except meshes, before it begins.
        Raises InputError (BadFile)."""
        if mjcf := self.model_path(name):
            binary = beside(mjcf)
            chosen = () if self.mjcf else (mjcf,)
            own_names(mjcf.parent, (*chosen, *((binary, seal_of(binary)) if binary else ())))
        if self.output is not None:
            documents = *(f"{name}.{end}" for end in DOCUMENTS), PLAN_NAME, LAYOUT_NAME
            own_names(self.output, (self.output / document for document in documents))


@dataclass(frozen=True)
class Built:
    """A build.

    Attributes:
        model: the MJCF model.
        clearance: the clearance certificate.
        mjcf: the file of the model; None where it was not written.
        files: its files, including those that existed before.
    """

    model: Model
    clearance: Certificate
    mjcf: Path | None
    files: tuple[Path, ...]

    def __repr__(self) -> str:
        counts = f"{self.model.bodies} bodies, {self.model.joints} joints"
        return f"<Built: a model of {counts}; {len(self.files)} files>"

    def _repr_html_(self) -> str:
        sizes = ((file.name, f"{file.stat().st_size / 1e3:.1f} kB") for file in self.files)
        return titled(repr(self), ("file", "size"), sizes)


def build(project: Project, verdict: Verdict, request: BuildRequest) -> Built:
    """Build the model and write the requested files, with the proof of the net's `verdict`.

    Raises RunError where the layout is not certified; InputError where an operation cannot reach
    its goal in it, where the engine refuses the model, and where a file whose name is chosen here
    would be written through a link, or over what was read. Nothing is written then."""
    request.claim(project.name)
    layout, settings, output = project.layout, project.settings, request.output
    _ = Timing(layout, settings).modes
    clearance = layout.certificate or LayoutMachines(layout).certify()
    if not clearance.holds:
        raise RunError(fault.diagnostic() for fault in clearance.faults)
    of = layout, request.units, settings, project.catalogue, request.wip
    model = physical_model(*of, finish=write)
    mjcf = request.model_path(project.name)
    path = beside(mjcf) if mjcf else None
    binary = _binary(model, path)
    files: dict[Path, bytes] = {}
    if mjcf is not None:
        files |= model_files(model, mjcf)
        own_names(mjcf.parent, (files.keys() | binary.keys()) - {request.mjcf})
    if output is not None:
        what = _Drawn(project, clearance, verdict, model)
        documents = {output / name: content for name, content in _documents(what).items()}
        documents |= plan_files(project, output)
        own_names(output, documents)
        files |= documents
    write_all(files | binary)
    named = (*files, path, seal_of(path)) if path else tuple(files)
    return Built(model, clearance, mjcf, named)


def _documents(what: _Drawn) -> dict[str, bytes]:
    """The documents of a build by name: of a cell also the joints and programs of its arms, and
    none that is about guidepaths."""
    name, is_cell = what.project.name, what.project.layout.chains is not None
    ends = (end for end in DOCUMENTS if not (is_cell and end in OF_RAILS))
    made = {f"{name}.{end}": DOCUMENTS[end](what).encode() for end in ends}
    if is_cell:
        for export in (joints.export, arm_program.export):
            of_arms = export(Subject(Path(f"{name}.pag"), what.project, whole=True))
            assert isinstance(of_arms, Mapping)
            made |= of_arms
    return made


def _binary(model: Model, path: Path | None) -> dict[Path, bytes]:
    """The files of the engine's binary model and its seal; none where they are at `path` already,
    since the engine has accepted this model then. Raises InputError where it does not."""
    if path and kept(path, key_of(model)) is not None:
        return {}
    from factory.api import load

    m = load(model)
    return sealed(path, key_of(model), packed(m)) if path else {}
