"""What the command line prints, and the status it ends with.

With `--json`, stdout is one JSON document and nothing else; diagnostics and progress go to stderr.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable, Mapping
from typing import Any

from factory.errors import Diagnostic, FactoryError

SCHEMA = 1


def emit(document: Mapping[str, Any]) -> None:
    """One JSON document on stdout."""
    print(json.dumps({"schema": SCHEMA, **document}, ensure_ascii=False, allow_nan=False))


def say(text: str = "") -> None:
    """A line for people on stdout."""
    print(text)


def warn(diagnostics: Iterable[Diagnostic], quiet: bool = False) -> None:
    """Warnings, on stderr."""
    if quiet:
        return
    for diagnostic in diagnostics:
        print(f"warning: {diagnostic}", file=sys.stderr)


def fail(error: FactoryError, as_json: bool) -> int:
    """Report an error where the user looks for it; its exit status."""
    if as_json:
        emit({"errors": [d.as_json() for d in error.diagnostics]})
    for diagnostic in error.diagnostics:
        print(diagnostic, file=sys.stderr)
    return error.exit_status


def table(title: str, columns: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> None:
    """A table for people on stdout, as wide as it needs to be."""
    from rich import box
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    made = Table(title=title or None, box=box.SIMPLE_HEAD, title_justify="left", pad_edge=False)
    for column in columns:
        made.add_column(column, overflow="fold")
    for row in rows:
        made.add_row(*(Text(cell) for cell in row))
    width = None if sys.stdout.isatty() else 160
    Console(width=width, highlight=False).print(made)
