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
from math import isfinite
from typing import Any

from factory.support.errors import SHOWN, Diagnostic, FactoryError, one_line, printed

SCHEMA = 1

POOL_BOUND = "a larger pool of parts has too many bodies for the engine; --wip overrides this"
"""The reason why the factory limits the units inside at once."""

CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")
"""Control characters of terminals and of text direction."""

STDOUT = "what is printed"
"""The name of stdout in messages."""


def emit(document: Mapping[str, Any]) -> None:
    """Print one JSON document to stdout, in ASCII whatever the locale, with null for numbers that
    are not finite."""
    document = {"schema": SCHEMA, **document}
    try:
        text = json.dumps(document, allow_nan=False)
    except ValueError:
        text = json.dumps(finite(document), allow_nan=False)
    say(text)


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
    from rich import box
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table
    from rich.text import Text

    title = escape(title)
    made = Table(title=title or None, box=box.SIMPLE_HEAD, title_justify="left", pad_edge=False)
    for column in columns:
        made.add_column(escape(column), overflow="fold")
    for row in rows:
        made.add_row(*(Text(one_line(cell)) for cell in row))
    console = Console(width=None if sys.stdout.isatty() else 160, highlight=False)
    with _named():
        with console.capture() as printed:
            console.print(made)
        print(printed.get(), end="")
