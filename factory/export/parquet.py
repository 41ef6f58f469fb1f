"""Parquet of a log's events: the columns of the CSV with their types, the robots as a list."""

from __future__ import annotations

import io
from dataclasses import asdict

from factory.export.events import COLUMNS, rows
from factory.export.subject import Subject
from factory.support.extras import optional

FORMAT, TAKES, BINARY = "parquet", "log", True


def export(subject: Subject) -> bytes:
    """The table. Raises MissingError where there is no pyarrow."""
    pyarrow = optional("pyarrow", "pyarrow", "Parquet", "export")
    parquet = optional("pyarrow.parquet", "pyarrow", "Parquet", "export")
    types = {
        "time_s": pyarrow.float64(),
        "unit": pyarrow.int32(),
        "robots": pyarrow.list_(pyarrow.string()),
        "line": pyarrow.int32(),
        "column": pyarrow.int32(),
    }
    schema = pyarrow.schema([(name, types.get(name, pyarrow.string())) for name in COLUMNS])
    found = [asdict(row) for row in rows(subject.log)]
    content = io.BytesIO()
    parquet.write_table(pyarrow.Table.from_pylist(found, schema), content)
    return content.getvalue()
