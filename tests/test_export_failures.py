"""Exports of runs and factories with failures: what is undone is said, and nothing else changes."""

from __future__ import annotations

import csv
import io
from collections import Counter
from pathlib import Path

import pytest

from factory.exporting import Subject, exporters
from factory.exporting.csv import rows
from factory.record.log import Log
from tests.failing_runs import failing


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Log:
    return failing(tmp_path_factory.mktemp("failing") / "log")


# --- events ---------------------------------------------------------------------------------------


def test_what_is_undone_is_a_row_of_its_own(log: Log) -> None:
    """Rows less those that are undone are what lasts; a unit is counted again after that."""
    count, undone = Counter[str](), 0
    for row in rows(log):
        if row.kind.endswith(" undone"):
            assert row.unit == count[row.transition]
            count[row.transition] -= 1
            undone += 1
        else:
            count[row.transition] += 1
            assert row.unit == count[row.transition]
    assert undone == sum(len(entry.transitions) for _, entry in log.undone) > 0
    assert +count == Counter(name for _, name in log.lasting)
    times = [row.time_s for row in rows(log)]
    assert times == sorted(times)


def test_csv_says_so(log: Log) -> None:
    text = exporters()["csv"].export(Subject(Path("log"), log))
    assert isinstance(text, str)
    kinds = Counter(row["kind"] for row in csv.DictReader(io.StringIO(text)))
    assert kinds.keys() == {"start", "end", "start undone", "end undone"}
