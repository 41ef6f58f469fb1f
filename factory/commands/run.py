"""The command `run`, and the execution of a simulation for any command."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from factory.apps.runs.options import RunOptions, check_ideal
from factory.commands import options as shared
from factory.commands.allowing import ALLOW
from factory.commands.defaults import with_defaults
from factory.commands.grouped import Grouped
from factory.commands.outputs import for_a_film, writable
from factory.commands.requests import (
    OutputOptions,
    PictureOptions,
    ProjectOptions,
)
from factory.commands.resuming import resumed
from factory.commands.summaries import summarise, tell_failures
from factory.commands.warnings import announced, say_allowed
from factory.support.console import emit, say
from factory.support.errors import usage_error
from factory.support.guard import reading
from factory.support.progress import Waiting

if TYPE_CHECKING:
    from factory.apps.resume.resuming import Resumed
    from factory.apps.runs.running import Filming
    from factory.engine.simulation.run import Run
    from factory.pipeline import Project
    from factory.theory.plant.factory import Factory


@with_defaults
@click.command(cls=Grouped)
@shared.SOURCE
@shared.FAULTS
@shared.RUN
@ALLOW
@click.option(
    "--demand",
    metavar="FILE|SEED",
    help="Orders for a mix: a file with a line product,time for each; or drawn by a seed.",
)
@click.option("--video", type=shared.OUT, help="Film the run (.mp4).")
@click.option("--log", type=shared.OUT, help="Log every tick to a file.")
@click.option(
    "--distributed", is_flag=True, help="Each robot runs its own program (paper, section 6)."
)
@click.option(
    "--monitor/--no-monitor",
    default=None,
    help="Check the run from the engine's states alone: at events (default), every tick, never.",
)
@click.option("--resume", is_flag=True, help="Continue an interrupted run, whose log is FILE.")
@shared.LENIENT
@shared.STRICT
@shared.PICTURE
@shared.FLOOR
@shared.RELAY
@shared.MOTION
@shared.OUTPUT
def run(
    options: ProjectOptions,
    asked: RunOptions,
    shown: PictureOptions,
    out: OutputOptions,
    video: Path | None,
    log: Path | None,
    monitor: bool | None,
    resume: bool,
) -> int:
    """Run FILE.pag until its products are dropped off.

    The exit status is 1 if the run does not make its units, does not follow its net, or moves
    bodies other than the net says; --lenient ignores the last. A run "succeeded, but" where no hand
    holds something, parts passed through each other or pairs of parts were not tested against each
    other; with --strict the status is 1 then.

    With --resume, FILE is a log: its run is repeated up to the end of the log, compared with it,
    and continued in the same log."""
    if resume:
        going = resumed(options.file, asked.max_time, out)
        return 0 if going is None else _continue(going, asked, monitor, out)
    if asked.demand is not None:
        reading(Path(asked.demand))
    writable(video, log, shown.poster)
    asked.check_combination()
    if asked.world == "ideal":
        check_ideal(asked.fuse, bool(monitor))
    if video is not None:
        shown.area()
    project = options.project(out.silent)
    from factory.apps.runs.running import check_run, run_project

    check_run(project, asked)
    with Waiting("reading the shapes and laying out", out.silent):
        layout = project.layout
    warnings = announced(project.warnings, out)
    if not out.silent:
        say_allowed(project)

    film = _film(project, asked, video, shown)
    record = run_project(project, asked, out.silent, log, film, monitor)
    status = _print(record, layout.factory, warnings, monitor, out)
    if not out.as_json:
        say_files(film=video, poster=shown.poster, log=log)
    return status


def _continue(going: Resumed, asked: RunOptions, monitor: bool | None, out: OutputOptions) -> int:
    """Continue the run in a log to its end; returns the exit status."""
    from factory.apps.runs.running import carry_on

    made = going.simulation
    record = carry_on(made, asked, out.silent, going.path, [going.recorder], monitor)
    status = _print(record, made.layout.factory, [], monitor, out)
    if not out.as_json:
        say_files(log=going.path)
    return status


def _print(
    record: Run,
    factory: Factory,
    warnings: Sequence[object],
    monitor: bool | None,
    out: OutputOptions,
) -> int:
    """Print the result of a run; returns the exit status."""
    if out.as_json:
        document = record.as_json()
        document.pop("schema")
        if monitor and record.monitor:
            document["monitor"] = record.monitor.as_json()
        trouble = [record.trouble.as_json()] if record.trouble else []
        emit({**document, "warnings": warnings, **({"errors": trouble} if trouble else {})})
    else:
        summarise(record, factory, out.verbose)
    tell_failures(record.verdict, out.verbose)
    return 0 if record.succeeded else 1


def _film(
    project: Project, asked: RunOptions, video: Path | None, shown: PictureOptions
) -> Filming | None:
    """The film that the options describe; None without --video. Raises InputError for a run that
    cannot be filmed, MissingError without GL."""
    if video is None:
        for_a_film()
        return None
    if asked.world == "ideal":
        raise usage_error("the ideal world has no bodies to film", "leave out --world ideal")
    from factory.film import Film, check_output
    from factory.support.gl import probe

    check_output(video, shown.area(), shown.fps)
    picture = shown.picture(project.pag)
    probe()
    return lambda made: Film(made, video, picture, shown.fps, shown.poster)


def say_files(**files: Path | None) -> None:
    """Print the files that a run has written, by their kinds."""
    for kind, path in files.items():
        if path is not None:
            say(f"{kind}: {path}")
