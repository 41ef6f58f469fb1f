"""The output of the command line, and its exit status.

With `--json`, stdout is one JSON document and nothing else; diagnostics and progress go to stderr.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import replace
from itertools import islice, zip_longest
from math import isfinite
from shutil import get_terminal_size
from textwrap import wrap
from typing import Any
from unicodedata import combining, east_asian_width

from factory.support.errors import SHOWN, Diagnostic, FactoryError, one_line, printed

SCHEMA = 1

POOL_BOUND = "a larger pool of parts has too many bodies for the engine; --wip overrides this"
"""The reason why the factory limits the units inside at once."""

CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")
"""Control characters of terminals and of text direction."""

WIDTH = 160
"""The width of tables that are not printed to a terminal, in columns."""

FILLER = "\0"
"""Stands for the second column of a wide character."""

BLOCK = 1000
"""So many elements of a long list are printed at a time."""

STDOUT = "what is printed"
"""The name of stdout in messages."""


def emit(document: Mapping[str, Any]) -> None:
    """Print one JSON document to stdout, in ASCII whatever the locale, with null for numbers that
    are not finite. What an iterator gives is a list, of which only `BLOCK` elements are kept at a
    time."""
    mark = "{"
    with _named():
        for key, value in {"schema": SCHEMA, **document}.items():
            print(f"{mark}{json.dumps(key)}: ", end="")
            pieces = _listed(value) if isinstance(value, Iterator) else (_text(value),)
            for piece in pieces:
                print(CONTROL.sub(" ", piece), end="")
            mark = ", "
        print("}")


def _listed(values: Iterator[Any]) -> Iterator[str]:
    """A list of values in JSON, in pieces."""
    mark = ""
    yield "["
    while block := [*islice(values, BLOCK)]:
        yield mark + _text(block)[1:-1]
        mark = ", "
    yield "]"


def _text(value: Any) -> str:
    """A value in JSON."""
    try:
        return json.dumps(value, allow_nan=False)
    except ValueError:
        return json.dumps(finite(value), allow_nan=False)


def finite(value: Any) -> Any:
    """A value for JSON, with null for what is not finite."""
    if isinstance(value, float):
        return value if isfinite(value) else None
    if isinstance(value, dict):
        return {key: finite(item) for key, item in value.items()}
    return [finite(item) for item in value] if isinstance(value, list | tuple) else value


def say(text: str = "") -> None:
    """Print lines to stdout, without control characters that come from files."""
    with _named():
        print(CONTROL.sub(" ", text))


@contextmanager
def _named() -> Iterator[None]:
    """A context in which errors of stdout name it."""
    try:
        yield
    except OSError as error:
        error.filename = STDOUT
        raise


def warn(diagnostics: Iterable[Diagnostic], quiet: bool = False) -> None:
    """Print warnings to stderr: `file:line:col: CODE warning: message`."""
    if not quiet:
        for text in printed([*map(warning, diagnostics)], "warnings"):
            print(text, file=sys.stderr)


def warning(diagnostic: Diagnostic) -> Diagnostic:
    """A diagnostic marked as a warning."""
    return replace(diagnostic, message=f"warning: {diagnostic.message}")


def fail(error: FactoryError, as_json: bool, details: Mapping[str, Any] | None = None) -> int:
    """Print an error to stderr and, with `as_json`, to stdout with `details` as further keys;
    returns the exit status. Errors of the streams are ignored."""
    with suppress(OSError):
        if as_json:
            errors = [d.as_json() for d in error.diagnostics[:SHOWN]]
            document = {"errors": errors, **(details or {})}
            more = len(error.diagnostics) - SHOWN
            emit({**document, "errors_left_out": more} if more > 0 else document)
    with suppress(OSError):
        print(error, file=sys.stderr)
    return error.exit_status


def table(title: str, columns: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> None:
    """Print a table to stdout, as wide as the terminal, or 160 columns elsewhere."""
    lines = [columns, *(tuple(map(one_line, row)) for row in rows)]
    widths = [max(1, *map(_cells, column)) for column in zip(*lines, strict=True)]
    edges = 3 * len(widths) - 1
    room = (get_terminal_size().columns if sys.stdout.isatty() else WIDTH) - edges
    while sum(widths) > max(room, len(widths)):
        widths[widths.index(max(widths))] -= 1
    blank = " " * (sum(widths) + edges)
    head, *body = (line for cells in lines for line in _row_lines(cells, widths))
    above = [title.ljust(len(blank))] if title else []
    say("\n".join([*above, blank, head, f" {'─' * (len(blank) - 2)} ", *body, blank]))


def _row_lines(cells: tuple[str, ...], widths: list[int]) -> Iterator[str]:
    """The lines of a row whose cells are wrapped at widths."""
    wrapped = [_wrapped(cell, width) for cell, width in zip(cells, widths, strict=True)]
    for parts in zip_longest(*wrapped, fillvalue=""):
        padded = (p + " " * (w - _cells(p)) for p, w in zip(parts, widths, strict=True))
        yield f" {'   '.join(padded)} "


def _wrapped(cell: str, width: int) -> list[str]:
    if _cells(cell) <= width:
        return [cell]
    spaced = "".join(c + FILLER * (_cells(c) - 1) for c in cell)
    width = max(1, width - (FILLER in spaced))  # a wide character may be cut from its filler
    return [part.replace(FILLER, "") for part in wrap(spaced, width, break_on_hyphens=False)]


def _cells(text: str) -> int:
    """How many columns of a terminal a text takes."""
    return sum(0 if combining(c) else 1 + (east_asian_width(c) in ("W", "F")) for c in text)
