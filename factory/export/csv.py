"""CSV (RFC 4180, with a line of names) of a log's events: time, transition, operation, unit,
robots, source line."""

from __future__ import annotations

import csv
import io
from dataclasses import astuple

from factory.export.events import COLUMNS, rows
from factory.export.subject import Subject

FORMAT, TAKES = "csv", "log"


def export(subject: Subject) -> str:
    """The table as text; robots are separated by spaces."""
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for row in rows(subject.log):
        writer.writerow([" ".join(v) if isinstance(v, tuple) else v for v in astuple(row)])
    return text.getvalue()
