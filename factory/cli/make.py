"""The command `build`."""

from __future__ import annotations

from pathlib import Path
from time import perf_counter
from typing import Any

import click

from factory.cli.options import (
    FLOOR,
    MOTION,
    OUTPUT,
    PATH,
    SOURCE,
    plan,
    settings_of,
    writable,
    writable_folder,
)
from factory.collector import collector_paused
from factory.console import emit, say, warn


@click.command()
@SOURCE
@click.option("--mjcf", type=PATH, help="Write the model as one XML here.")
@click.option("-o", "--output", type=PATH, help="Write everything in a folder.")
@click.option(
    "--units", type=click.IntRange(1, 10**9), help="Size the pool of parts for so many products."
)
@click.option("--wip", type=click.IntRange(1, 10**9), help="Copies of each part let in at once.")
@FLOOR
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
    from factory.building import build_all, refuse_unproved
    from factory.layout.durations import Pace
    from factory.layout.gain import gain

    begin = perf_counter()
    writable(file, mjcf)
    writable_folder(output)
    settings = settings_of(file, options)
    source, factory, layout = plan(file, folders, settings, floor)
    verdict = refuse_unproved(factory)
    spent = perf_counter() - begin
    warn(layout.product.warnings, quiet)
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
    if as_json:
        emit(document)
    elif not quiet:
        say(
            f"{source.pag.root}: {document['robots']} robots, {document['parts']} bodies of parts, "
            f"{document['joints']} joints, {document['welds']} welds"
        )
        say(
            f"floor {layout.area:.2f} m², guidepaths {layout.guidepath_length:.2f} m, "
            f"clearance {settings.clearance * 1000:g} mm proved"
        )
        say(str(gained))
        for path in built.files[:20]:
            say(f"  {path}")
    return 0
