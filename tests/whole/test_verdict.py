"""Whether a run succeeded: faults planted in the bodies are each found by name and make `run` fail,
beside the run and from its log; honest runs succeed."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import factory
from factory.apps.log import read_log
from factory.apps.log.checks import check_figures
from factory.apps.log.writer import LogWriter
from factory.apps.monitor.record import verdict_on, watch_log
from factory.apps.runs.watched import watched
from factory.engine.mjcf import loading, names
from factory.engine.mjcf.model import Model
from factory.engine.record.findings import Report, Violation
from factory.engine.record.verdict import LIMITS, RunVerdict
from factory.engine.simulation.mujoco import world as mujoco_world
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.layout import Layout
from factory.support.errors import Diagnostic
from tests.command_line import Terminal
from tests.examples import with_hands
from tests.paths import PAPER, ROOT
from tests.planted import before_the_switch, into, moved, warns
from tests.slow import slow_but

EXAMPLES = sorted(path.stem for path in (ROOT / "examples").glob("*.pag"))


@pytest.fixture(scope="module")
def paper() -> Layout:
    return factory.lay_out(factory.compile(factory.load_pag(PAPER)))


def codes(verdict: RunVerdict) -> set[str]:
    return {failure.code for failure in verdict.failures}


def failed(run: Terminal, *more: object) -> set[str]:
    """The codes of a run of the paper's example that fails."""
    done = run("run", PAPER, "--json", *more)
    assert done.status == 1
    verdict = done.json["verdict"]
    assert not verdict["succeeded"] and not verdict["lenient"]
    return {failure["code"] for failure in verdict["failures"]}


@pytest.mark.parametrize("name", slow_but(["paper"], EXAMPLES))
@pytest.mark.parametrize(
    ("seed", "fuse"), slow_but([(1, True)], [(0, False), (1, False), (1, True)])
)
def test_an_honest_run_of_an_example_succeeds(name: str, seed: int, fuse: bool) -> None:
    layout = with_hands(name)
    asked = RunRequest(units=2, seed=seed, jitter=0.3, fuse=fuse, shown=False)
    run = watched(Simulation(layout, asked))
    assert run.succeeded, run.verdict.failures
    assert run.monitor is not None
    assert len(run.monitor.seen) + len(run.monitor.inferred) == len(run.events)


@pytest.mark.parametrize(("robot", "by"), [("r3", 0.0015)])
def test_a_carriage_that_jumps_before_its_weld_switches(
    run: Terminal, tmp_path: Path, robot: str, by: float
) -> None:
    log = tmp_path / "log"
    with before_the_switch("sub1", moved(names.slide(robot), -by)):
        found = failed(run, "--log", log)
    takes = robot == "r3"  # the other one has let go of its part
    assert found >= ({"Early", "Missed"} if takes else {"Early"})
    assert ("HandOffGap" in found) == (takes and by > 0.001)
    again = run("monitor", log, "--json")
    assert again.status == 1
    assert {v["code"] for v in again.json["violations"]} >= found - {"HandOffGap", "Contact"}
    assert again.json["violations"][0]["label"] == "sub1"
    assert again.json["violations"][0]["robot"] == robot


def test_bodies_that_touch(run: Terminal, tmp_path: Path) -> None:
    """A parked copy is put into a carriage that goes by."""
    log, page = tmp_path / "log", tmp_path / "page.html"
    with before_the_switch("sub1", into("part/part1#1", "r2/carriage")):
        found = failed(run, "--log", log, "--max-time", 30)
    assert "Contact" in found
    document = run("monitor", log, "--json").json
    contact = next(f for f in document["verdict"]["failures"] if f["code"] == "Contact")
    assert "unintended contacts: " in contact["message"] and "part1#1" in contact["message"]
    assert run("report", log, "-o", page).status == 1
    text = page.read_text("utf-8")
    assert all(f"{code} " in text for code in found), "of many failures the first of each code"


def test_an_engine_that_warns(paper: Layout, monkeypatch: pytest.MonkeyPatch) -> None:
    """It has too little memory for its constraints; the figures count what it says."""

    def small(model: Model) -> Any:
        xml, count = re.subn(r'memory="\d+M"', 'memory="8K"', model.xml)
        assert count == 1
        return loading.load(replace(model, xml=xml))

    assert Simulation(paper, RunRequest()).physical.figures().engine_warnings == 0
    monkeypatch.setattr(mujoco_world, "load", small)
    assert Simulation(paper, RunRequest()).physical.figures().engine_warnings > 0


def test_a_run_whose_engine_has_warned(run: Terminal) -> None:
    with before_the_switch("sub1", warns):
        done = run("run", PAPER, "--json")
    assert done.status == 1 and done.json["engine_warnings"] > 0
    assert [f["code"] for f in done.json["verdict"]["failures"]] == ["EngineWarning"]


@pytest.fixture(scope="module")
def log_file(paper: Layout, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("logs") / "run.log"
    simulation = Simulation(paper, RunRequest(units=2, seed=2, jitter=0.3))
    with LogWriter(path, simulation) as writer:
        simulation.run([writer.observe])
    return path


def test_two_events_exchanged_in_a_log(log_file: Path) -> None:
    """Whichever two that are not of the same time."""
    log = read_log(log_file)
    assert watch_log(log)[0].refines_net
    pairs = [
        (one, other)
        for one in range(len(log.fired))
        for other in (one + 1, one + 2, one + 7)
        if other < len(log.fired) and log.fired[one] != log.fired[other]
        if abs(log.fired_t[one] - log.fired_t[other]) > 1e-6
    ]
    for one, other in pairs[::15]:
        fired = log.fired.copy()
        fired[[one, other]] = fired[[other, one]]
        changed = replace(log, fired=fired)
        report, subject = watch_log(changed)
        verdict = verdict_on(changed, subject.factory, report)
        assert not verdict.succeeded and codes(verdict) <= {"Record", "NotRefined"}
        assert "Record" in codes(verdict), (one, other)


def test_a_log_without_what_a_verdict_rests_on(log_file: Path) -> None:
    """Older versions kept neither ends of operations nor figures."""
    log = read_log(log_file)
    assert log.ends is not None and log.figures is not None
    assert set(log.figures) >= {limit.figure for limit in LIMITS}
    assert (log.ends.time <= log.time[log.ends.row]).all()
    old = replace(log, ends=None, figures=None)
    report, subject = watch_log(old)
    assert verdict_on(old, subject.factory, report).succeeded


@pytest.mark.parametrize("wrong", [[], {"engine_warnings": "0"}, {"contacts": [1]}], ids=str)
def test_figures_that_are_none(wrong: Any) -> None:
    with pytest.raises(ValueError, match="figure"):
        check_figures(wrong)


def test_what_comes_first_is_the_cause_and_is_told_first() -> None:
    """A contact before a load is dropped comes first, one after it does not; of many failures of a
    code the first is told, and a hint for the cause alone."""
    dropped = Diagnostic("Dropped", "r1 drops 'a'", None, "accelerate less")
    seen = [Violation(2.3 + n, "r1", "a", "Dropped", f"nothing holds a#{n}") for n in range(17)]
    report = Report((), (), tuple(seen))
    hit = {"unintended_contacts": 3, "contacts": ["r2/pad - part/p13#1/2"], "dropped_s": 2.26}
    before = RunVerdict.of(dropped, True, {**hit, "contact_first_s": 2.2}, report)
    first, second = before.gathered
    assert first.message.startswith("r2/pad hit p13 at 2.20 s; 3 unintended contacts: ")
    assert second.message == "r1 drops 'a' (and 17 more)" and not second.hint
    after = RunVerdict.of(dropped, True, {**hit, "contact_first_s": 2.27}, report).gathered
    assert [line.code for line in after] == ["Dropped", "Contact"]
    assert after[0].hint == "accelerate less"
    model = RunVerdict.of(
        dropped, True, {**hit, "faults": [["NotSolid", "r2/pad is not solid"]]}, None
    )
    assert model.failures[0].code == "NotSolid" and len(model.failures) == 3
