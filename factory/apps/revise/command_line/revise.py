"""The command `revise`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from factory.api import RunError
from factory.commands.options import OUT, OUTPUT, PATH, TEMPLATES, pag_files
from factory.commands.outputs import writable, writable_folder
from factory.commands.requests import OutputOptions, ProjectOptions
from factory.support.console import emit, say, warn
from factory.support.progress import Waiting

if TYPE_CHECKING:
    from factory.apps.revise.revision import Pin


@click.command()
@click.argument("old", type=PATH, shell_complete=pag_files)
@click.argument("new", type=PATH, shell_complete=pag_files)
@TEMPLATES
@click.option("-o", "output", type=OUT, help="Folder for NEW's factory, as `build` writes it.")
@click.option(
    "--pin",
    type=click.Choice(["all", "hands", "none"]),
    default="all",
    help="What to keep of OLD's layout, as far as possible.",
)
@click.option(
    "--afresh", is_flag=True, help="Also give the cycle time of a layout that keeps nothing."
)
@click.option(
    "--live", is_flag=True, help="Also lay out a floor for both products, to switch during a run."
)
@click.option("--picture", type=OUT, help="Draw what stays on NEW's floor: OUT.svg.")
@OUTPUT
def revise(
    old: Path,
    new: Path,
    folders: tuple[Path, ...],
    output: Path | None,
    pin: Pin,
    afresh: bool,
    live: bool,
    picture: Path | None,
    out: OutputOptions,
) -> int:
    """Revise a factory for a new product, and keep most of it.

    Reports what can stay of the factory of OLD.pag, or of a plan.json, and lays out NEW.pag to keep
    as much as possible.

    With --live, -o DIR also writes DIR/family.pag, the mix of both, and DIR/live.csv, orders for a
    change: factory run DIR/family.pag --demand DIR/live.csv --units 18 --wip 4"""
    from factory.api import pace, proved
    from factory.apps.exports.build import BuildRequest, build
    from factory.apps.revise.live import FAMILY_NAME, ORDERS_NAME, LiveChange
    from factory.apps.revise.revision import revised
    from factory.support.files import own_names, write_all

    writable(picture)
    writable_folder(output)
    options, seconds = ProjectOptions(old, folders), None
    before = options.project(out.silent)
    after = replace(options, file=new).project(out.silent, before.settings)
    request = BuildRequest(None, output)
    request.claim(after.name)
    if live and output is not None:
        own_names(output, (output / name for name in (FAMILY_NAME, ORDERS_NAME)))
    with Waiting("laying out with what stays", out.silent):
        revision = revised(before, after, pin)
        verdict = proved(revision.new.layout.factory.net)
        if afresh:
            try:
                seconds = pace(after.layout, after.settings)[0].seconds
            except RunError as error:
                warn(replace(d, message=f"laid out afresh: {d.message}") for d in error.diagnostics)
        change = LiveChange.of(before, after, output or Path()) if live else None
    files: list[str] = []
    if output is not None:
        with Waiting("compiling the model", out.silent):
            built = build(revision.new, verdict, request)
        files += map(str, built.files)
    if output is not None and change is not None:
        texts = {output / name: text.encode() for name, text in change.files.items()}
        write_all(texts)
        files += map(str, texts)
    if picture is not None:
        write_all({picture: revision.drawing.encode()})
        files.append(str(picture))
    if out.as_json:
        also = {"live": change.as_json()} if change else {}
        emit({**revision.as_json(seconds), **also, "files": files})
    else:
        in_words = change.words() if change else ()
        listed = (f"  {file}" for file in files if out.verbose)
        for line in (*revision.words(seconds), *in_words, *listed):
            say(line)
    return 0
