"""The commands that need no layout: check and programs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from factory.commands.options import (
    OUTPUT,
    PATH,
    RELAY,
    SOURCE,
    WIP,
    for_a_pag,
    ground,
    plan,
    settings_of,
    writable,
    writable_folder,
)
from factory.support.collector import collector_paused
from factory.support.console import emit, say, warn
from factory.support.errors import Diagnostic, InputError, did_you_mean
from factory.support.files import is_net

if TYPE_CHECKING:
    from factory.plant.factory import Factory


@click.command()
@SOURCE
@click.option("--certificate", type=PATH, help="Write the proof here.")
@WIP
@click.option("--clashes", type=PATH, help="Write a picture of each blocked operation in a folder.")
@RELAY
@OUTPUT
@collector_paused()
def check(
    file: Path,
    folders: tuple[Path, ...],
    certificate: Path | None,
    wip: int | None,
    clashes: Path | None,
    as_json: bool,
    quiet: bool,
    verbose: bool,
    **options: Any,
) -> int:
    """Parse, compile and prove FILE.pag (or a net in FILE.pnml)."""
    from factory.commands.check_product import check_file, describe

    if is_net(file):
        for_a_pag(file, "a net in PNML", "certificate")
    writable(file, certificate)
    writable_folder(clashes)
    checked = check_file(file, folders, wip, _relayed(file, folders, options))
    warn(checked.warnings, quiet)
    if clashes is not None:
        from factory.support.files import own_names, write_all

        files = checked.pictures(clashes)
        own_names(clashes, files, [file])
        write_all(files)
    if certificate is not None:
        from factory.support.files import write_text

        write_text(certificate, checked.certificate())
    if as_json:
        emit(checked.as_json())
    elif not quiet:
        describe(checked, verbose)
    return 0 if checked.verdict.holds else 1


def _relayed(file: Path, folders: Sequence[Path], options: dict[str, Any]) -> Factory | None:
    """The factory with relays, where they are asked for: they depend on the layout."""
    if not ground(None, options).relays:
        return None
    factory: Factory = plan(file, folders, settings_of(file, {}), None, options)[1]
    return factory


@click.command()
@SOURCE
@click.option("--robot", help="Only this robot, as r3.")
@RELAY
@OUTPUT
def programs(
    file: Path,
    folders: tuple[Path, ...],
    robot: str | None,
    as_json: bool,
    quiet: bool,
    verbose: bool,
    **options: Any,
) -> int:
    """Print each robot's program, in the paper's form."""
    from factory.pipeline import read
    from factory.plant.programs import program_of, write_program

    factory = _relayed(file, folders, options) or read(file, folders).compile()
    names = [r.name for r in factory.robots]
    if robot is not None and robot not in names:
        hint = did_you_mean(robot, names, "robots")
        raise InputError(Diagnostic("Usage", f"there is no robot '{robot}'", None, hint))
    chosen = [r for r in factory.robots if robot in (None, r.name)]
    texts = {r.name: write_program(program_of(factory, r.index)) for r in chosen}
    if as_json:
        emit({"programs": texts})
    else:
        say("\n\n".join(texts.values()))
    return 0
