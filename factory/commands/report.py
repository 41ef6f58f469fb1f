"""The command `report`."""

from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import click

from factory.commands.options import (
    DRAW,
    FLOOR,
    MOTION,
    OUTPUT,
    PATH,
    RELAY,
    SOURCE,
    WIP,
    Number,
    for_a_pag,
    plan,
    settings_of,
    writable,
)
from factory.support.console import emit, say, warn

if TYPE_CHECKING:
    from factory.simulation.run import Run


@click.command()
@SOURCE
@click.option("-o", "--output", type=PATH, required=True, help="The page: OUT.html.")
@click.option("--units", type=click.IntRange(1, 10_000), default=3, help="Products of the run.")
@DRAW
@WIP
@click.option("--max-time", type=Number(0, min_open=True), help="Stop after this time [s].")
@FLOOR
@RELAY
@MOTION
@OUTPUT
def report(
    file: Path,
    folders: tuple[Path, ...],
    output: Path,
    floor: str | None,
    as_json: bool,
    quiet: bool,
    verbose: bool,
    **options: Any,
) -> int:
    """Write one HTML page about a run of FILE.pag, or the run in a LOG that `run --log` kept."""
    from factory.record.log import is_log
    from factory.show.report import page, recording_of
    from factory.support.files import write_text

    writable(file, output)
    run = None
    if is_log(file):
        for_a_pag(file, "a log", "output")
        recording = recording_of(file)
    else:
        recording, run = _run(file, folders, floor, quiet, as_json, options)
    text = page(recording)
    write_text(output, text)
    size = len(text.encode())
    document = {
        "output": str(output),
        "bytes": size,
        "products": int(recording.log.delivered[-1]),
        "sim_time_s": round(recording.end, 6),
        "predicted": recording.layout is not None,
    }
    if as_json:
        emit(document)
    elif not quiet:
        say(f"{output}: {size / 1e6:.1f} MB, {recording.end:.2f} s of a run")
        if recording.missing:
            say(f"  no predictions: {recording.missing}")
        if run is not None and verbose:
            from factory.commands.run_factory import summarise

            summarise(run, recording.factory, verbose)
    return 0 if run is None or run.succeeded else 1


def _run(
    file: Path,
    folders: tuple[Path, ...],
    floor: str | None,
    quiet: bool,
    as_json: bool,
    options: dict[str, Any],
) -> tuple[Any, Run]:
    """A run to be told about, with its log in a folder that is gone afterwards."""
    from factory.commands.run_factory import run_file
    from factory.show.report import recording_of

    settings = settings_of(file, options)
    options = {**options, "fuse": False}  # each part is told of by itself
    source, _, layout = plan(file, folders, settings, floor, options)
    warn(layout.product.warnings, quiet)
    with TemporaryDirectory(prefix="factory-") as folder:
        log = Path(folder) / "run.log"
        run = run_file(source, layout, settings, None, log, None, quiet or as_json, options)
        recording = recording_of(log, layout)
    if run.trouble is not None:
        print(run.trouble, file=sys.stderr)
    return recording, run
