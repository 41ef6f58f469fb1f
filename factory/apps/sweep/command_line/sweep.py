"""The command `sweep`."""

from __future__ import annotations

import sys
from dataclasses import asdict, astuple, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from factory.commands import options as shared
from factory.commands.grouped import Grouped
from factory.commands.outputs import writable
from factory.commands.requests import OutputOptions, ProjectOptions
from factory.commands.warnings import announced
from factory.support.console import emit, say, table
from factory.support.errors import usage_error

if TYPE_CHECKING:
    from factory.apps.sweep.summary import Summary
    from factory.apps.sweep.sweeping import Tally

SHOWN = 8
"""The most reasons of failed runs that are printed."""


@dataclass(frozen=True, slots=True)
class SweepOptions:
    """The values that all runs of a sweep share, None if not options, and how runs are executed."""

    world: str | None
    units: int | None
    seed: int | None
    jitter: float | None
    wip: int | None
    max_time: float | None
    fuse: bool | None
    jobs: int | None
    on: str | None
    retry: bool


@click.command(cls=Grouped)
@click.argument("source", metavar="[FILE]", type=shared.PATH, required=False)
@shared.TEMPLATES
@click.option(
    "--vary",
    multiple=True,
    metavar="KEY=VALUES",
    help="Values to vary: seed=0:100, jitter=0.1,0.3, speed=0.2:0.6:0.1 ... (repeatable).",
)
@click.option("-o", "--output", "database", type=shared.OUT, help="Database of the results.")
@shared.JOBS
@shared.ON
@click.option("--retry", is_flag=True, help="Repeat failed runs.")
@click.option("--summary", is_flag=True, help="Print means, deviations and confidence intervals.")
@click.option("--world", type=click.Choice(["mujoco", "ideal"]), help="As for `run`.")
@click.option("--units", type=shared.UNITS, help="Products per run (default: 4).")
@click.option("--seed", type=shared.SEEDS, help="As for `run`.")
@click.option("--jitter", type=shared.bounded("jitter"), help="As for `run` (default: 0).")
@shared.WIP
@click.option("--max-time", type=shared.SECONDS, help="Stop a run after this time [s].")
@click.option("--fuse/--no-fuse", default=None, help="As for `run`.")
@shared.gathered(SweepOptions, "runs")
@shared.PROJECT
@shared.FLOOR
@shared.RELAY
@shared.MOTION
@shared.OUTPUT
def sweep(
    options: ProjectOptions,
    runs: SweepOptions,
    out: OutputOptions,
    source: Path | None,
    database: Path | None,
    vary: tuple[str, ...],
    summary: bool,
) -> int:
    """Run FILE.pag for all combinations of varied values.

    The results are kept in SQLite. Called again, the sweep continues where it stopped. `factory
    sweep RESULTS --summary` summarises the results so far, also during a sweep.
    """
    document: dict[str, Any] = {}
    failed = False
    if vary:
        if source is None:
            raise usage_error("there is no FILE.pag", "see sweep --help")
        if database is None:
            raise usage_error("there is no database for the results", "for example -o results.db")
        tally, warnings = _carry_out(replace(options, file=source), runs, database, vary, out)
        failed = tally.failed + tally.there_failed > 0
        document = {"database": str(database), **tally.as_json()}
        document["warnings"] = warnings
        if not out.as_json:
            _print(tally, database)
    elif not summary:
        raise usage_error("there is nothing to vary", "for example --vary seed=0:100")
    if summary:
        document["summary"] = _summarise(database or source, out)
    if out.as_json:
        emit(document)
    return 1 if failed else 0


def _carry_out(
    options: ProjectOptions,
    runs: SweepOptions,
    database: Path,
    vary: tuple[str, ...],
    out: OutputOptions,
) -> tuple[Tally, list[dict[str, object]]]:
    """Plan, prove and run a sweep. Returns the warnings too. Raises InputError."""
    from factory.apps.sweep.grid import read_axes
    from factory.apps.sweep.pool import cores
    from factory.apps.sweep.recipe import recipe_of
    from factory.apps.sweep.sweeping import sweep

    writable(database)
    axes = read_axes(vary)
    asked = asdict(options)
    for axis in axes:
        if asked.get(axis.key) is not None:
            raise usage_error(f"{axis.key} is both given and varied", "leave one of them out")
    project = options.project(out.silent)
    recipe = recipe_of(project, axes, asdict(runs), runs.max_time, runs.fuse)
    warnings = announced(project.product.warnings, out)
    jobs = runs.jobs or cores()
    return sweep(recipe, axes, database, jobs, runs.retry, out.silent, runs.on), warnings


def _print(tally: Tally, database: Path) -> None:
    """Print the result of a sweep."""
    there = f"{tally.there} of {tally.runs} already done"
    if tally.there_failed:
        there += f", of which {tally.there_failed} failed; --retry runs them again"
    there = f" ({there})" if tally.there else ""
    say(f"{tally.done + tally.failed} runs, {tally.failed} failed{there}: {database}")
    if tally.overhead is not None:
        say(
            f"{tally.rate:.1f} runs/s in {tally.wall_time_s:.1f} s; "
            f"overhead {100 * tally.overhead:.1f} % of a run"
        )


def _summarise(database: Path | None, out: OutputOptions) -> dict[str, Any]:
    """Summarise a database. Returns the key `summary` of `sweep --summary --json`."""
    from factory.apps.sweep.summary import summarise

    if database is None:
        raise usage_error("there is no database", "factory sweep RESULTS --summary")
    result = summarise(database)
    if not out.as_json:
        _print_summary(result, out.verbose)
    return result.as_json()


def _print_summary(result: Summary, verbose: bool) -> None:
    """A table for each group: figure, mean, spread, confidence interval."""
    from factory.apps.sweep.summary import CONFIDENCE, FIRST

    heads = ("figure", "mean", "deviation", f"{CONFIDENCE:.0%} from", "to", "least", "greatest")
    for group in result.groups:
        at = ", ".join(f"{key} {value}" for key, value in group.values) or result.product
        rows = [
            (key, *map(_shown, astuple(s)[1:]))
            for key, s in group.figures.items()
            if verbose or s.least != s.greatest or key in FIRST
        ]
        title = f"{at}: {group.done + group.failed} runs, {group.failed} failed"
        table(title, heads, rows) if rows else say(title)
    for reason, count in list(result.reasons.items())[:SHOWN]:
        print(f"{count} failed: {reason}", file=sys.stderr)


def _shown(value: float | None) -> str:
    return "–" if value is None else f"{value:.6g}"
