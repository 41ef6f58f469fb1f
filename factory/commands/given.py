"""Options that mean nothing where they are given."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import click
from click.core import ParameterSource

from factory.commands.options import OF_A_PICTURE
from factory.support.errors import Diagnostic, InputError


def for_a_pag(file: Path, kind: str, *but: str) -> None:
    """Refuses the options that mean nothing for a FILE that is no PAG but, say, a log: all that are
    given on the command line `but` these, and those of OUTPUT. Raises InputError (Usage) with every
    one."""
    but = (*but, "file", "as_json", "quiet", "verbose")
    words, hint = f"applies to a PAG; '{file}' is {kind}", "leave it out"
    _refuse_given(lambda name: name not in but, words, hint)


def for_a_film() -> None:
    """Refuses the options of PICTURE that are given on the command line where nothing is filmed.
    Raises InputError (Usage) with every one."""
    words, hint = "applies to a film, and there is none", "add --video OUT.mp4"
    _refuse_given(OF_A_PICTURE.__contains__, words, hint)


def _refuse_given(which: Callable[[str], bool], words: str, hint: str) -> None:
    context = click.get_current_context()
    given = [
        max(option.opts, key=len)
        for option in context.command.params
        if option.name is not None
        and which(option.name)
        and context.get_parameter_source(option.name) is ParameterSource.COMMANDLINE
    ]
    if given:
        raise InputError(Diagnostic("Usage", f"{name} {words}", None, hint) for name in given)
