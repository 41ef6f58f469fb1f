"""The command `fidelity`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from factory.commands.grouped import Grouped
from factory.commands.options import (
    FLOOR,
    JOBS,
    MOTION,
    OUTPUT,
    PATH,
    RELAY,
    SECONDS,
    SOURCE,
    Number,
)
from factory.commands.outputs import writable, writable_folder
from factory.commands.requests import OutputOptions, ProjectOptions
from factory.commands.warnings import announced
from factory.support.console import emit, say, table

if TYPE_CHECKING:
    from factory.study.fidelity.convergence import Study
    from factory.study.fidelity.record import Fidelity


@click.command(cls=Grouped)
@SOURCE
@click.option(
    "--seeds", type=click.IntRange(1, 10_000), default=5, help="Number of runs: seeds 0 to K - 1."
)
@click.option(
    "--units",
    type=click.IntRange(1, 10**6),
    help="Products per run (default: 4 to 100, until the cycle time is that of the net).",
)
@click.option(
    "--jitter",
    type=Number(0, 0.9),
    default=0.3,
    help="Draw each robot's speed and gain at random within ± this fraction.",
)
@JOBS
@click.option(
    "--convergence/--no-convergence",
    default=True,
    help="Repeat seed 0 with other timesteps and weld stiffnesses.",
)
@click.option("-o", "--output", type=PATH, help="Folder for a report, or a .json file.")
@click.option("--max-time", type=SECONDS, help="Stop a run after this simulated time [s].")
@FLOOR
@RELAY
@MOTION
@OUTPUT
def fidelity(
    options: ProjectOptions,
    out: OutputOptions,
    seeds: int,
    units: int | None,
    jitter: float,
    jobs: int | None,
    convergence: bool,
    output: Path | None,
    max_time: float | None,
) -> int:
    """Compare FILE.pag in MuJoCo with the ideal world over the same seeds."""
    from factory.nets.verify import proved
    from factory.study.bar import RunsBar
    from factory.study.fidelity import measure, study
    from factory.study.fidelity.comparing import Case
    from factory.study.fidelity.convergence import runs
    from factory.study.fidelity.report import check_report, document, write_report
    from factory.study.pool import cores

    check_report(output)
    if output is not None:
        is_file = output.suffix.lower() == ".json"
        writable(options.file, output) if is_file else writable_folder(output)
    project = options.project(out.silent)
    layout, settings = project.layout, project.settings
    proved(layout.factory.net)
    warnings = announced(layout.product.warnings, out)
    jobs = jobs or cores()
    with RunsBar(seeds + (runs() if convergence else 0), 0, out.silent) as bar:

        def done(finished: int) -> None:
            bar.advance()

        measured = measure(layout, range(seeds), units, jitter, settings, jobs, done, max_time)
        case = Case(layout, units, jitter, settings, max_time)
        studied = study(case, 0, jobs, done) if convergence else None
    written = [] if output is None else write_report(output, measured, studied)
    if out.as_json:
        emit({**document(measured, studied), "warnings": warnings})
    else:
        _print(measured, studied, out.verbose)
        for path in written:
            say(f"wrote {path}")
    for trouble in (t for record in measured.seeds for t in record.trouble):
        print(trouble, file=sys.stderr)
    return 0 if measured.passed else 1


def _print(measured: Fidelity, studied: Study | None, verbose: bool) -> None:
    """Print the figures as a table."""
    from factory.study.fidelity import QUANTITIES
    from factory.study.fidelity.report import remark, shown

    worst, mean = measured.worst(), measured.mean()
    rows = [
        (
            key,
            shown(worst[key]),
            shown(mean[key]),
            q.unit,
            shown(q.limit),
            remark(key, worst[key], studied),
        )
        for key, q in QUANTITIES.items()
        if worst[key] is not None
    ]
    title = f"{measured.product}: {measured.runs}, jitter {measured.jitter:g}"
    table(title, ("figure", "worst", "mean", "unit", "limit", ""), rows)
    if verbose:
        for q in QUANTITIES.values():
            say(f"{q.key} [{q.unit}]: {q.definition}")
    say("all runs passed" if measured.passed else "SOME RUN FAILED")
    for record in measured.seeds:
        for pair in record.contacts:
            say(f"  seed {record.seed}, contact: {pair}")
        for penetration in record.hidden if verbose else ():
            say(f"  seed {record.seed}, penetration: {penetration}")
