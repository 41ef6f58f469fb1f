"""The command `build`: write the model, the floor plan, the programs, the net and its proof."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from factory.errors import Diagnostic, InputError, RunError
from factory.factory import Factory
from factory.files import write_text
from factory.layout.plan import Layout
from factory.mjcf.model import Model, write_model
from factory.nets.verdict import Verdict
from factory.pipeline import Source
from factory.settings import Settings
from factory.simulation import physical_model


@dataclass(frozen=True)
class Built:
    """What was built and the files written; `clearance`: the certificate's figures."""

    model: Model
    mjcf: Path | None
    files: tuple[Path, ...]
    clearance: dict[str, Any]


def refuse_unproved(factory: Factory) -> Verdict:
    """The verdict on the net. Raises RunError where some property is not proved."""
    from factory.nets.verify import verify

    verdict = verify(factory.net)
    if not verdict.holds:
        raise RunError(
            Diagnostic("NotProved", str(witness), None, "see factory check")
            for witness in verdict.witness
        )
    return verdict


def build_all(
    source: Source,
    layout: Layout,
    settings: Settings,
    mjcf: Path | None,
    output: Path | None,
    units: int | None,
    wip: int | None,
) -> Built:
    """Build the model and write what is asked for. Raises RunError where the layout is not certified,
    InputError where the engine refuses the model; nothing is written then."""
    from factory.layout.clearance import certify
    from factory.world.physics import load

    certificate = certify(layout)
    if not certificate.holds:
        raise RunError(
            Diagnostic("Layout", str(fault), None, "give --clearance less, or report this layout")
            for fault in certificate.faults
        )
    model = physical_model(layout, units, settings, source.catalogue, wip)
    load(model)
    files: list[Path] = []
    if output is not None:
        files += _write_folder(source, layout, output)
        mjcf = mjcf or output / f"{_stem(source)}.xml"
    if mjcf is not None:
        files = [*write_model(model, mjcf), *files]
    return Built(model, mjcf, tuple(files), certificate.as_json())


def _stem(source: Source) -> str:
    return Path(source.pag.file).stem or "factory"


def _write_folder(source: Source, layout: Layout, output: Path) -> list[Path]:
    """Everything about the factory but the model, in a folder made for it."""
    from factory.export import exporters
    from factory.layout.clearance import certify
    from factory.layout.drawing import write_svg
    from factory.nets.certificate import certificate
    from factory.nets.verify import verify
    from factory.programs import program_of, write_program

    if output.exists() and not output.is_dir():
        message = f"'{output}' is a file, not a folder"
        raise InputError(Diagnostic("File", message, None, "-o takes the name of a folder"))
    factory, stem = layout.factory, _stem(source)
    verdict = verify(factory.net)
    programs = (write_program(program_of(factory, r.index)) for r in factory.robots)
    texts = {
        f"{stem}.svg": write_svg(layout),
        f"{stem}.programs.txt": "\n\n".join(programs) + "\n",
        f"{stem}.proof.json": json.dumps(certificate(factory.net, verdict), ensure_ascii=False)
        + "\n",
        f"{stem}.clearance.json": json.dumps(certify(layout).as_json(), ensure_ascii=False) + "\n",
        **{f"{stem}.{name}": write(factory) for name, write in exporters().items()},
    }
    output.mkdir(parents=True, exist_ok=True)
    for name, text in texts.items():
        write_text(output / name, text)
    return [output / name for name in texts]
