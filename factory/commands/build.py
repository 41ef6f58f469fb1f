"""The command `build`."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

import click

from factory.commands.options import (
    FLOOR,
    MOTION,
    OUTPUT,
    PATH,
    RELAY,
    SOURCE,
    WIP,
    plan,
    settings_of,
    writable,
    writable_folder,
)
from factory.support.collector import collector_paused
from factory.support.console import emit, say, warning

if TYPE_CHECKING:
    from factory.commands.build_factory import Built
    from factory.layout.layout import Layout
    from factory.pipeline import Source
    from factory.support.settings import Settings

SHOWN = 20
"""So many files are listed, unless `-v` asks for all."""


@click.command()
@SOURCE
@click.option("--mjcf", type=PATH, help="Write the model as one XML here.")
@click.option("-o", "--output", type=PATH, help="Write everything in a folder.")
@click.option(
    "--units", type=click.IntRange(1, 10**9), help="Size the pool of parts for so many products."
)
@WIP
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
    from factory.commands.build_factory import build_all
    from factory.nets.verify import proved
    from factory.support import build_cache as receipt

    begin = perf_counter()
    writable(file, mjcf)
    writable_folder(output)
    settings = settings_of(file, options)
    wanted = {"folders": folders, "mjcf": mjcf, "output": output, "units": units, "wip": wip}
    name = receipt.request(file, {**options, **wanted, "floor": floor, "settings": settings})
    told, news = receipt.find(name), ""
    if told is None:
        source, factory, layout = plan(file, folders, settings, floor, options)
        verdict = proved(factory.net)
        spent = perf_counter() - begin
        built = build_all(source, layout, settings, mjcf, output, units, wip, verdict)
        told = _told(layout, built, settings, spent)
        receipt.keep(name, _inputs(source, folders), built.files, told)
    else:
        told["document"]["compile_s"] = perf_counter() - begin
        news = "nothing has changed since: these files are up to date"
    for text in [] if quiet else told["warnings"]:
        print(text, file=sys.stderr)
    if as_json:
        emit(told["document"])
    elif not quiet:
        for line in (*told["lines"], *_listed(told["document"]["files"], verbose)):
            say(line)
        if news:
            say(news)
    return 0


def _listed(files: list[str], verbose: bool) -> list[str]:
    """The files that have been written, what lies in further folders behind: all, or the first and
    how many more."""
    files = sorted(files, key=lambda path: path.count(os.sep))
    shown = files if verbose or len(files) <= SHOWN else files[: SHOWN - 1]
    more = len(files) - len(shown)
    return [f"  {path}" for path in shown] + [f"  and {more} more: -v lists them"] * (more > 0)


def _told(layout: Layout, built: Built, settings: Settings, spent: float) -> dict[str, Any]:
    """What there is to tell: the document of `--json`, the lines for people, the warnings."""
    from factory.layout.durations import Pace
    from factory.layout.gain import gain
    from factory.support.settings import AUTO

    root, robots = layout.factory.pag.root, len(layout.factory.robots)
    model, gained = built.model, gain(layout, Pace.of(settings))
    document = {
        "product": root,
        "mjcf": str(built.mjcf) if built.mjcf else None,
        "robots": robots,
        "parts": model.bodies,
        "joints": model.joints,
        "welds": model.welds,
        "guidepath_length_m": round(layout.guidepath_length, 6),
        "area_m2": round(layout.area, 6),
        "timestep_s": model.settings.step,
        "compile_s": spent,
        "clearance": built.clearance,
        "layout": gained.as_json(),
        "files": [str(path) for path in built.files],
        "warnings": [d.as_json() for d in layout.product.warnings],
    }
    lines = [
        f"{root}: {robots} robots, {model.bodies} bodies of parts, {model.joints} joints, "
        f"{model.welds} welds",
        f"floor {layout.area:.2f} m², guidepaths {layout.guidepath_length:.2f} m, "
        f"clearance {settings.clearance * 1000:g} mm proved",
        f"timestep {1000 * model.settings.step:g} ms"
        + (", chosen for what it carries (--timestep)" if settings.timestep == AUTO else ""),
        str(gained),
    ]
    warnings = [warning(diagnostic) for diagnostic in layout.product.warnings]
    return {"document": document, "lines": lines, "warnings": warnings}


def _inputs(source: Source, folders: tuple[Path, ...]) -> tuple[Path, ...]:
    """Every file and folder a build reads: if one changes, the receipt no longer holds."""
    from factory.commands.build_factory import files_read
    from factory.support.resources import mjcf_folder, templates_folder

    given = (*folders, templates_folder(), mjcf_folder())
    inside = (path for folder in given for path in folder.iterdir() if path.is_file())
    return (*files_read(source), *given, *inside)
