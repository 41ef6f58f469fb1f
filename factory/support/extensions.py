"""Extensions: operations, control laws, robot types and exporters of other packages, found by their
entry points, or in folders of the user. Mistakes in them are told at the line of the user's file.

An entry point of the group `factory.templates`, `factory.robots`, `factory.laws`,
`factory.exporters` or `factory.explanations` names a package with `*.op` files, a package with a
`catalogue.toml`, a function, a module, or a folder with texts.
"""

from __future__ import annotations

import linecache
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from traceback import extract_tb
from types import MappingProxyType, ModuleType
from typing import Any

from factory.support.errors import Diagnostic, FactoryError, InputError, Position

__all__ = ["bad_extension", "blaming", "extensions", "position_of"]

HINT = "mend that line; docs: Extensions"


@cache
def extensions(kind: str) -> Mapping[str, Any]:
    """What entry points of the group `factory.KIND` load, by their names, sorted. Raises InputError
    (BadExtension) where one cannot be loaded, or two have one name."""
    from importlib.metadata import entry_points

    loaded: dict[str, Any] = {}
    for entry in sorted(entry_points(group=f"factory.{kind}"), key=lambda e: (e.name, e.value)):
        what = f"the entry point '{entry.name}' of factory.{kind}, {entry.value}"
        if entry.name in loaded:
            raise bad_extension(f"{what}: another package has one of this name", None)
        with blaming(what):
            loaded[entry.name] = entry.load()
    return MappingProxyType(loaded)


def extension_folders(kind: str) -> list[Path]:
    """The folders of the packages that entry points of a group name. Raises InputError."""
    folders = list[Path]()
    for name, package in extensions(kind).items():
        if not isinstance(package, ModuleType) or not hasattr(package, "__path__"):
            raise bad_extension(f"'{name}' of factory.{kind} is no package", position_of(package))
        folders += map(Path, package.__path__)
    return folders


def extension_files() -> Iterator[Path]:
    """The files of all packages with entry points, and the folders in them; nothing is loaded."""
    from importlib.metadata import entry_points
    from importlib.util import find_spec

    points = entry_points()
    groups = sorted(group for group in points.groups if group.startswith("factory."))
    for name in sorted(
        {p.module.partition(".")[0] for g in groups for p in points.select(group=g)}
    ):
        spec = find_spec(name)
        if spec is None:
            continue
        folders = map(Path, spec.submodule_search_locations or ())
        inside = (path for folder in folders for path in (folder, *sorted(folder.rglob("*"))))
        yield from (path for path in inside if "__pycache__" not in path.parts)
        if spec.submodule_search_locations is None and spec.origin:
            yield Path(spec.origin)


@contextmanager
def blaming(what: str, path: Path | None = None) -> Iterator[None]:
    """A context in which code of the user runs: what it raises becomes an InputError
    (BadExtension), at the innermost line of the file `path` that was running, else at the innermost
    line outside Python's import system. Errors of this package pass."""
    try:
        yield
    except FactoryError:
        raise
    except (Exception, SystemExit) as error:
        message = f"{what}: {type(error).__name__}: {error}"
        raise bad_extension(message, _raised_at(error, path)) from error


def bad_extension(message: str, position: Position | None) -> InputError:
    """An error in an extension (code BadExtension)."""
    return InputError(Diagnostic("BadExtension", message, position, HINT))


def position_of(thing: Any, name: str = "") -> Position | None:
    """The line where a function begins, or where a module assigns or defines a `name`, else its
    first line; None for what has no file."""
    if code := getattr(thing, "__code__", None):
        return _position(code.co_filename, code.co_firstlineno)
    file = getattr(thing, "__file__", None)
    if file is None:
        return None
    pattern = re.compile(rf"(def |\w+ *, *)*{name}\b *[=,(:]")
    lines = enumerate(linecache.getlines(file), 1)
    named = (number for number, line in lines if pattern.match(line))
    return _position(file, next(named, 1))


def _raised_at(error: BaseException, path: Path | None) -> Position | None:
    if isinstance(error, SyntaxError) and error.filename and error.lineno:
        return _position(error.filename, error.lineno, error.offset or 1)
    frames = [f for f in extract_tb(error.__traceback__) if not f.filename.startswith("<")]
    inside = [f for f in frames[1:] if path is None or Path(f.filename) == path]
    if not inside:
        return None if path is None else _position(str(path), 1)
    return _position(inside[-1].filename, inside[-1].lineno or 1, (inside[-1].colno or 0) + 1)


def _position(file: str, line: int, column: int = 1) -> Position:
    return Position(file, line, column, linecache.getline(file, line).rstrip("\n"))
