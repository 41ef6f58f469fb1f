"""The command `build`: write the model, the floor plan, the programs, the net and its proof."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from factory.layout.certificate import Certificate
from factory.layout.layout import Layout
from factory.mjcf.binary import beside, kept, key_of, packed, seal_of, sealed
from factory.mjcf.model import Model, model_files
from factory.nets.verdict import Verdict
from factory.pipeline import Source
from factory.simulation.simulation import physical_model
from factory.support.errors import RunError
from factory.support.files import own_names, write_all
from factory.support.settings import Settings


@dataclass(frozen=True)
class Built:
    """What was built and its files, those included that were there already; `clearance`: the
    certificate's figures."""

    model: Model
    mjcf: Path | None
    files: tuple[Path, ...]
    clearance: dict[str, Any]


def build_all(
    source: Source,
    layout: Layout,
    settings: Settings,
    mjcf: Path | None,
    output: Path | None,
    units: int | None,
    wip: int | None,
    verdict: Verdict,
) -> Built:
    """Build the model and write what is asked for, with the proof of the net's `verdict`.

    Raises RunError where the layout is not certified; InputError where an operation cannot reach
    its goal in it, where the engine refuses the model, and where a file whose name is our choice
    would be written through a link, or over what was read. Nothing is written then."""
    from factory.layout.clearance import certify
    from factory.modes.modes import operation_modes

    operation_modes(layout, settings.eps)
    certificate = layout.certificate or certify(layout)
    if not certificate.holds:
        raise RunError(fault.diagnostic() for fault in certificate.faults)
    model = physical_model(layout, units, settings, source.catalogue, wip)
    files: dict[Path, bytes] = {}
    typed, read = mjcf, files_read(source)
    if output is not None:
        mjcf = mjcf or output / f"{_stem(source)}.xml"
    path = beside(mjcf) if mjcf else None
    binary = _binary(model, path)
    if mjcf is not None:
        files |= model_files(model, mjcf)
        own_names(mjcf.parent, (files.keys() | binary.keys()) - {typed}, read)
    if output is not None:
        texts = _documents(layout, certificate, verdict)
        documents = {output / f"{_stem(source)}.{end}": t.encode() for end, t in texts.items()}
        own_names(output, documents, read)
        files |= documents
    write_all(files | binary)
    named = (*files, path, seal_of(path)) if path else tuple(files)
    return Built(model, mjcf, named, certificate.summary())


def files_read(source: Source) -> tuple[Path, ...]:
    """The PAG's file, and those of its meshes."""
    named = (node.parameter("mesh") for node in source.pag.parts())
    meshes = (Path(source.pag.folder) / str(mesh) for mesh in named if mesh)
    return (Path(source.pag.file), *meshes)


def _binary(model: Model, path: Path | None) -> dict[Path, bytes]:
    """The engine's binary model and its seal, to be written; nothing where they are at `path`
    already: the engine has accepted this model before. Raises InputError where it does not."""
    if path and kept(path, key_of(model)) is not None:
        return {}
    from factory.mjcf.loading import load

    m = load(model)
    return sealed(path, key_of(model), packed(m)) if path else {}


def _stem(source: Source) -> str:
    return Path(source.pag.file).stem or "factory"


def _documents(layout: Layout, clear: Certificate, verdict: Verdict) -> dict[str, str]:
    """Everything about the factory but the model, as texts by the endings of their files."""
    from factory.export.certificate.writer import certificate
    from factory.export.dot import write_dot
    from factory.export.floor_sheet import write_svg
    from factory.export.pnml import write_pnml
    from factory.plant.programs import program_of, write_program

    factory = layout.factory
    programs = (write_program(program_of(factory, r.index)) for r in factory.robots)
    return {
        "svg": write_svg(layout),
        "programs.txt": "\n\n".join(programs) + "\n",
        "proof.json": _json(certificate(factory.net, verdict)),
        "clearance.json": _json(clear.as_json()),
        "dot": write_dot(factory.net),
        "pnml": write_pnml(factory.net),
    }


def _json(document: object) -> str:
    return json.dumps(document, ensure_ascii=False) + "\n"
