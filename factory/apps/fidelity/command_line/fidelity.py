"""The command `fidelity`."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from factory.commands import options as shared
from factory.commands.defaults import with_defaults
from factory.commands.grouped import Grouped
from factory.commands.outputs import writable
from factory.commands.requests import OutputOptions, ProjectOptions
from factory.commands.warnings import announced
from factory.support.console import emit, finite, say, table

if TYPE_CHECKING:
    from factory.apps.fidelity.record import Fidelity


@with_defaults
@click.command(cls=Grouped)
@shared.SOURCE
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
    type=shared.bounded("jitter"),
    default=0.3,
    help="Draw each robot's speed and gain at random within ± this fraction.",
)
@shared.JOBS
@shared.ON
@click.option("-o", "--output", type=shared.OUT, help="Write the figures to this file, as JSON.")
@click.option("--max-time", type=shared.SECONDS, help="Stop a run after this simulated time [s].")
@shared.FLOOR
@shared.RELAY
@shared.MOTION
@shared.OUTPUT
def fidelity(
    options: ProjectOptions,
    out: OutputOptions,
    seeds: int,
    units: int | None,
    jitter: float,
    jobs: int | None,
    on: str | None,
    output: Path | None,
    max_time: float | None,
) -> int:
    """Compare MuJoCo with the ideal world over the same seeds."""
    from factory.api import proved
    from factory.apps.fidelity import measure
    from factory.apps.sweep.pool import cores
    from factory.support.files import write_text
    from factory.support.progress import StepBar

    writable(output)
    project = options.project(out.silent)
    layout, settings = project.layout, project.settings
    proved(layout.factory.net)
    warnings = announced(layout.product.warnings, out)
    with StepBar("running", out.silent) as bar:

        def done(finished: int) -> None:
            bar.show("running", finished, seeds)

        jobs = jobs or cores()
        measured = measure(
            layout,
            range(seeds),
            units,
            jitter,
            settings,
            jobs,
            done=done,
            max_time=max_time,
            on=on,
        )
    document = measured.as_json()
    if output is not None:
        write_text(output, json.dumps(finite(document), indent=1) + "\n")
    if out.as_json:
        emit({**document, "warnings": warnings})
    else:
        _print(measured, out.verbose)
        if output is not None:
            say(f"wrote {output}")
    for trouble in (t for record in measured.seeds for t in record.trouble):
        print(trouble, file=sys.stderr)
    return 0 if measured.passed else 1


def _print(measured: Fidelity, verbose: bool) -> None:
    """Print the figures as a table."""
    from factory.apps.fidelity import QUANTITIES

    worst, mean = measured.worst(), measured.mean()
    rows = [
        (
            key,
            *(_shown(value) for value in (worst[key], mean[key])),
            q.unit,
            _shown(q.limit),
            "beyond its limit" if q.exceeded(worst[key]) else "",
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


def _shown(value: float | None) -> str:
    """A figure in few digits."""
    if value is None:
        return "–"
    return f"{value:.4g}" if abs(value) >= 1e-9 else "0"
