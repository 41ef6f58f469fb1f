"""Checks before a command starts: of its output files, and of options that do not apply to FILE."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import click
from click.core import ParameterSource

from factory.commands.options import OF_A_PICTURE
from factory.support.claim import IN_USE, is_claimed
from factory.support.errors import Diagnostic, InputError
from factory.support.guard import declare


def writable(*outputs: Path | None) -> None:
    """Declare output files, and check that they can be written: their folders exist and are
    writable, they are no folders, all different, none is an input, and no run is writing them.
    Raises InputError (BadFile) with every fault."""
    faults: list[Diagnostic] = []
    for path in outputs:
        if path is None:
            continue
        if (trouble := _unwritable(path)) is None:
            faults += declare([path])
        else:
            faults.append(Diagnostic("BadFile", trouble[0], None, trouble[1]))
    if faults:
        raise InputError(faults)


def _unwritable(path: Path) -> tuple[str, str] | None:
    """The fault of an output file and its remedy; None if it can be written."""
    folder = path.parent
    if path.is_dir():
        return f"'{path}' is a folder", "give the name of a file"
    if not folder.exists():
        return f"the folder '{folder}' does not exist", f"mkdir -p {folder}"
    if not folder.is_dir():
        return f"'{folder}' is not a folder", "choose another place"
    if not os.access(path if path.exists() else folder, os.W_OK):
        return f"'{path}' may not be written", "choose another place, or change its permissions"
    if is_claimed(path):
        return f"'{path}' {IN_USE[0]}", IN_USE[1]
    return None


def writable_folder(path: Path | None) -> None:
    """Check that a folder can be written to, or made. Raises InputError (BadFile)."""
    if path is None:
        return
    there = next(f for f in (path, *path.absolute().parents) if f.exists())
    if not there.is_dir():
        message, hint = f"'{there}' is a file, not a folder", "-o takes the name of a folder"
        raise InputError(Diagnostic("BadFile", message, None, hint))
    if not os.access(there, os.W_OK | os.X_OK):
        message, hint = f"'{there}' may not be written", "choose another place"
        raise InputError(Diagnostic("BadFile", message, None, hint))


def for_a_pag(file: Path, kind: str, *but: str) -> None:
    """Check that no option was given that applies only to a PAG, for a FILE of another `kind`: none
    except `but` and those of OUTPUT. Raises InputError (Usage) with every one."""
    but = (*but, "file", "as_json", "quiet", "verbose")
    words, hint = f"applies to a PAG; '{file}' is {kind}", "leave it out"
    _refuse_given(lambda name: name not in but, words, hint)


def without_others(name: str, words: str) -> None:
    """Check that nothing was given beside one option (`name`), in `words`, but those of OUTPUT.
    Raises InputError (Usage) with every other."""
    but = (name, "as_json", "quiet", "verbose")
    _refuse_given(lambda each: each not in but, f"does not go with {words}", "leave it out")


def for_a_film() -> None:
    """Check that no option of PICTURE was given, where nothing is filmed. Raises InputError (Usage)
    with every one."""
    words, hint = "applies to a film, and there is none", "add --video OUT.mp4"
    _refuse_given(OF_A_PICTURE.__contains__, words, hint)


def _refuse_given(which: Callable[[str], bool], words: str, hint: str) -> None:
    context = click.get_current_context()
    names = [
        max(option.opts, key=len)
        for option in context.command.params
        if option.name is not None
        and which(option.name)
        and context.get_parameter_source(option.name) is ParameterSource.COMMANDLINE
    ]
    if names:
        raise InputError(Diagnostic("Usage", f"{name} {words}", None, hint) for name in names)
