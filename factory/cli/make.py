"""The command `build`."""

from __future__ import annotations

import sys
from pathlib import Path
from time import perf_counter
from typing import Any

import click

from factory.cli.options import (
    FLOOR,
    MOTION,
    OUTPUT,
    PATH,
    RELAY,
    SOURCE,
    plan,
    settings_of,
    writable,
    writable_folder,
)
from factory.collector import collector_paused
from factory.console import emit, say, warning


@click.command()
@SOURCE
@click.option("--mjcf", type=PATH, help="Write the model as one XML here.")
@click.option("-o", "--output", type=PATH, help="Write everything in a folder.")
@click.option(
    "--units", type=click.IntRange(1, 10**9), help="Size the pool of parts for so many products."
)
@click.option("--wip", type=click.IntRange(1, 10**9), help="Copies of each part let in at once.")
@FLOOR
@RELAY
@MOTION
@OUTPUT
@collector_paused()
def build(
    file: Path,
    folders: tuple[Path, ...],
    mjcf: Path | None,
    output: Path | None,
    units: int | None,
    wip: int | None,
    floor: str | None,
    as_json: bool,
    quiet: bool,
    verbose: bool,
    **options: Any,
) -> int:
    """Compile, verify and lay out FILE.pag; write the MJCF model, the floor plan, the net."""
    from factory import receipt

    begin = perf_counter()
    writable(file, mjcf)
    writable_folder(output)
    settings = settings_of(file, options)
    wanted = {"folders": folders, "mjcf": mjcf, "output": output, "units": units, "wip": wip}
    name = receipt.request(file, {**options, **wanted, "floor": floor, "settings": settings})
    told = receipt.find(name)
    if told is None:
        told = _built(
            file, folders, mjcf, output, units, wip, floor, settings, options, begin, name
        )
    else:
        told["document"]["compile_s"] = perf_counter() - begin
        told["lines"].append("nothing has changed since: these files are up to date")
    for text in [] if quiet else told["warnings"]:
        print(text, file=sys.stderr)
    if as_json:
        emit(told["document"])
    elif not quiet:
        for line in told["lines"]:
            say(line)
    return 0


def _built(
    file: Path,
    folders: tuple[Path, ...],
    mjcf: Path | None,
    output: Path | None,
    units: int | None,
    wip: int | None,
    floor: str | None,
    settings: Any,
    options: dict[str, Any],
    begin: float,
    name: str,
) -> dict[str, Any]:
    """Build, keep the receipt under that name, and give what there is to tell."""
    from factory import receipt
    from factory.assets import mjcf_folder, templates_folder
    from factory.building import build_all, refuse_unproved
    from factory.layout.durations import Pace
    from factory.layout.gain import gain

    source, factory, layout = plan(file, folders, settings, floor, options)
    verdict = refuse_unproved(factory)
    spent = perf_counter() - begin
    built = build_all(source, layout, settings, mjcf, output, units, wip, verdict)
    gained = gain(layout, Pace.of(settings))
    document = {
        "product": source.pag.root,
        "mjcf": str(built.mjcf) if built.mjcf else None,
        "robots": len(factory.robots),
        "parts": built.model.bodies,
        "joints": built.model.joints,
        "welds": built.model.welds,
        "guidepath_length_m": round(layout.guidepath_length, 6),
        "area_m2": round(layout.area, 6),
        "compile_s": spent,
        "clearance": built.clearance,
        "layout": gained.as_json(),
        "files": [str(path) for path in built.files],
        "warnings": [d.as_json() for d in layout.product.warnings],
    }
    lines = [
        f"{source.pag.root}: {document['robots']} robots, {document['parts']} bodies of parts, "
        f"{document['joints']} joints, {document['welds']} welds",
        f"floor {layout.area:.2f} m², guidepaths {layout.guidepath_length:.2f} m, "
        f"clearance {settings.clearance * 1000:g} mm proved",
        str(gained),
        *(f"  {path}" for path in built.files[:20]),
    ]
    warnings = [warning(diagnostic) for diagnostic in layout.product.warnings]
    told = {"document": document, "lines": lines, "warnings": warnings}
    given = (*folders, templates_folder(), mjcf_folder())
    inside = (path for folder in given for path in folder.iterdir() if path.is_file())
    named = (node.parameter("mesh") for node in source.pag.parts())
    meshes = (Path(source.pag.folder) / str(mesh) for mesh in named if mesh)
    receipt.keep(name, (file, *given, *inside, *meshes), built.files, told)
    return told
