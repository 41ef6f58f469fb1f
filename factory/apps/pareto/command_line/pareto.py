"""The command `pareto`."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING

import click

from factory.api import Diagnostic
from factory.commands.defaults import with_defaults
from factory.commands.grouped import Grouped
from factory.commands.options import FLOOR, MOTION, ON, OUT, OUTPUT, SECONDS, SOURCE
from factory.commands.outputs import writable_folder
from factory.commands.requests import OutputOptions, ProjectOptions
from factory.commands.warnings import announced
from factory.support.console import emit, say, table
from factory.support.errors import StoppedError, usage_error

if TYPE_CHECKING:
    from factory.api import Project
    from factory.apps.pareto import Effort, FrontPoint, ParetoFront
    from factory.apps.pareto.sweeping import Step

PAGE_NAME = "pareto.html"


@with_defaults
@click.command(cls=Grouped)
@SOURCE
@click.option(
    "--validate",
    "trials",
    type=click.IntRange(0, 1000),
    default=0,
    help="Number of points, spread over the front, to run in both worlds.",
)
@click.option("-o", "--output", type=OUT, help="Folder for a web page and the files of each point.")
@click.option(
    "--effort",
    type=click.IntRange(1, 10**6),
    help="Number of factories to lay out (default: 16 to 200, by the size of the product).",
)
@click.option(
    "--seconds",
    "limit",
    type=SECONDS,
    help="Time limit of the search [s]; a message says if it was reached.",
)
@click.option(
    "--layouts/--no-layouts",
    default=True,
    help="Lay out and certify the points (default), or estimate them.",
)
@ON
@FLOOR
@MOTION
@OUTPUT
def pareto(
    options: ProjectOptions,
    out: OutputOptions,
    trials: int,
    on: str | None,
    output: Path | None,
    layouts: bool,
) -> int:
    """Find the Pareto-optimal factories for FILE.pag.

    The objectives are the numbers of robots, the cycle time and the floor area.

    Ctrl-C ends the search; the points found until then are printed and written. The exit status
    is 1 if a point that was run fails, or differs from its prediction by more than 2 %."""
    from factory.apps.pareto import Effort
    from factory.support.files import own_names

    if trials and not layouts:
        message = "without layouts there is nothing to run"
        raise usage_error(message, "leave out --validate or --no-layouts")
    writable_folder(output)
    if output is not None:
        own_names(output, [output / PAGE_NAME])
    project = options.project(out.silent)
    warnings = announced(project.warnings, out)
    effort = Effort(layouts, options.effort, options.limit or inf, options.branches())
    front, stopped = _found(project, effort, trials, out, on)
    commands, files = _written(front, project, output)
    if out.as_json:
        points = zip(front.points, commands, strict=True)
        document = front.as_json()
        document["points"] = [{**p.as_json(), "command": command} for p, command in points]
        errors = {"errors": [d.as_json() for d in stopped.diagnostics]} if stopped else {}
        emit({**document, "files": [*map(str, files)], "warnings": warnings, **errors})
    else:
        _print(front, commands)
        if output is not None:
            say(f"wrote {output / PAGE_NAME}, and the files of {len(front.points)} points")
    if stopped is not None:
        print(stopped, file=sys.stderr)
        return stopped.exit_status
    return 0 if all(trial.holds for trial in front.trials) else 1


def _found(
    project: Project, effort: Effort, trials: int, out: OutputOptions, on: str | None
) -> tuple[ParetoFront, StoppedError | None]:
    """The front, with the runs of `trials` of its points; and the error of an interruption, if the
    user stopped the search after a first point."""
    from factory.apps.pareto import FrontSweep
    from factory.apps.pareto.front import tried
    from factory.apps.sweep.workers import each_of
    from factory.support.progress import StepBar

    front = None
    with StepBar("searching for the front", out.silent) as bar:

        def seen(step: Step) -> None:
            bar.show(step.what, step.done, step.total, f"{step.points} points" * bool(step.points))

        sweep = FrontSweep(project, effort, seen)
        try:
            sweep.look()
            front = sweep.front()
            numbers = front.spread(trials)
            projects = [front.points[number].project for number in numbers]
            bar.show("running in both worlds", 0, len(numbers))
            for done, (number, trial) in enumerate(each_of(tried, projects, on), 1):
                front = front.with_trial(numbers[number], trial)
                bar.show("running in both worlds", done, len(numbers))
        except KeyboardInterrupt:
            front = front or sweep.front()
            if not front.points:
                raise
            message = f"stopped by the user, with {len(front.points)} points"
            return front, StoppedError(Diagnostic("Interrupted", message))
    return front, None


def _written(
    front: ParetoFront, project: Project, folder: Path | None
) -> tuple[Sequence[str | None], list[Path]]:
    """Write the page and the files of the points into a folder, if there is one. Returns the
    commands that build the points, and the files."""
    from factory.apps.pareto.front import commands_of, point_files
    from factory.apps.pareto.page import floor_plans, front_page
    from factory.support.files import own_names, write_all

    if folder is None:
        return [None] * len(front.points), []
    commands = commands_of(front, folder)
    plans = floor_plans(front, folder)
    page = front_page(front, commands)
    files = {folder / PAGE_NAME: page.encode(), **point_files(front, folder), **plans}
    own_names(folder, files)
    write_all(files)
    return commands, list(files)


def _print(front: ParetoFront, commands: Sequence[str | None]) -> None:
    """Print the front as a table."""
    heads = ["robots", "tools", "lines", "relays", "cycle [s]", "least [s]", "floor [m²]"]
    tried, built = bool(front.trials), any(commands)
    heads += ["measured [s]", "predicted for that run [s]", "error"] * tried + ["command"] * built
    rows = [
        (*_row(point), *_measured(point)[: 3 * tried], *[command or ""] * built)
        for point, command in zip(front.points, commands, strict=True)
    ]
    title = f"{front.name}: {len(front.points)} points, {_looked_at(front)}"
    table(title, tuple(heads), rows)
    if front.written is not None:
        say(f"as written: {front.written}")
    say(f"lower bound: {front.least.total} robots, tools included")
    for words in (front.unproved, front.ending):
        if words:
            say(words)
    for point in front.points:
        for failure in point.trial.failures if point.trial else ():
            print(f"{point.robots} robots: the run failed: {failure}", file=sys.stderr)


def _looked_at(front: ParetoFront) -> str:
    laid_out = f", {front.laid_out} layouts" if front.laid_out else ""
    return f"{front.estimated} estimates{laid_out}"


def _row(point: FrontPoint) -> list[str]:
    figures = (point.seconds, point.bound, point.area)
    counts = (point.tools, len(point.lines), point.relays)
    return [
        f"{point.robots}",
        *(f"{count or ''}" for count in counts),
        *("" if figure is None else f"{figure:.2f}" for figure in figures),
    ]


def _measured(point: FrontPoint) -> tuple[str, str, str]:
    """The measured cycle time of a point, that predicted for the speeds that were drawn, and the
    error of this prediction."""
    trial = point.trial
    if trial is None:
        return "not run", "", ""
    if trial.error is None or trial.failures:
        return "failed", "", ""
    return f"{trial.measured:.2f}", f"{trial.predicted:.2f}", f"{100 * trial.error:+.1f} %"
