"""What is a table is one for pandas, too: the same rows, figures by their names in `--json`."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

import factory
from factory.apps.drawing.tables import Tabular
from tests.paths import PAPER


def swept(folder: Path) -> Tabular:
    values = {"seed": [0, 1], "speed": [0.2, 0.3]}
    return factory.sweep(PAPER, folder / "a.db", values, world="ideal", units=4, jobs=1)


TABLES: dict[str, tuple[Callable[[Path], Tabular], int, set[str]]] = {
    "sweep": (swept, 2, {"speed", "done", "failed", "cycle_time_s", "cycle_time_s_deviation"}),
    "analyze": (lambda _: factory.analyze(PAPER), 6, {"robot", "busy", "gain_second_robot_s"}),
    "pareto": (
        lambda _: factory.pareto(PAPER, layouts=False),
        3,
        {"robots", "tools", "estimated_cycle_time_s"},
    ),
    "fidelity": (
        lambda _: factory.fidelity(PAPER, seeds=2, units=1, jobs=1),
        2,
        {"seed", "passed", "tracking_error_max_mm"},
    ),
}
"""For each command its value, the number of rows at least, and some of the columns."""


@pytest.fixture(scope="module", params=TABLES)
def case(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Tabular, int, set[str]]:
    make, rows, columns = TABLES[request.param]
    return make(tmp_path_factory.mktemp("frames")), rows, columns


def test_records_are_plain_rows(case: tuple[Tabular, int, set[str]]) -> None:
    value, rows, columns = case
    records = value.records()
    assert len(records) >= rows
    for record in records:
        assert columns <= record.keys() == records[0].keys()
        assert all(v is None or isinstance(v, str | int | float) for v in record.values())


def test_a_frame_has_the_records(case: tuple[Tabular, int, set[str]]) -> None:
    pandas = pytest.importorskip("pandas", reason="the extra `pandas` is not installed")
    value, *_ = case
    frame, records = value.to_frame(), value.records()
    assert isinstance(frame, pandas.DataFrame)
    assert [*frame.columns] == [*records[0]]
    for row, record in zip(frame.to_dict("records"), records, strict=True):
        for name, figure in record.items():
            same = row[name] == figure
            assert same or (figure is None and (row[name] is None or math.isnan(row[name])))


def test_pandas_gets_the_records(
    case: tuple[Tabular, int, set[str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where pandas is not installed, a stand-in takes them."""
    value, *_ = case
    pandas: Any = ModuleType("pandas")
    pandas.DataFrame = type("DataFrame", (), {"from_records": staticmethod(lambda rows: rows)})
    monkeypatch.setitem(sys.modules, "pandas", pandas)
    assert value.to_frame() == value.records()


def test_without_pandas_the_extra_is_named(
    case: tuple[Tabular, int, set[str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    value, *_ = case
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(factory.MissingError) as caught:
        value.to_frame()
    (diagnostic,) = caught.value.diagnostics
    assert caught.value.exit_status == 3 and diagnostic.code == "Missing"
    assert diagnostic.message.startswith("a data frame needs pandas")
    assert diagnostic.hint == "pip install 'klavins-factory[pandas]'"
