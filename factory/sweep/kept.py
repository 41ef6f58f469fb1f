"""What the database of a sweep holds, and whether one does: it may be damaged, or of another
version."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Mapping, Sequence
from typing import Any

from factory.settings import AUTO
from factory.sweep.grid import KEYS, WHOLE
from factory.sweep.work import FIGURES

COLUMNS: Mapping[str, str] = {
    "point": "TEXT PRIMARY KEY",
    "status": "TEXT NOT NULL",
    "reason": "TEXT",
    **{key: "INTEGER" if key in WHOLE else "REAL" for key in KEYS},
    "world": "TEXT",
    **FIGURES,
    "row_time_s": "REAL",
    "worker": "TEXT",
    "tries": "INTEGER",
    "finished": "TEXT",
}
"""Of the table `runs`. `point`: the values of the keys that vary, as JSON; `status`: done or
failed; then every key and figure; `row_time_s`: what the run took its worker in all [s]."""


def kept_identity(connection: sqlite3.Connection) -> dict[str, Any]:
    """The identity in a database, all of whose rows are such as a sweep writes. Raises
    sqlite3.Error, which says what is not."""
    kept = connection.execute("SELECT key, value FROM sweep")
    identity = {key: _value(key, text) for key, text in kept}
    varied = identity.get("varied")
    if not isinstance(varied, list) or not all(key in KEYS for key in varied):
        raise sqlite3.DatabaseError("it does not say what varies")
    if not isinstance(identity.get("product"), str):
        raise sqlite3.DatabaseError("it does not say what it is of")
    _check_rows(connection, varied)
    return identity


def _value(key: str, text: Any) -> Any:
    """A value of an identity, from its JSON."""
    try:
        return json.loads(text)
    except (TypeError, ValueError, RecursionError) as error:
        raise sqlite3.DatabaseError(f"its '{key}' cannot be read") from error


def _check_rows(connection: sqlite3.Connection, varied: Sequence[str]) -> None:
    """A row has a point, a status and a value for all that varies, all of the types of their
    columns: SQLite itself takes any. Raises sqlite3.Error."""
    faults = [f"{name} IS NULL" for name in ("point", "status", *varied)]
    faults.append("status NOT IN ('done', 'failed')")
    for name, kind in COLUMNS.items():
        types = "'text'" if kind.startswith("TEXT") else "'integer', 'real'"
        faults.append(f"typeof({name}) NOT IN ('null', {types}) AND {name} IS NOT '{AUTO}'")
    bad = connection.execute(f"SELECT rowid FROM runs WHERE {' OR '.join(faults)} LIMIT 1")
    for (number,) in bad:
        raise sqlite3.DatabaseError(f"row {number} of its runs is none that a sweep writes")
