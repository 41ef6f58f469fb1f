"""Inputs are not written over: the guard of one command, or of one public function.

Within `guarded()` each file that is read is noted (`reading`), and each file that will be written
is declared as soon as its name is known, before the work (`declare`). A file that is both is
refused, whichever comes second. Files are compared by device and number, so that a symbolic link, a
hard link or another path does not hide one.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import wraps
from pathlib import Path
from typing import Any, TypeVar, cast

from factory.support.errors import Diagnostic, InputError

__all__ = ["about_to_write", "reading"]

F = TypeVar("F", bound=Callable[..., Any])

Identity = tuple[int, int]
"""Device and number of a file."""

ANOTHER = "give another name"


class Guard:
    """The files that are read, by their identities; those that will be written, by their identities
    and their resolved paths, with whether the program chose their names."""

    def __init__(self) -> None:
        self.inputs: dict[Identity, Path] = {}
        self.outputs: dict[Identity | str, tuple[Path, bool]] = {}

    def is_input(self, path: Path) -> bool:
        """Whether a file was read, and is still there: numbers of removed files are used again."""
        identity = _identity(path)
        source = self.inputs.get(identity) if identity else None
        return source is not None and _identity(source) == identity


_guard: ContextVar[Guard | None] = ContextVar("guard", default=None)


@contextmanager
def guarded() -> Iterator[None]:
    """A context in which inputs are not written over, unless it is within such a one already."""
    token = _guard.set(_guard.get() or Guard())
    try:
        yield
    finally:
        _guard.reset(token)


def guarding(function: F) -> F:
    """A function whose calls are guarded."""

    @wraps(function)
    def call(*values: Any, **options: Any) -> Any:
        with guarded():
            return function(*values, **options)

    return cast("F", call)


def reading(*paths: Path) -> None:
    """Note files that are read, or will be. Raises InputError (BadFile) for one that will be
    written."""
    if (guard := _guard.get()) is None:
        return
    for path in paths:
        if (identity := _identity(path)) is not None:
            guard.inputs.setdefault(identity, Path(os.path.abspath(path)))
            if identity in guard.outputs:
                raise InputError(_fault(guard.outputs[identity][0]))


def declare(paths: Iterable[Path], chosen: bool = False) -> list[Diagnostic]:
    """Declare files that will be written; gives the faults of those that are inputs, and of those
    that are declared twice. `chosen`: the program chose their names; it may do so again."""
    guard, faults = _guard.get() or Guard(), list[Diagnostic]()
    for path in paths:
        identity = _identity(path)
        if identity is None and path.exists():  # a pipe or a device
            continue
        keys: list[Identity | str] = [os.path.realpath(path)]
        keys += [identity] if identity else []
        before = [guard.outputs[key][1] for key in keys if key in guard.outputs]
        if guard.is_input(path):
            faults.append(_fault(path))
        elif not all(chosen and was_chosen for was_chosen in before):
            faults.append(Diagnostic("BadFile", f"'{path}' is given twice", None, ANOTHER))
        else:
            guard.outputs.update((key, (path, chosen)) for key in keys)
    return faults


def will_write(*paths: Path | None) -> None:
    """Declare files whose names the user gave, where they are given. Raises InputError (BadFile)
    for those that are inputs, and for those that are declared twice."""
    if faults := declare(path for path in paths if path is not None):
        raise InputError(faults)


def about_to_write(path: Path) -> None:
    """Check a file that is about to be written; from then on it may be read. Raises InputError
    (BadFile) where it is an input."""
    if (guard := _guard.get()) is None:
        return
    if guard.is_input(path):
        raise InputError(_fault(path))
    if (identity := _identity(path)) is not None:
        guard.outputs.pop(identity, None)


def _fault(path: Path) -> Diagnostic:
    return Diagnostic("BadFile", f"'{path}' is read and would be written over", None, ANOTHER)


def _identity(path: Path) -> Identity | None:
    """The identity of a regular file; None for anything else."""
    try:
        status = os.stat(path)
    except (OSError, ValueError):
        return None
    return (status.st_dev, status.st_ino) if stat.S_ISREG(status.st_mode) else None
