"""The database of a sweep: SQLite in WAL mode, with a row for each finished run.

Only the parent process writes it, one commit for each row: killing it, or a worker, loses no
finished row. It may be read while it is written.
"""

from __future__ import annotations

import json
import os
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

from factory.api import Diagnostic, InputError
from factory.apps.sweep.grid import FAULT_RATE, KEYS, WHOLE, Value
from factory.apps.sweep.recipe import name_of
from factory.apps.sweep.work import FAILING_FIGURES, FIGURES, Outcome
from factory.support.guard import about_to_write
from factory.support.resource import Closing

COLUMNS: Mapping[str, str] = {
    "point": "TEXT PRIMARY KEY",
    "status": "TEXT NOT NULL",
    "reason": "TEXT",
    **{key: "INTEGER" if key in WHOLE else "REAL" for key in KEYS if key != FAULT_RATE},
    "world": "TEXT",
    **FIGURES,
    "row_time_s": "REAL",
    "worker": "TEXT",
    "tries": "INTEGER",
    "finished": "TEXT",
}
"""Columns of the table `runs`. `point`: the values of the keys that vary, as JSON; `status`: done
or failed; then every key and figure; `row_time_s`: total time of the worker for the run [s]."""

FAILING_COLUMNS: Mapping[str, str] = {FAULT_RATE: "REAL", **FAILING_FIGURES}
"""Further columns of a sweep in which the rate of faults varies."""

APPLICATION = 0x4B4C4156
"""SQLite's application_id of such a database."""

PATIENCE = 30.0
"""Time to wait for another writer [s]."""

REPAIR = (
    "check the path, its permissions and the space on the disk; "
    "if the database is damaged, delete it and run the sweep again"
)
"""Hint for a file that SQLite cannot use."""


def columns_of(varied: Sequence[str]) -> Mapping[str, str]:
    """Columns of a sweep over these keys, with their types."""
    return {**COLUMNS, **(FAILING_COLUMNS if FAULT_RATE in varied else {})}


class Store(Closing):
    """Open database of a sweep, created if need be.

    `identity` is what `Recipe.identity` gives. Raises InputError (BadFile) where the file is
    something else, holds another sweep, is damaged, or cannot be read or written.
    """

    def __init__(self, path: Path, identity: Mapping[str, Any]) -> None:
        self.path = path
        with _sqlite_errors(path):
            self.connection = _connect(path)
            try:
                self._begin(identity)
                mode = self.connection.execute("PRAGMA journal_mode=WAL").fetchone()[0]
                if mode != "wal":
                    raise InputError(_bad(path, f"there is no WAL on this drive ({mode})", REPAIR))
                self.connection.execute("PRAGMA synchronous=NORMAL")
            except BaseException:
                self.connection.close()
                raise

    def close(self) -> None:
        """Close the database, which leaves one file."""
        with _sqlite_errors(self.path):
            self.connection.close()

    def points(self, status: str) -> set[str]:
        """Names of the points with a row of this status, done or failed."""
        with _sqlite_errors(self.path):
            rows = self.connection.execute("SELECT point FROM runs WHERE status = ?", (status,))
            return {row[0] for row in rows}

    def add(self, outcome: Outcome, values: Mapping[str, Value]) -> None:
        """Write a row, with the `values` of every key, and commit it; it replaces a row of its
        point."""
        row = {
            "point": name_of(outcome.point),
            "status": "failed" if outcome.reason else "done",
            "reason": outcome.reason or None,
            **values,
            **outcome.figures,
            "row_time_s": outcome.row_time_s,
            "worker": outcome.worker,
            "tries": outcome.tries,
            "finished": outcome.finished,
        }
        names = list(row)
        marks = ",".join(f":{name}" for name in names)
        with _sqlite_errors(self.path):
            self.connection.execute(
                f"INSERT OR REPLACE INTO runs ({','.join(names)}) VALUES ({marks})", row
            )

    def _begin(self, identity: Mapping[str, Any]) -> None:
        """Compare the identity in the database, or create the tables, in one transaction: another
        sweep may begin at the same time. Its lock is exclusive: where another only reserves the
        database, SQLite refuses the change to WAL at once instead of waiting."""
        self.connection.execute("BEGIN EXCLUSIVE")
        kept = _identity(self.connection, self.path)
        if kept is None:
            self._create(identity)
        else:
            _compare(self.path, kept, identity)
        self.connection.execute("COMMIT")

    def _create(self, identity: Mapping[str, Any]) -> None:
        columns = ", ".join(
            f"{name} {kind}" for name, kind in columns_of(identity["varied"]).items()
        )
        rows = [(key, json.dumps(value)) for key, value in identity.items()]
        for statement in (
            f"PRAGMA application_id={APPLICATION}",
            "CREATE TABLE sweep (key TEXT PRIMARY KEY, value TEXT NOT NULL)",
            f"CREATE TABLE runs ({columns})",
        ):
            self.connection.execute(statement)
        self.connection.executemany("INSERT INTO sweep VALUES (?, ?)", rows)


@contextmanager
def reading(path: Path) -> Iterator[tuple[dict[str, Any], Iterator[Mapping[str, Any]]]]:
    """The identity and the rows of a database, while a sweep writes it or afterwards. Raises
    InputError (BadFile)."""
    if not path.is_file():
        raise InputError(_bad(path, "there is no such file", "give the -o of a sweep"))
    # a reader without write access leaves the WAL
    mode = "rw" if os.access(path, os.W_OK) else "ro"
    with _sqlite_errors(path), closing(_connect(path, mode)) as connection:
        identity = _identity(connection, path)
        if identity is None:
            raise InputError(_bad(path, "no sweep has written it", "give the -o of a sweep"))
        connection.row_factory = sqlite3.Row
        names = ",".join(columns_of(identity["varied"]))
        yield identity, connection.execute(f"SELECT {names} FROM runs ORDER BY rowid")


def _connect(path: Path, mode: str = "rwc") -> sqlite3.Connection:
    if mode == "rwc":
        about_to_write(path)
    uri = f"{path.absolute().as_uri()}?mode={mode}"
    return sqlite3.connect(uri, timeout=PATIENCE, isolation_level=None, uri=True)


def _identity(connection: sqlite3.Connection, path: Path) -> dict[str, Any] | None:
    """The identity kept in a database, None for an empty one. Raises InputError (BadFile) for one
    of another program."""
    tables = connection.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]
    # both come in one transaction: the id, read last, is there where the tables are
    if connection.execute("PRAGMA application_id").fetchone()[0] != APPLICATION:
        if tables:
            message = "it is the database of another program"
            raise InputError(_bad(path, message, "choose another -o"))
        return None
    rows = connection.execute("SELECT key, value FROM sweep")
    return {key: json.loads(text) for key, text in rows}


def _compare(path: Path, kept: Mapping[str, Any], asked: Mapping[str, Any]) -> None:
    """Raises InputError (BadFile) with what differs between two sweeps."""
    if kept == asked:
        return
    words = [
        f"{key} {_shown(kept[key])} there, {_shown(value)} here"
        for key, value in asked.items()
        if key != "digest" and not isinstance(value, dict) and kept.get(key, value) != value
    ]
    message = "; ".join(words) or "another product, plan, mesh, template or robot type"
    hint = "choose another -o, or ask for the same sweep"
    raise InputError(_bad(path, f"it holds another sweep: {message}", hint))


def _shown(value: Any) -> str:
    if isinstance(value, list):
        return ", ".join(map(str, value))
    return "-" if value is None else str(value)


def _bad(path: Path, message: str, hint: str) -> Diagnostic:
    return Diagnostic("BadFile", f"{path}: {message}", None, hint)


@contextmanager
def _sqlite_errors(path: Path) -> Iterator[None]:
    """Raises InputError (BadFile) for an error of SQLite, and for content that no sweep wrote."""
    try:
        yield
    except (sqlite3.Error, LookupError, TypeError, ValueError, RecursionError) as error:
        raise InputError(_bad(path, f"it cannot be used: {error}", REPAIR)) from error
