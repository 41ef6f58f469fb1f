"""CSV (RFC 4180, with a header line) of a log's events: time, transition, operation, unit,
robots, source line.

A spreadsheet evaluates a text that begins like a formula; such a text gets an apostrophe before it.
Control codes become spaces."""

from __future__ import annotations

import csv
import io
from dataclasses import astuple

from factory.exporting.events import COLUMNS, rows
from factory.exporting.subject import Subject
from factory.support.errors import one_line

FORMAT, TAKES = "csv", "log"

FORMULA = ("=", "+", "-", "@")
"""First characters of a formula."""


def export(subject: Subject) -> str:
    """The table as text; robots are separated by spaces."""
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for row in rows(subject.log):
        writer.writerow([_cell(value) for value in astuple(row)])
    return text.getvalue()


def _cell(value: object) -> object:
    """A value as it stands in a cell."""
    if not isinstance(value, str | tuple):
        return value
    text = one_line(value if isinstance(value, str) else " ".join(value))
    return f"'{text}" if text.lstrip().startswith(FORMULA) else text
