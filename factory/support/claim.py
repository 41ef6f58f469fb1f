"""Files that one process at a time writes during a run."""

from __future__ import annotations

from io import FileIO
from pathlib import Path

from factory.support.errors import Diagnostic, InputError
from factory.support.guard import about_to_write

__all__ = ["claimed", "claimed_again", "is_claimed"]

IN_USE = "is being written by another run", "give another name, or wait until that run ends"
"""The fault of a claimed file, and its remedy."""


def claimed(path: Path) -> FileIO:
    """An empty file to append to, which no other process can claim while it is open.

    The claim is a lock of the operating system, which ends with the process, however that ends. A
    pipe or a device is not claimed. Raises InputError (BadFile) where another process holds it,
    which leaves that one's file as it is, and where it is an input; OSError where it cannot be
    opened.
    """
    about_to_write(path)
    file = _claimed(path, "a")
    if path.is_file():
        file.truncate(0)
    return file


def _claimed(path: Path, mode: str) -> FileIO:
    file = FileIO(path, mode)
    if path.is_file() and not _lock(file):
        file.close()
        words, hint = IN_USE
        raise InputError(Diagnostic("BadFile", f"'{path}' {words}", None, hint))
    return file


def _lock(file: FileIO) -> bool:
    """Whether an open file could be locked."""
    try:
        from fcntl import LOCK_EX, LOCK_NB, flock

        flock(file, LOCK_EX | LOCK_NB)
    except BlockingIOError:
        return False
    except (ImportError, OSError):  # a system, or a file system, that has no such locks
        return True
    return True


def is_claimed(path: Path) -> bool:
    """Whether a process, this one included, holds a file at the moment."""
    try:
        if not path.is_file():
            return False
        with FileIO(path) as file:
            return not _lock(file)
    except OSError:
        return False


def claimed_again(path: Path) -> FileIO:
    """An existing file opened for writing at its beginning, with its content kept. It is
    claimed as by `claimed`, which raises the same."""
    return _claimed(path, "r+")
