"""The files of a build: the model, the floor plan, the programs, the net and the proofs."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

from factory.exporting.certificate.writer import certificate
from factory.exporting.dot import write_dot
from factory.exporting.floor_sheet import write_svg
from factory.exporting.pnml import write_pnml
from factory.exporting.ways import ways
from factory.layout.certificate import Certificate
from factory.layout.clearance import certify
from factory.layout.exclusions import coordinated
from factory.mjcf.binary import beside, kept, key_of, packed, seal_of, sealed
from factory.mjcf.model import Model, model_files
from factory.mjcf.stock import written
from factory.modes.modes import operation_modes
from factory.nets.verdict import Verdict
from factory.pipeline import Project
from factory.plant.programs import program_of, write_program
from factory.record.plan_file import plan_files
from factory.simulation.modelling import physical_model
from factory.support.errors import RunError
from factory.support.files import own_names, write_all


@dataclass(frozen=True, slots=True)
class BuildRequest:
    """What a build writes: the model at `mjcf`, and everything into the folder `output`. The model
    has parts for so many `units` (None: for ever) with `wip` units inside at once. `read`: files
    that were read, beside the PAG and its meshes."""

    mjcf: Path | None = None
    output: Path | None = None
    units: int | None = None
    wip: int | None = None
    read: tuple[Path, ...] = ()


@dataclass(frozen=True)
class Built:
    """A build's model, its clearance certificate and its files, including those that existed
    before; `mjcf`: the file of the model."""

    model: Model
    clearance: Certificate
    mjcf: Path | None
    files: tuple[Path, ...]


def build(project: Project, verdict: Verdict, request: BuildRequest) -> Built:
    """Build the model and write the requested files, with the proof of the net's `verdict`.

    Raises RunError where the layout is not certified; InputError where an operation cannot reach
    its goal in it, where the engine refuses the model, and where a file whose name is chosen here
    would be written through a link, or over what was read. Nothing is written then."""
    layout, settings, output = project.layout, project.settings, request.output
    operation_modes(layout, settings.eps)
    clearance = layout.certificate or certify(layout)
    if not clearance.holds:
        raise RunError(fault.diagnostic() for fault in clearance.faults)
    model = written(physical_model(layout, request.units, settings, project.catalogue, request.wip))
    mjcf, read = request.mjcf, (*files_read(project), *request.read)
    if output is not None:
        mjcf = mjcf or output / f"{project.name}.xml"
    path = beside(mjcf) if mjcf else None
    binary = _binary(model, path)
    files: dict[Path, bytes] = {}
    if mjcf is not None:
        files |= model_files(model, mjcf)
        own_names(mjcf.parent, (files.keys() | binary.keys()) - {request.mjcf}, read)
    if output is not None:
        texts = _documents(project, clearance, verdict)
        texts["ways.json"] = _json(ways(model))
        documents = {output / f"{project.name}.{end}": t.encode() for end, t in texts.items()}
        documents |= plan_files(project, output)
        own_names(output, documents, read)
        files |= documents
    write_all(files | binary)
    named = (*files, path, seal_of(path)) if path else tuple(files)
    return Built(model, clearance, mjcf, named)


def files_read(project: Project) -> tuple[Path, ...]:
    """The PAG's file, and those of its meshes."""
    named = (node.parameter("mesh") for node in project.pag.parts())
    meshes = (Path(project.pag.folder) / str(mesh) for mesh in named if mesh)
    return (project.file, *meshes)


def _binary(model: Model, path: Path | None) -> dict[Path, bytes]:
    """The files of the engine's binary model and its seal; none where they are at `path` already,
    since the engine has accepted this model then. Raises InputError where it does not."""
    if path and kept(path, key_of(model)) is not None:
        return {}
    from factory.mjcf.loading import load

    m = load(model)
    return sealed(path, key_of(model), packed(m)) if path else {}


def _documents(project: Project, clearance: Certificate, verdict: Verdict) -> dict[str, str]:
    """Everything about the factory but the model, as texts by the endings of their files."""
    layout = project.layout
    factory = layout.factory
    programs = (write_program(program_of(factory, r.index)) for r in factory.robots)
    return {
        "svg": write_svg(layout),
        "programs.txt": "\n\n".join(programs) + "\n",
        "proof.json": _json(certificate(factory.net, verdict)),
        "clearance.json": _json(clearance.as_json()),
        "dot": write_dot(factory.net),
        "pnml": write_pnml(factory.net),
        "coordinated.pnml": write_pnml(coordinated(layout).net),
    }


def _json(document: object) -> str:
    return json.dumps(document, ensure_ascii=False) + "\n"
