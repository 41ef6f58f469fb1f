"""Failures in a report: a section of what failed and what was done, undone operations and robots
that stood over time; nothing of it in a report of any other run. And in the table of events."""

from __future__ import annotations

import csv
import io
from collections import Counter
from pathlib import Path

import pytest

from factory.apps.exports import Subject, exporters
from factory.apps.log.failed import failures_of
from factory.apps.report import page, recording_of
from factory.apps.report.failures import failures_data, failures_section
from factory.apps.report.recording import Recording
from factory.support.tables import table_of
from tests.failing_runs import failing, paper_layout


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    path = tmp_path_factory.mktemp("failing") / "log"
    failing(path)
    return recording_of(path, paper_layout())


def test_the_section_tells_every_failure(recording: Recording) -> None:
    section, failures = failures_section(recording), recording.log.failures
    assert failures is not None and len(failures.found) >= 4
    assert section.count(" s</th><td>") == len(failures.found)
    for one in failures.found:
        assert f"<tr><th>{one.t:.2f} s</th><td>{one.what}</td><td>{one.done}</td>" in section
    lost = next(u for _, u in recording.log.undone if u.reason == "lost")
    assert ", ".join(lost.transitions) in section
    assert f"{failures.contacts} contact" in section and "1 spare used" in section


def test_the_page_can_draw_what_was_undone(recording: Recording) -> None:
    data, count = failures_data(recording), len(recording.log.fired)
    names = recording.log.header["transitions"]
    assert len(data["undone"]) == len(recording.log.undone) >= 3
    for (after, t, events), (_, undone) in zip(data["undone"], recording.log.undone, strict=True):
        assert 0 <= after <= count and t == pytest.approx(undone.t, abs=1e-4)
        assert [names[event] for event in events] == [*undone.transitions]
    assert any(robots for _, robots in data["stood"])
    text = page(recording)
    assert "Failures</h2>" in text and "spansWithUndone" in text and ".op.undone" in text


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("missed", -1, "counts must be whole numbers from 0"),
        ("stood", [[1.0, ["r9"]]], "'r9' stood"),
        ("found", [{"t": -1}], "lacks the key 'test'"),
    ],
)
def test_what_is_no_account_of_failures_is_refused(
    recording: Recording, key: str, value: object, words: str
) -> None:
    assert recording.log.failures is not None
    told = {**table_of(recording.log.failures), key: value}
    with pytest.raises(ValueError, match=words):
        failures_of(told, frozenset(recording.log.header["robots"]))


def test_csv_says_so(recording: Recording) -> None:
    text = exporters()["csv"].export(Subject(Path("log"), recording.log))
    assert isinstance(text, str)
    kinds = Counter(row["kind"] for row in csv.DictReader(io.StringIO(text)))
    assert kinds.keys() == {"start", "end", "start undone", "end undone"}
