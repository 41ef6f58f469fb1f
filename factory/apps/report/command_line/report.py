"""The command `report`."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import click

from factory.apps.runs.options import RunOptions
from factory.commands import options as shared
from factory.commands.defaults import with_defaults
from factory.commands.grouped import Grouped
from factory.commands.outputs import for_a_pag, writable
from factory.commands.requests import OutputOptions, ProjectOptions
from factory.commands.summaries import summarise
from factory.commands.warnings import announced
from factory.support.console import emit, say


@with_defaults
@click.command(cls=Grouped)
@shared.SOURCE
@click.option("-o", "--output", type=shared.OUT, required=True, help="Output page: OUT.html.")
@click.option(
    "--units",
    type=click.IntRange(1, 10_000),
    help="Number of products to make (default: as many as it takes to measure a cycle time).",
)
@shared.DRAW
@shared.WIP
@click.option("--max-time", type=shared.SECONDS, help="Stop after this simulated time [s].")
@shared.LENIENT
@shared.STRICT
@shared.RUNS
@shared.FLOOR
@shared.RELAY
@shared.MOTION
@shared.OUTPUT
def report(
    options: ProjectOptions,
    asked: RunOptions,
    out: OutputOptions,
    output: Path,
    units: int | None,
) -> int:
    """Write one HTML page about a run.

    Runs FILE.pag, or takes the run in a LOG of `run --log`. The page is always written. The exit
    status is 1 if the run failed, or was cut off before its units were made; --lenient ignores what
    its bodies do, and with --strict a run whose success is qualified fails."""
    from factory.api import Run
    from factory.apps.log import is_log
    from factory.apps.report.page import report_on
    from factory.support.files import write_text

    file = options.file
    writable(output)
    warnings: list[dict[str, object]] = []
    if is_log(file):
        for_a_pag(file, "a log", "output", "lenient", "strict")
        made = report_on(file)
    else:
        asked.check_combination()
        project = options.project(out.silent)
        asked = replace(asked, units=units or Run.steady_from(project.plain.period))
        warnings = announced(project.layout.product.warnings, out)
        made = report_on(project, asked, out.silent)
    write_text(output, made.text)
    recording, run = made.recording, made.run
    size, cut = len(made.text.encode()), recording.log.cut_off
    verdict = run.verdict if run else recording.verdict
    verdict = replace(verdict, lenient=asked.lenient, strict=asked.strict)
    document = {
        "output": str(output),
        "bytes": size,
        "products": int(recording.log.delivered[-1]),
        "sim_time_s": round(recording.end, 6),
        "cut_off": cut and cut.as_json(),
        "predicted": recording.layout is not None,
        "verdict": verdict.as_json(),
        "qualified": [*verdict.qualified],
        "warnings": warnings,
    }
    if out.as_json:
        emit(document)
    else:
        say(f"{output}: {size / 1e6:.1f} MB, {recording.end:.2f} s of a run")
        if recording.missing:
            say(f"  no predictions: {recording.missing}")
        if run is not None and out.verbose:
            summarise(run, recording.factory, out.verbose)
    if cut and run is None:
        print(cut.diagnostic(file), file=sys.stderr)
    for failure in verdict.failures if run else verdict.failures[bool(cut) :]:
        print(failure, file=sys.stderr)
    return 0 if verdict.succeeded else 1
