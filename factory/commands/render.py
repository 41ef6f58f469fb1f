"""The command `render`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from factory.apps.runs.options import RunOptions
from factory.commands import options as shared
from factory.commands.defaults import with_defaults
from factory.commands.grouped import Grouped
from factory.commands.outputs import for_a_pag, writable
from factory.commands.requests import OutputOptions, PictureOptions, ProjectOptions
from factory.commands.warnings import announced, cut_off, read_partly
from factory.support.console import emit, say, warn
from factory.support.errors import Diagnostic, InputError

if TYPE_CHECKING:
    Moment = float | Literal["end"]


@with_defaults
@click.command(cls=Grouped)
@shared.SOURCE
@click.option(
    "-o",
    "--output",
    type=shared.OUT,
    required=True,
    help="OUT.mp4, or OUT.png for a still.",
)
@click.option("--at", default="end", help="Time of a still [s], or `end`.")
@shared.RUN
@shared.PICTURE
@shared.FLOOR
@shared.RELAY
@shared.MOTION
@shared.OUTPUT
def render(
    options: ProjectOptions,
    asked: RunOptions,
    shown: PictureOptions,
    out: OutputOptions,
    output: Path,
    at: str,
) -> int:
    """Film a run of FILE.pag, or the run in a LOG.

    `run --log` writes a LOG. Pictures are drawn headless, through EGL.
    """
    from factory.apps.log import is_log
    from factory.apps.runs.pictures import render as taken
    from factory.film.shot import Shot

    file = options.file
    if is_log(file):
        for_a_pag(file, "a log", "output", "at", *shared.OF_A_PICTURE)
    writable(output, shown.poster)
    shot = Shot(output, shown.picture(), shown.fps, _moment(at), shown.poster)
    size, is_still, moment = shot.picture.size, shot.is_still, shot.at
    log = None
    warnings: list[dict[str, object]] = []
    if is_log(file):
        log = read_partly(file, out.silent)
        frames, _, _ = taken(log, shot)
    else:
        asked.check_combination()
        project = options.project(out.silent)
        warnings = announced(project.layout.product.warnings, out)
        frames, run, _ = taken(project, shot, asked, out.silent)
        if run is not None:
            warn(run.verdict.bodies, out.silent)
    seconds = 0.0 if is_still else round(frames / shown.fps, 6)
    if out.as_json:
        width, height = size
        document = {"output": str(output), "frames": frames, "width": width, "height": height}
        emit(
            {**document, "fps": shown.fps, "seconds": seconds, "warnings": warnings, **cut_off(log)}
        )
    else:
        shape = f"{size[0]}x{size[1]}"
        when = "at the end" if moment == "end" else f"at {moment:g} s"
        filmed = f"{frames} frames of {shape}, {seconds:.1f} s"
        say(f"{output}: {f'a still of {shape} {when}' if is_still else filmed}")
    return 0


def _moment(at: str) -> Moment:
    """The time of a still [s], or the end. Raises InputError (BadValue)."""
    if at == "end":
        return "end"
    try:
        return float(at)
    except ValueError:
        message = f"--at takes seconds or `end`, not '{at}'"
        raise InputError(Diagnostic("BadValue", message, None, "for example --at 2.5")) from None
