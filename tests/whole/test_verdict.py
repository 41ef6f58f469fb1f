"""Whether a run succeeded: faults planted in the bodies are each found by name and make `run` fail,
beside the run and from its log; honest runs succeed."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import factory
from benches.speed.factories import balanced
from factory.apps.deviations import Deviation, deviate
from factory.apps.deviations.interference import Interference
from factory.apps.log import read_log
from factory.apps.log.checks import check_figures
from factory.apps.log.writer import LogWriter
from factory.apps.monitor import beside
from factory.apps.monitor.record import verdict_on, watch_log
from factory.apps.runs.watched import watched
from factory.engine.mjcf import loading, names
from factory.engine.mjcf.model import Model
from factory.engine.record.findings import Report, Violation
from factory.engine.record.verdict import LIMITS, RunVerdict, judged
from factory.engine.simulation.mujoco import probing
from factory.engine.simulation.mujoco import world as mujoco_world
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.layout import Layout
from factory.floor.layout.request import Ground
from factory.pipeline import read
from factory.support.engine import mujoco
from factory.support.errors import Diagnostic
from factory.support.settings import Settings
from tests.command_line import Terminal
from tests.examples import with_hands
from tests.good_runs import random_marking
from tests.layout_values import random_layout
from tests.pag_texts import laid_out
from tests.paths import PAPER, ROOT
from tests.planted import before_the_switch, displaced, into, moved, warns

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


# --- honest runs ----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", EXAMPLES)
@pytest.mark.parametrize(
    ("seed", "fuse"), [*(pytest.param(n, False, marks=pytest.mark.slow) for n in (0, 1)), (1, True)]
)
def test_an_honest_run_of_an_example_succeeds(name: str, seed: int, fuse: bool) -> None:
    layout = with_hands(name)
    asked = RunRequest(units=2, seed=seed, jitter=0.3, fuse=fuse, shown=False)
    run = watched(Simulation(layout, asked))
    assert run.succeeded, run.verdict.failures
    assert run.monitor is not None
    assert len(run.monitor.seen) + len(run.monitor.inferred) == len(run.events)


@pytest.mark.parametrize("name", ["paper", "chair", pytest.param("chest", marks=pytest.mark.slow)])
def test_an_honest_run_with_relays_succeeds(name: str) -> None:
    layout = read(ROOT / "examples" / f"{name}.pag", ground=Ground(relay=True)).layout
    for fuse in (False, True):
        asked = RunRequest(units=3, seed=1, jitter=0.3, fuse=fuse, shown=False)
        run = watched(Simulation(layout, asked))
        assert run.succeeded, run.verdict.failures


@pytest.mark.parametrize(
    "disturbance",
    [
        *(Deviation("mass", factor=factor) for factor in (1.5, 0.5)),
        *(Deviation("gain", factor=factor) for factor in (1.3, 0.7)),
        Deviation("noise", metres=5e-5),
    ],
    ids=lambda deviation: f"{deviation.kind} {deviation.factor or ''}",
)
def test_an_honest_run_that_is_disturbed_succeeds(paper: Layout, disturbance: Any) -> None:
    simulation = Simulation(paper, RunRequest(units=2, seed=1, jitter=0.3, shown=False))
    run = watched(deviate(simulation, disturbance))
    assert run.succeeded, run.verdict.failures


@pytest.mark.parametrize("seed", range(3))
def test_an_honest_run_in_other_ways_succeeds(paper: Layout, seed: int) -> None:
    for more in (
        {"distributed": True},
        {"start": random_marking(paper, seed)},
        {"wip": 1},
    ):
        asked = RunRequest(units=3, seed=seed, jitter=0.3, shown=False, **more)
        run = watched(Simulation(paper, asked))
        assert run.succeeded, run.verdict.failures


@pytest.mark.parametrize(
    ("seed", "run_seed", "jitter", "fuse", "stage"),
    [(45, 53, 0.3, True, 1), (167, 14, 0.0, True, 0), (236, 47, 0.3, False, 1)],
)
def test_robots_that_come_and_go_between_two_looks(
    seed: int, run_seed: int, jitter: float, fuse: bool, stage: int
) -> None:
    """Operations without a hand-over, some at one place, some shorter than it takes to look."""
    layout = random_layout(
        3 + seed % 12, seed, style=("plain", "small", "medium", "mixed")[seed % 4]
    )
    settings = Settings(stage=stage)
    asked = RunRequest(
        units=4, seed=run_seed, jitter=jitter, fuse=fuse, shown=False, settings=settings
    )
    run = watched(Simulation(layout, asked))
    assert run.succeeded, run.verdict.failures


def test_bodies_that_become_one_in_a_chain_are_explained() -> None:
    """One body takes the place of others in the tick in which it is itself put away elsewhere."""
    run = watched(Simulation(laid_out(balanced(21)), RunRequest(units=4, fuse=True, shown=False)))
    assert run.succeeded, run.verdict.failures


def test_a_monitor_of_a_run_looks_where_operations_end(paper: Layout) -> None:
    """Not in every tick: the engine still takes several at once, of a model that is not shown."""
    simulation = Simulation(paper, RunRequest(units=8, shown=False))
    looks, glances = list[bool](), list[float]()
    monitor, run = beside(simulation), simulation.run
    see = monitor.see
    monitor.see = lambda seen, thorough: (looks.append(seen.at_end), see(seen, thorough))[1]  # type: ignore[assignment, func-returns-value]
    done = run(glances=[monitor.glance, lambda state: glances.append(state.time)])
    report = monitor.report(done.events)
    assert report.refines_net
    ticks = done.sim_time_s / simulation.request.settings.tick
    assert len(glances) < ticks / 2
    assert len(looks) < len(done.events) + 3 * done.sim_time_s
    assert done.wall_time_s == pytest.approx(done.physics_time_s + done.supervisor_time_s)
    assert 0 < report.time_s < done.wall_time_s


# --- planted faults -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("robot", "by"), [("r3", 0.06), ("r3", 0.0015), ("r3", 0.0006), ("r5", 0.005), ("r5", 0.0006)]
)
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


@pytest.mark.parametrize(("axis", "by"), [(0, 0.0015), (2, 0.06), (2, 0.0006)])
def test_a_part_that_jumps_before_its_weld_switches(run: Terminal, axis: int, by: float) -> None:
    """By what the table of planted faults has not."""
    with before_the_switch("sub1", displaced("part/part1#1", by, axis=axis)):
        assert "Missed" in failed(run)


def test_an_error_that_welds_pull_back_is_told(run: Terminal) -> None:
    """A part that jumps or is turned as it is taken is in its place when the product is done."""
    turned = displaced("part/part1#1", degrees=np.degrees(0.02))
    for act, least in ((displaced("part/part1#1", 0.005), 4.9), (turned, 0.3)):
        with before_the_switch("sub1", act):
            document = run("run", PAPER, "--lenient", "--json").json
        assert document["product_error_max_mm"] < 0.02
        assert document["joining_error_max_mm"] > least
    honest = run("run", PAPER, "--json").json
    assert honest["joining_error_max_mm"] == pytest.approx(honest["handoff_gap_max_mm"], abs=1e-3)


def test_a_lenient_run_of_bodies_that_disagree(
    run: Terminal, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    act = moved(names.slide("r3"), -0.06)
    log, page = tmp_path / "log", tmp_path / "page.html"
    for words in ((), ("-q",)):
        with before_the_switch("sub1", act):
            assert run("run", PAPER, "--lenient", *words).status == 0
    with before_the_switch("sub1", act):
        done = run("run", PAPER, "--lenient", "--json", "--log", log)
    verdict = done.json["verdict"]
    assert done.status == 0 and verdict["succeeded"] and verdict["lenient"]
    assert {failure["code"] for failure in verdict["failures"]} >= {"Missed", "HandOffGap"}
    assert not done.json["refines_net"]
    assert run("monitor", log).status == 1
    assert run("monitor", log, "--lenient").status == 0
    failing = run("report", log, "-o", page, "--json")
    assert failing.status == 1 and not failing.json["verdict"]["succeeded"]
    assert "does not follow the net" in page.read_text("utf-8")
    assert run("report", log, "-o", page, "--lenient").status == 0
    (tmp_path / "factory.toml").write_text("lenient = true\n")
    monkeypatch.chdir(tmp_path)
    with before_the_switch("sub1", act):
        assert run("run", PAPER).status == 0


def test_each_failed_part_is_a_line_of_the_summary(run: Terminal) -> None:
    with before_the_switch("sub1", moved(names.slide("r3"), -0.06)):
        done = run("run", PAPER)
    lines = [line.strip() for line in done.out.splitlines()]
    assert lines[0].startswith("the run FAILED: Early: ") and "60.0 mm from its goal" in lines[0]
    assert any(line.startswith("HandOffGap: a hand-off with a gap of 60.0") for line in lines)
    words = [line.partition(":")[0] for line in lines[1:8] if line[0].isupper()]
    assert len(words) == len({*words}), "one line a code"
    assert "the run succeeded" in run("run", PAPER).out


def test_a_monitor_that_is_not_wanted(run: Terminal) -> None:
    with before_the_switch("sub1", moved(names.slide("r3"), -0.0006)):
        done = run("run", PAPER, "--no-monitor", "--json")
    assert done.status == 0 and "monitor_time_s" not in done.json
    assert run("run", PAPER, "--world", "ideal", "--no-monitor").status == 0


@pytest.mark.parametrize("logged", [False, True])
def test_a_weld_that_is_on_for_50_ms(tmp_path: Path, logged: bool) -> None:
    """It is switched in the middle of a call of the engine, where nothing else happens. Two robots
    that pull are too much for a hand: it lets go."""
    simulation = Simulation(read(PAPER).layout, RunRequest(shown=False))
    d, m = simulation.physical.d, simulation.physical.m
    extra = m.equality("grip/r5/part1").id

    def act() -> None:
        if d.time > 1.0:
            d.eq_active[extra] = d.time < 1.05

    simulation.physical.hooks.before_step.append(act)
    log = tmp_path / "log"
    if not logged:
        run = watched(simulation)
        trouble = run.trouble.code if run.trouble else None
        assert "TwoHolders" in codes(run.verdict) and trouble == "Dropped"
        return
    with LogWriter(log, simulation) as writer:
        simulation.run([writer.observe])
    report, subject = watch_log(read_log(log))
    verdict = verdict_on(read_log(log), subject.factory, report)
    assert "TwoHolders" in codes(verdict)
    found = next(v for v in report.violations if v.code == "TwoHolders")
    assert found.label == "part1" and 1.0 <= found.t <= 1.03


def test_a_sensor_that_lies_by_2_mm(paper: Layout) -> None:
    """Its scale is wrong: it is right at home, and 2 mm off where robots meet."""
    simulation = Simulation(paper, RunRequest(shown=False))
    axis, path = paper.factory.robots[4].index, paper.guidepaths[4]
    scale = 1 + 0.002 / path.travel

    def lie(q: Any, v: Any) -> tuple[Any, Any]:
        q, v = q.copy(), v.copy()
        q[axis] = path.length - scale * (path.length - q[axis])
        v[axis] *= scale
        return q, v

    Interference(simulation.physical).mismeasure(lie)
    run = watched(simulation)
    assert run.trouble is None and run.replays
    assert {"Early", "Missed", "HandOffGap"} <= codes(run.verdict)
    assert "r5" in {v.robot for v in run.monitor.violations if v.code == "Early"}  # type: ignore[union-attr]


def test_a_sensor_that_would_have_a_robot_leave_its_rail(paper: Layout) -> None:
    """By what it says, home is 2 mm beyond the end stop's middle: there the robot is held."""
    simulation = Simulation(paper, RunRequest(shown=False))
    axis = paper.factory.robots[4].index

    def lie(q: Any, v: Any) -> tuple[Any, Any]:
        q = q.copy()
        q[axis] -= 0.002
        return q, v

    Interference(simulation.physical).mismeasure(lie)
    run = watched(simulation)
    assert run.trouble is not None and run.trouble.code == "Stalled"
    assert "r5" in run.trouble.message
    at = simulation.physical.d.qpos[simulation.physical.motion.axes.qpos[axis]]
    assert 0.0005 < at - paper.guidepaths[4].length < 0.0015


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


# --- logs -----------------------------------------------------------------------------------------


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
    for one, other in pairs[::5]:
        fired = log.fired.copy()
        fired[[one, other]] = fired[[other, one]]
        changed = replace(log, fired=fired)
        report, subject = watch_log(changed)
        verdict = verdict_on(changed, subject.factory, report)
        assert not verdict.succeeded and codes(verdict) <= {"Record", "NotRefined"}
        assert "Record" in codes(verdict), (one, other)


def test_events_out_of_time_and_left_out_of_a_log(log_file: Path) -> None:
    log = read_log(log_file)
    for changed in (
        replace(log, fired=log.fired[:-1], fired_t=log.fired_t[:-1]),
        replace(log, fired_t=log.fired_t + 0.05),
        replace(log, fired=log.fired[::-1], fired_t=log.fired_t[::-1]),
    ):
        report, _ = watch_log(changed)
        assert {v.code for v in report.violations} == {"Record"}


def test_a_log_without_what_a_verdict_rests_on(log_file: Path) -> None:
    """Older versions kept neither ends of operations nor figures."""
    log = read_log(log_file)
    assert log.ends is not None and log.figures is not None
    assert set(log.figures) >= {limit.figure for limit in LIMITS}
    assert (log.ends.time <= log.time[log.ends.row]).all()
    old = replace(log, ends=None, figures=None)
    report, subject = watch_log(old)
    assert verdict_on(old, subject.factory, report).succeeded


@pytest.mark.parametrize(
    "wrong", [[], {"engine_warnings": "0"}, {"contacts": 1}, {"contacts": [1]}], ids=str
)
def test_figures_that_are_none(wrong: Any) -> None:
    with pytest.raises(ValueError, match="figure"):
        check_figures(wrong)


def test_every_limit_is_judged() -> None:
    for limit in LIMITS:
        assert judged(None, True, {limit.figure: limit.most}, None).succeeded
        verdict = judged(None, True, {limit.figure: limit.most + 1}, None)
        assert [failure.code for failure in verdict.failures] == [limit.code]
        assert not verdict.succeeded and replace(verdict, lenient=True).succeeded
    assert not judged(None, False, None, None, lenient=True).succeeded
    assert not judged(Diagnostic("Stalled", ""), True, None, None, lenient=True).succeeded


def test_what_comes_first_is_the_cause_and_is_told_first() -> None:
    """A contact before a load is dropped comes first, one after it does not; of many failures of a
    code the first is told, and a hint for the cause alone."""
    dropped = Diagnostic("Dropped", "r1 drops 'a'", None, "accelerate less")
    seen = [Violation(2.3 + n, "r1", "a", "Dropped", f"nothing holds a#{n}") for n in range(17)]
    report = Report((), (), tuple(seen))
    hit = {"unintended_contacts": 3, "contacts": ["r2/pad - part/p13#1/2"], "dropped_s": 2.26}
    before = judged(dropped, True, {**hit, "contact_first_s": 2.2}, report)
    first, second = before.gathered
    assert first.message.startswith("r2/pad hit p13 at 2.20 s; 3 unintended contacts: ")
    assert second.message == "r1 drops 'a' (and 17 more)" and not second.hint
    after = judged(dropped, True, {**hit, "contact_first_s": 2.27}, report).gathered
    assert [line.code for line in after] == ["Dropped", "Contact"]
    assert after[0].hint == "accelerate less"
    model = judged(dropped, True, {**hit, "faults": [["NotSolid", "r2/pad is not solid"]]}, None)
    assert model.failures[0].code == "NotSolid" and len(model.failures) == 3


def test_figures_that_are_no_numbers_fail() -> None:
    """An error that is nan is no small error."""
    assert not judged(None, True, {"product_error_max_mm": float("nan")}, None).succeeded


def test_what_finds_no_contact_is_tried_with_other_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    """A floor that one part does not touch was tried with that part three times."""
    tried: list[tuple[int, int]] = []

    class Probes:
        touched = frozenset[int]()

        def __init__(self, *_: object) -> None: ...

        def touches(self, body: int) -> bool:
            return True

        def put(self, bodies: Sequence[int], geoms: Sequence[int]) -> None:
            tried.extend(zip(bodies, geoms, strict=True))

    monkeypatch.setattr(probing, "_Probes", Probes)
    parts = {body: np.array([body]) for body in (14, 15, 16)}
    assert probing.untouched(None, np.arange(5), parts) == [0, 1, 2, 3, 4]  # type: ignore[arg-type]
    for geom in range(5):
        assert {body for body, at in tried if at == geom} == {14, 15, 16}


def test_a_plate_touches_the_floor_wherever_it_is_put() -> None:
    """Exactly on the diagonal of a square floor the engine found no contact with some plates."""
    corners = "-1 1 1  -1 1 -1  -1 -1 -1  1 1 -1  1 1 1  -1 -1 1  1 -1 1  1 -1 -1"
    for half, x, y in ((7.7427, 1.4527, 0.1658), (11.0922, -0.3093, -1.8867)):
        m = mujoco.MjModel.from_xml_string(f"""
            <mujoco>
              <asset><mesh name="plate" scale="0.0877 0.0877 0.0044" vertex="{corners}"/></asset>
              <worldbody>
                <geom type="box" size="{half} {half} 0.1" pos="{x} {y} -0.1"/>
                <body pos="-0.206 -0.198 0.104"><freejoint/><geom type="mesh" mesh="plate"/></body>
              </worldbody>
            </mujoco>""")
        assert probing.untouched(m, np.array([0]), {1: np.array([1])}) == []
