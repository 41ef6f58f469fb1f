"""The command `analyze`."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from factory.api import Diagnostic, InputError
from factory.apps.runs.options import RunOptions
from factory.commands import options as shared
from factory.commands.defaults import with_defaults
from factory.commands.grouped import Grouped
from factory.commands.requests import OutputOptions, ProjectOptions
from factory.commands.warnings import announced, cut_off, read_partly
from factory.support.console import emit, say, table
from factory.support.errors import usage_error

if TYPE_CHECKING:
    from factory.api import Factory, Project, Timing
    from factory.apps.analyze import Analysis, Change
    from factory.apps.analyze.measured import RunRecord
    from factory.apps.log import Log


@dataclass(frozen=True, slots=True)
class AnalyzeOptions:
    """The record that an analysis is compared with, and the changes whose effect it predicts."""

    measured: Path | None
    on_the_spot: bool
    seconds: tuple[str, ...]
    faster: tuple[str, ...]
    shorter: tuple[str, ...]

    def log(self, silent: bool) -> Log | None:
        """The log to compare with. Raises InputError."""
        if self.measured is None:
            return None
        if self.on_the_spot:
            raise usage_error("--measured LOG and --run exclude each other", "leave one out")
        return read_partly(self.measured, silent)

    def change(self, factory: Factory) -> tuple[str, Change] | None:
        """The change of a what-if question and its description; None without. Raises InputError."""
        from factory.apps.analyze.analysing import change_of

        faster = dict(_percent(text, "--faster") for text in self.faster)
        shorter = dict(_percent(text, "--shorter") for text in self.shorter)
        return change_of(factory, self.seconds, faster, shorter)


@with_defaults
@click.command(cls=Grouped)
@shared.SOURCE
@click.option("--units", type=click.IntRange(1, 10_000), default=20, help="Number of products.")
@click.option(
    "--world",
    type=click.Choice(["mujoco", "ideal"]),
    default="mujoco",
    help="World whose timing is analysed: MuJoCo, or the paper's ideal world.",
)
@shared.DRAW
@shared.WIP
@click.option("--second", "seconds", multiple=True, help="What-if: a second robot like r4.")
@click.option("--faster", multiple=True, help="What-if: a robot faster by percent, r4=20.")
@click.option("--shorter", multiple=True, help="What-if: its paths shorter by percent, r4=20.")
@click.option(
    "--measured", type=shared.PATH, help="Compare with the LOG of a run, under its settings."
)
@click.option("--run", "on_the_spot", is_flag=True, help="Compare with a run of --units.")
@shared.gathered(AnalyzeOptions, "study")
@shared.RUNS
@shared.FLOOR
@shared.RELAY
@shared.MOTION
@shared.OUTPUT
def analyze(
    options: ProjectOptions,
    asked: RunOptions,
    study: AnalyzeOptions,
    out: OutputOptions,
) -> int:
    """Find the bottleneck of FILE.pag, and what would relieve it."""
    from factory.api import Timing, proved
    from factory.apps.analyze import analyse
    from factory.apps.analyze.document import document
    from factory.apps.analyze.measured import Conditions, conditions, logged_record

    log = study.log(out.silent)
    made = (
        Conditions(options.settings(), asked.world, asked.seed, asked.jitter, asked.wip)
        if log is None
        else conditions(log.header)
    )
    project = options.project(out.silent, made.settings)
    layout = project.layout
    proved(layout.factory.net)
    warnings = announced(layout.product.warnings, out)
    timing = Timing(layout, made.settings, made.world, made.seed, made.jitter)
    change = study.change(layout.factory)
    record: RunRecord | None = None
    status = 0
    if log is not None:
        record = logged_record(str(study.measured), log, layout.factory)
    elif study.on_the_spot:
        record, status = _run(project, timing, asked, out.silent)
    units = len(record.dropoffs) if record else asked.units
    analysis = analyse(timing, units, made.wip, change, record)
    if out.as_json:
        emit({**document(analysis), "warnings": warnings, **cut_off(log)})
    else:
        _print(analysis, options, out.verbose)
    return status


def _print(analysis: Analysis, options: ProjectOptions, verbose: bool) -> None:
    from factory.apps.analyze.tables import summary, tables

    for line in (*summary(analysis), *_spare_branches(analysis, options)):
        say(line)
    for made in tables(analysis, verbose):
        table(made.title, made.columns, made.rows)
        if made.note:
            say(f"{made.note}\n")


def _spare_branches(analysis: Analysis, options: ProjectOptions) -> Iterator[str]:
    """For each branch that is there several times, though the factory with one is no slower: the
    cycle times of both, in words."""
    from factory.apps.analyze.timed import timed_net
    from factory.support.files import is_plan

    timing, pace = analysis.timing, analysis.net.pace
    for label, count in () if is_plan(options.file) else options.branches():
        fewer = replace(options, parallel=(*options.parallel, (label, 1)))
        layout = fewer.project(settings=timing.settings).layout
        one = timed_net(replace(timing, layout=layout), wip=analysis.wip).pace
        if one <= pace:
            words = f"{one:.3f} s with one, {pace:.3f} s with {count}"
            yield f"one branch for {label} would do: {words}"


def _run(
    project: Project, timing: Timing, asked: RunOptions, silent: bool
) -> tuple[RunRecord, int]:
    """A run without fused parts, and its exit status."""
    from factory.api import Simulation
    from factory.apps.analyze.measured import record_of
    from factory.apps.runs.executing import carry_out
    from factory.apps.runs.watched import watched

    request = replace(asked, fuse=False).request(project, shown=False)
    run = carry_out(Simulation(timing.layout, request), silent, go=watched)
    for failure in run.verdict.failures:
        print(failure, file=sys.stderr)
    return record_of(run), 0 if run.succeeded else 1


def _percent(text: str, option: str) -> tuple[str, float]:
    """`r4=20` as the name of a robot and a number. Raises InputError (BadValue)."""
    name, _, number = text.partition("=")
    try:
        return name, float(number)
    except ValueError:
        message = f"{option} takes a robot and percent above 0, not '{text}'"
        hint = f"for example {option} r1=20"
        raise InputError(Diagnostic("BadValue", message, None, hint)) from None
