"""Checks of the files and folders that a command is to write, before anything else is done."""

from __future__ import annotations

import os
from pathlib import Path

from factory.support.claim import IN_USE, is_claimed
from factory.support.errors import Diagnostic, InputError


def writable(file: Path | None, *outputs: Path | None) -> None:
    """Output files must be such that they can be written: their folder there and writable,
    themselves no folder, all different, none the input, and none being written by a run. Raises
    InputError (BadFile) with every fault."""
    taken = {} if file is None else {os.path.realpath(file): "the input"}
    faults = []
    for path in outputs:
        if path is None:
            continue
        trouble = _unwritable(path)
        place = os.path.realpath(path)
        if trouble is None and place in taken:
            trouble = f"'{path}' is {taken[place]}", "give another name"
        if trouble is not None:
            faults.append(Diagnostic("BadFile", trouble[0], None, trouble[1]))
        elif path.exists() and not path.is_file():
            continue
        taken[place] = "given twice"
    if faults:
        raise InputError(faults)


def _unwritable(path: Path) -> tuple[str, str] | None:
    """What is wrong with an output file, and what would mend it."""
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
    """A folder to be written into, or made. Raises InputError (BadFile)."""
    if path is None:
        return
    there = next(f for f in (path, *path.absolute().parents) if f.exists())
    if not there.is_dir():
        message, hint = f"'{there}' is a file, not a folder", "-o takes the name of a folder"
        raise InputError(Diagnostic("BadFile", message, None, hint))
    if not os.access(there, os.W_OK | os.X_OK):
        message, hint = f"'{there}' may not be written", "choose another place"
        raise InputError(Diagnostic("BadFile", message, None, hint))
