"""Questions to the user about a source: on a terminal they are asked, elsewhere they are errors."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import click

from factory.api import InputError
from factory.support.bounds import LENGTHS

if TYPE_CHECKING:
    from factory.apps.planning.parts import InPlace
    from factory.apps.planning.source import SourceOptions


def is_terminal() -> bool:
    """Whether the user can read a question and answer it."""
    return sys.stdin.isatty() and sys.stderr.isatty()


def asked(
    read: Callable[[SourceOptions], InPlace], options: SourceOptions, silent: bool
) -> InPlace:
    """The parts that `read` makes of a source. If its unit is unknown, or its parts do not seem to
    be in place, the user is asked, unless `silent` or not on a terminal. Raises InputError as
    `read` does, also if the user says no."""
    while True:
        try:
            return read(options)
        except InputError as error:
            codes = {diagnostic.code for diagnostic in error.diagnostics}
            if silent or not is_terminal() or codes not in ({"Unit"}, {"NotInPlace"}):
                raise
            click.echo("\n".join(d.message for d in error.diagnostics), err=True)
            if codes == {"Unit"}:
                unit = click.prompt("unit of lengths", type=click.Choice(LENGTHS), err=True)
                options = replace(options, unit=unit)
            elif click.confirm("plan them where they are?", err=True):
                options = replace(options, in_place=True)
            else:
                raise
