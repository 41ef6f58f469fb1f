"""The command `build`."""

from __future__ import annotations

import os
import sys
from dataclasses import asdict
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

import click

from factory.commands.defaults import with_defaults
from factory.commands.grouped import Grouped
from factory.commands.options import FLOOR, MOTION, OUT, OUTPUT, RELAY, SOURCE, UNITS, WIP
from factory.commands.outputs import writable, writable_folder
from factory.commands.requests import OutputOptions, ProjectOptions
from factory.commands.warnings import condensed
from factory.support.collector import collector_paused
from factory.support.console import POOL_BOUND, emit, say, warning
from factory.support.errors import printed
from factory.support.files import is_plan
from factory.support.progress import Waiting

if TYPE_CHECKING:
    from factory.apps.exports.build import Built
    from factory.pipeline import Project

SHOWN = 20
"""The most files that are listed, unless `-v` asks for all."""


@with_defaults
@click.command(cls=Grouped)
@SOURCE
@click.option("--mjcf", type=OUT, help="Write the MJCF model as one XML file.")
@click.option("-o", "--output", type=OUT, help="Folder for all output files.")
@click.option("--units", type=UNITS, help="Number of products to size the part pool for.")
@WIP
@FLOOR
@RELAY
@MOTION
@OUTPUT
@collector_paused()
def build(
    options: ProjectOptions,
    out: OutputOptions,
    mjcf: Path | None,
    output: Path | None,
    units: int | None,
    wip: int | None,
) -> int:
    """Write the factory of FILE.pag: MJCF, floor plan, net.

    The PAG is compiled, verified and laid out first.
    """
    from factory.support.cache import build_name, find_build, keep_build
    from factory.support.user_defaults import defaults_for

    begin = perf_counter()
    writable(mjcf)
    writable_folder(output)
    wanted = {"mjcf": mjcf, "output": output, "units": units, "wip": wip}
    defaults = defaults_for(options.file).values
    settings = options.settings()
    name = build_name(
        options.file, {**asdict(options), **wanted, "settings": settings, "defaults": defaults}
    )
    kept = find_build(name)
    is_current = kept is not None
    if kept is None:
        from factory.apps.exports.build import BuildRequest
        from factory.apps.exports.build import build as build_files
        from factory.apps.log.plan_file import plan_and_layout
        from factory.theory.nets.verify import proved

        request = BuildRequest(mjcf, output, units, wip)
        if not is_plan(options.file):  # a search for few robots lays out too
            request.claim(options.file.stem)
        project = options.project(out.silent)
        request.claim(project.name)
        with Waiting("reading the shapes and laying out", out.silent):
            verdict = proved(project.layout.factory.net)
        spent = perf_counter() - begin
        plan = plan_and_layout(options.file) if is_plan(options.file) else ()
        with Waiting("compiling the model", out.silent):
            built = build_files(project, verdict, request)
        kept = _printed(project, built, spent, wip)
        inputs = (*project.pag.files, *plan, *_shipped_and_own(options.folders))
        if project.ground.is_named:
            keep_build(name, inputs, built.files, kept)
    else:
        kept["document"]["compile_s"] = perf_counter() - begin
    for text in [] if out.silent else kept["all warnings" if out.verbose else "warnings"]:
        print(text, file=sys.stderr)
    if out.as_json:
        emit(kept["document"])
    else:
        for line in (*kept["lines"], *_listed(kept["document"]["files"], out.verbose)):
            say(line)
        if is_current:
            say("nothing has changed: these files are up to date")
    return 0


def _listed(files: list[str], verbose: bool) -> list[str]:
    """Lines with the files that were written, those in sub-folders last: all, or the first ones and
    the number of the others."""
    files = sorted(files, key=lambda path: path.count(os.sep))
    shown = files if verbose or len(files) <= SHOWN else files[: SHOWN - 1]
    more = len(files) - len(shown)
    return [f"  {path}" for path in shown] + [f"  and {more} more: -v lists them"] * (more > 0)


def _printed(project: Project, built: Built, spent: float, wip: int | None) -> dict[str, Any]:
    """What a build prints: the document of `--json`, the lines for people, the warnings."""
    from factory.engine.timing.gain import gain
    from factory.floor.layout.hands.bores import bores
    from factory.floor.layout.tiles import fill_of, tiles_of
    from factory.support.settings import AUTO
    from factory.support.texts import counted

    layout, settings, model = project.layout, project.settings, built.model
    root, robots = layout.factory.pag.root, len(layout.factory.robots)
    gained, drilled = gain(layout, settings, project.hands, wip), list(bores(layout))
    document: dict[str, Any] = {
        "product": root,
        "mjcf": str(built.mjcf) if built.mjcf else None,
        "robots": robots,
        "parts": model.bodies,
        "joints": model.joints,
        "welds": model.welds,
        "wip": model.wip,
        "guidepath_length_m": round(layout.guidepath_length, 6),
        "area_m2": round(layout.area, 6),
        "timestep_s": model.settings.step,
        "compile_s": spent,
        "clearance": built.clearance.summary(),
        "layout": gained.as_json(),
        "files": [str(path) for path in built.files],
        "warnings": [d.as_json() for d in project.warnings],
    }
    ground = f"floor {layout.area:.2f} m²"
    if layout.tile:
        tiles = tiles_of(layout)
        document |= {"tiles": len(tiles), "tile_m": layout.tile, "fill": fill_of(layout, tiles)}
        ground += f", {len(tiles)} tiles of {layout.tile * 1000:g} mm"
    lines = [
        f"{root}: {counted(robots, 'robot')}, {model.bodies} bodies of parts, "
        f"{counted(model.joints, 'joint')}, {counted(model.welds, 'weld')}",
        f"{ground}, guidepaths {layout.guidepath_length:.2f} m, "
        f"clearance {built.clearance.clearance * 1000:g} mm proved",
        f"timestep {1000 * model.settings.step:g} ms"
        + (", chosen automatically (--timestep)" if settings.timestep == AUTO else ""),
        str(gained),
    ]
    if wip is None and model.wip is not None:
        lines.insert(1, f"parts for at most {model.wip} units inside at once: {POOL_BOUND}")
    document["bores"] = [bore.as_json() for bore in drilled]
    if drilled:
        where = ", ".join(dict.fromkeys(bore.label for bore in drilled))
        lines.append(f"hands grip with pins in bores of {where} (positions: --json)")
    every, brief = (
        printed([*map(warning, condensed(project.warnings, all_))], "warnings")
        for all_ in (True, False)
    )
    return {"document": document, "lines": lines, "all warnings": every, "warnings": brief}


def _shipped_and_own(folders: tuple[Path, ...]) -> tuple[Path, ...]:
    """The folders of operations and of robot types, and the files in them: the shipped ones, the
    user's own, and those of installed packages with all that these have."""
    from factory.support.extensions import extension_files
    from factory.support.resources import mjcf_folder, templates_folder

    every = (*folders, templates_folder(), mjcf_folder())
    inside = (path for folder in every for path in folder.iterdir() if path.is_file())
    return (*every, *inside, *extension_files())
