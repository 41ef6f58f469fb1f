"""Failures in a report: a section of what failed and what was done, undone operations and robots
that stood over time; nothing of it in a report of any other run. And in the table of events."""

from __future__ import annotations

import csv
import io
from collections import Counter
from pathlib import Path

import pytest

from factory.apps.exports import Subject, exporters
from factory.apps.exports.csv import rows
from factory.apps.log import LogWriter
from factory.apps.log.failed import failures_of
from factory.apps.recovery import Campaign, recover
from factory.apps.report import page, recording_of
from factory.apps.report.failures import failures_data, failures_section
from factory.apps.report.pace import measured
from factory.apps.report.recording import Recording
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.support.tables import table_of
from tests.apps.log.test_log import block_ends
from tests.command_line import Terminal
from tests.failing_runs import FAULTS, failing, paper_layout
from tests.paths import PAPER


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


def test_what_was_undone_does_not_count_as_work(recording: Recording) -> None:
    """The third part2 takes no longer because the second was dropped."""
    durations = measured(recording).durations
    assert all(seconds is not None and 0 < seconds < 3 for seconds in durations)


def test_other_runs_have_none_of_it(tmp_path: Path) -> None:
    texts = []
    for name, recovers in (("plain", False), ("none", True)):
        made = Simulation(paper_layout(), RunRequest(units=1))
        if recovers:
            recover(made, Campaign())
        with LogWriter(tmp_path / name, made, command=()) as writer:
            made.run([writer.observe])
        texts.append(page(recording_of(tmp_path / name)))
    plain, none = texts
    for word in ("Failures", "undone", "stood", "plainDraw"):
        assert word not in plain.partition('id="certificate"')[0].partition("<body>")[2]
    assert "spansWithUndone" not in plain and "spansWithUndone" in none
    assert "Faults: none" in none


def test_from_the_command_line(run: Terminal, tmp_path: Path) -> None:
    faults, log, out = tmp_path / "faults.toml", tmp_path / "run.log", tmp_path / "report.html"
    faults.write_text(FAULTS)
    words = "--units", 3, "--faults", faults, "--spares", 1, "--swap", 3, "--log", log
    found = run("run", PAPER, *words, "--json")
    assert found.status == 0 and len(found.json["failures"]["failures"]) >= 3
    assert run("report", log, "-o", out).status == 0
    assert "r6 lost part2" in out.read_text()
    data, failures = log.read_bytes(), found.json["failures"]
    assert run("monitor", log, "--json").json["failures"] == failures
    log.write_bytes(data[: block_ends(data)[-2]])  # killed before its end
    assert run("monitor", log, "--json").json["failures"]["failures"] == failures["failures"]
    assert f"{failures['found']} failures" in run("monitor", log).out
    assert run("report", log, "-o", out).status == 1
    assert "r6 lost part2" in out.read_text()


def test_what_a_log_keeps_is_read_as_it_was_written(recording: Recording) -> None:
    failures, robots = recording.log.failures, frozenset(recording.log.header["robots"])
    assert failures is not None
    assert failures_of(table_of(failures), robots) == failures


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("missed", -1, "counts must be whole numbers from 0"),
        ("struck", {"drop": "often"}, "'failures.struck.drop' must be a whole number"),
        ("stood", [[1.0, ["r9"]]], "'r9' stood"),
        ("stood", [[1.0]], "must be a list of 2"),
        ("found", [{"t": -1}], "lacks the key 'test'"),
        ("found", "none", "'failures.found' must be a list"),
    ],
)
def test_what_is_no_account_of_failures_is_refused(
    recording: Recording, key: str, value: object, words: str
) -> None:
    assert recording.log.failures is not None
    told = {**table_of(recording.log.failures), key: value}
    with pytest.raises(ValueError, match=words):
        failures_of(told, frozenset(recording.log.header["robots"]))


# --- the table of events ------------------------------------------------------------------------


def test_what_is_undone_is_a_row_of_its_own(recording: Recording) -> None:
    """Rows less those that are undone are what lasts; a unit is counted again after that."""
    count, undone = Counter[str](), 0
    for row in rows(recording.log):
        if row.kind.endswith(" undone"):
            assert row.unit == count[row.transition]
            count[row.transition] -= 1
            undone += 1
        else:
            count[row.transition] += 1
            assert row.unit == count[row.transition]
    assert undone == sum(len(entry.transitions) for _, entry in recording.log.undone) > 0
    assert +count == Counter(name for _, name in recording.log.lasting)
    times = [row.time_s for row in rows(recording.log)]
    assert times == sorted(times)


def test_csv_says_so(recording: Recording) -> None:
    text = exporters()["csv"].export(Subject(Path("log"), recording.log))
    assert isinstance(text, str)
    kinds = Counter(row["kind"] for row in csv.DictReader(io.StringIO(text)))
    assert kinds.keys() == {"start", "end", "start undone", "end undone"}
