"""The command `report`."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import click

from factory.commands.grouped import Grouped
from factory.commands.options import (
    DRAW,
    FLOOR,
    LENIENT,
    MOTION,
    OUTPUT,
    PATH,
    RELAY,
    RUNS,
    SECONDS,
    SOURCE,
    WIP,
)
from factory.commands.outputs import for_a_pag, writable
from factory.commands.requests import OutputOptions, ProjectOptions, RunOptions
from factory.commands.run import run_project, summarise
from factory.commands.warnings import announced
from factory.support.console import emit, say

if TYPE_CHECKING:
    from factory.show.report.recording import Recording
    from factory.simulation.run import Run

    _Made = tuple[Recording, Run, list[dict[str, object]]]


@click.command(cls=Grouped)
@SOURCE
@click.option("-o", "--output", type=PATH, required=True, help="Output page: OUT.html.")
@click.option(
    "--units",
    type=click.IntRange(1, 10_000),
    default=4,
    help="Number of products to make; the cycle time is measured from 4 on.",
)
@DRAW
@WIP
@click.option("--max-time", type=SECONDS, help="Stop after this simulated time [s].")
@LENIENT
@RUNS
@FLOOR
@RELAY
@MOTION
@OUTPUT
def report(options: ProjectOptions, asked: RunOptions, out: OutputOptions, output: Path) -> int:
    """Write one HTML page about a run of FILE.pag, or about the run in a LOG of `run --log`.

    The page is always written. The exit status is 1 if the run failed, or was cut off before its
    units were made; --lenient ignores what its bodies do."""
    from factory.record.log import is_log
    from factory.show.report import page, recording_of
    from factory.support.files import write_text

    writable(options.file, output)
    run = None
    warnings: list[dict[str, object]] = []
    if is_log(options.file):
        for_a_pag(options.file, "a log", "output", "lenient")
        recording = recording_of(options.file)
    else:
        recording, run, warnings = _run(options, asked, out)
    text = page(recording)
    write_text(output, text)
    size, cut = len(text.encode()), recording.log.cut_off
    verdict = run.verdict if run else replace(recording.verdict, lenient=asked.lenient)
    document = {
        "output": str(output),
        "bytes": size,
        "products": int(recording.log.delivered[-1]),
        "sim_time_s": round(recording.end, 6),
        "cut_off": cut and cut.as_json(),
        "predicted": recording.layout is not None,
        "verdict": verdict.as_json(),
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
        print(cut.diagnostic(options.file), file=sys.stderr)
    for failure in verdict.failures if run else verdict.failures[bool(cut) :]:
        print(failure, file=sys.stderr)
    return 0 if verdict.succeeded else 1


def _run(options: ProjectOptions, asked: RunOptions, out: OutputOptions) -> _Made:
    """A run without fused parts, since the report follows each part; its log is temporary. Returns
    the warnings too."""
    from factory.show.report import recording_of

    project = options.project(out.silent)
    warnings = announced(project.layout.product.warnings, out)
    with TemporaryDirectory(prefix="factory-") as folder:
        log = Path(folder) / "run.log"
        run = run_project(project, replace(asked, fuse=False), out.silent, log)
        recording = recording_of(log, project.layout)
    return recording, run, warnings
