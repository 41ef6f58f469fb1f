"""The commands `run` and `render`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click

from factory.commands.options import (
    FLOOR,
    MOTION,
    OF_A_PICTURE,
    OUTPUT,
    PATH,
    PICTURE,
    RELAY,
    RUN,
    SOURCE,
    for_a_pag,
    pair,
    plan,
    settings_of,
    writable,
)
from factory.support.console import emit, say, warn


@click.command()
@SOURCE
@RUN
@click.option("--video", type=PATH, help="Film the run (.mp4).")
@click.option("--log", type=PATH, help="Keep every tick in a file.")
@click.option(
    "--distributed", is_flag=True, help="Each robot runs its own program (paper, section 6)."
)
@click.option(
    "--monitor", is_flag=True, help="Watch the engine alone, and judge the run against the net."
)
@PICTURE
@FLOOR
@RELAY
@MOTION
@OUTPUT
def run(
    file: Path,
    folders: tuple[Path, ...],
    video: Path | None,
    log: Path | None,
    floor: str | None,
    as_json: bool,
    quiet: bool,
    verbose: bool,
    **options: Any,
) -> int:
    """Run FILE.pag until its products are dropped off."""
    from factory.commands.run_factory import run_file, say_violations

    writable(file, video, log, options["poster"])
    settings = settings_of(file, options)
    source, factory, layout = plan(file, folders, settings, floor, options)
    warn(layout.product.warnings, quiet)
    size = pair(options["size"], "--size", "1280x720", int)
    record = run_file(source, layout, settings, video, log, size, quiet or as_json, options)
    if as_json:
        document = record.as_json()
        document.pop("schema")
        trouble = [record.trouble.as_json()] if record.trouble else []
        emit({**document, **({"errors": trouble} if trouble else {})})
    elif not quiet:
        from factory.commands.run_factory import summarise

        summarise(record, factory, verbose)
    say_violations(record.monitor)
    if record.trouble is not None:
        print(record.trouble, file=sys.stderr)
    return 0 if record.succeeded else 1


@click.command()
@SOURCE
@click.option(
    "-o",
    "--output",
    type=PATH,
    required=True,
    help="OUT.mp4, or OUT.png for a still.",
)
@click.option("--at", default="end", help="Time of a still [s], or `end`.")
@RUN
@PICTURE
@FLOOR
@RELAY
@MOTION
@OUTPUT
def render(
    file: Path,
    folders: tuple[Path, ...],
    output: Path,
    at: str,
    floor: str | None,
    as_json: bool,
    quiet: bool,
    verbose: bool,
    **options: Any,
) -> int:
    """Film FILE.pag, or a LOG that `run --log` has kept, headless through EGL."""
    from factory.commands.run_factory import render_file, simulation
    from factory.record.log import is_log

    if is_log(file):
        for_a_pag(file, "a log", "output", "at", *OF_A_PICTURE)
    writable(file, output, options["poster"])
    size = pair(options["size"], "--size", "1280x720", int) or (1280, 720)

    def prepare() -> Any:
        settings = settings_of(file, options)
        source, _, layout = plan(file, folders, settings, floor, options)
        warn(layout.product.warnings, quiet)
        return simulation(source, layout, settings, options)

    document = render_file(file, output, at, size, quiet or as_json, options, prepare)
    if as_json:
        emit(document)
    elif not quiet:
        say(
            f"{output}: {document['frames']} frames of {document['width']}x{document['height']}, "
            f"{document['seconds']:.1f} s"
        )
    return 0
