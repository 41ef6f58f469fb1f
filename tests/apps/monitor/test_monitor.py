"""The monitor: it explains every good run, and finds faults planted in the engine, with time,
robot, label and source line."""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import factory
from factory.apps.deviations import Campaign, Deviation
from factory.apps.log import Log, LogWriter, read_log
from factory.apps.log.model import model_of
from factory.apps.monitor import MonitorSubject, Report, beside
from factory.apps.monitor.calm import spells
from factory.apps.monitor.explanation import SeenFirings
from factory.apps.monitor.record import recorded_subject, verdict_on, watch_log
from factory.apps.monitor.recount import WORDS, _Places
from factory.apps.runs.start import legal_marking
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.layout import Layout
from factory.support.errors import InputError
from factory.support.settings import Settings
from factory.theory.nets.undone import Undone
from tests.command_line import Terminal
from tests.failing_runs import CAMPAIGN, failing
from tests.good_runs import assert_good
from tests.paths import PAPER, ROOT
from tests.planted import Acts, displaced
from tests.slow import slow_but


def watched(simulation: Simulation, max_time: float | None = None) -> tuple[Any, Report]:
    monitor = beside(simulation)
    run = simulation.run([monitor.observe], max_time)
    return run, monitor.report()


def assert_explained(simulation: Simulation, run: Any, report: Report) -> None:
    """The run and the verdict are good, and the firings are those of the supervisor, each in its
    interval."""
    assert_good(run)
    assert run.products == simulation.request.units
    assert report.refines_net, report.violations
    firings = {(f.transition, f.unit): f for f in (*report.seen, *report.inferred)}
    assert len(firings) == len(report.seen) + len(report.inferred) == len(run.events)
    names = simulation.layout.factory.net.threaded.transitions
    count = Counter({names[e].name: n for e, n in simulation.counts.items()})
    for event in run.events:
        firing = firings[event.transition, count[event.transition]]
        count[event.transition] += 1
        assert firing.earliest - 1e-9 <= event.t <= firing.latest + 1e-9


@pytest.fixture(scope="module")
def paper() -> Layout:
    return factory.lay_out(factory.compile(factory.load_pag(PAPER)))


@pytest.mark.parametrize("seed", slow_but([4], [1, 2, 4]))
def test_the_papers_example_is_explained(paper: Layout, seed: int) -> None:
    simulation = Simulation(
        paper,
        RunRequest(
            units=3,
            seed=seed,
            jitter=0.3,
            wip=1 + seed // 2 if seed % 2 else None,
            distributed=seed == 4,
            settings=Settings(timestep=0.001, substeps=4 + seed),
        ),
    )
    assert_explained(simulation, *watched(simulation))


def test_it_reads_neither_the_supervisor_nor_the_world() -> None:
    imported = set()
    paths = sorted((ROOT / "factory" / "apps" / "monitor").glob("*.py"))
    assert len(paths) > 5
    for path in paths:
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.ImportFrom):
                imported.add(node.module or "")
    rooms = {".".join(name.split(".")[1:3]) for name in imported if name.startswith("factory.")}
    assert not rooms & {"engine.simulation", "theory.control", "floor.modes"}


def assert_caught(
    report: Report, code: str, robot: str, label: str, line: int, t: float, late: float = 0.05
) -> None:
    """Some violation has that code, robot, label and line, near that time; none is before it."""
    assert not report.refines_net
    found = [
        (v.code, v.robot, v.label, v.position.line if v.position else 0) for v in report.violations
    ]
    assert (code, robot, label, line) in found
    caught = report.violations[found.index((code, robot, label, line))]
    assert t - 0.03 <= caught.t <= t + late
    assert t - 0.03 <= report.violations[0].t
    assert caught.position is not None and caught.position.file == str(PAPER)
    assert caught.message and str(caught.diagnostic())


def weld(simulation: Simulation, name: str) -> int:
    return int(simulation.world.m.equality(name).id)


def test_a_weld_that_is_never_released(paper: Layout) -> None:
    simulation = Simulation(paper, RunRequest(units=1))
    welds, kept = simulation.physical.parts.welds, weld(simulation, "grip/r5/part1")
    release = welds.open

    def sticky(off: Iterable[int]) -> None:
        release([number for number in off if number != kept])

    welds.open = sticky  # type: ignore[method-assign]
    run, report = watched(simulation, 3)
    t = next(e.t for e in run.events if e.transition == "sub1_e")
    assert_caught(report, "TwoHolders", "r5", "part1", 6, t)
    assert "r3 and r5 both hold part1#1" in report.violations[0].message


def test_a_weld_with_a_wrong_frame(paper: Layout) -> None:
    simulation = Simulation(paper, RunRequest(units=1))
    simulation.world.m.eq_data[weld(simulation, "grip/r1/part2"), 4] += 0.001
    _, report = watched(simulation, 0.1)
    assert_caught(report, "Frame", "r1", "part2", 7, 0.0)


def exchanged_copies(m: Any, d: Any) -> None:
    """Bodies and welds of two units both: nothing moves, and every part is held where it should
    be."""
    bodies = [int(m.body(f"part/part1#{n}").id) for n in (1, 2)]
    at, to = (m.jnt_qposadr[m.body_jntadr[body]] for body in bodies)
    pose = d.qpos[at : at + 7].copy()
    d.qpos[at : at + 7], d.qpos[to : to + 7] = d.qpos[to : to + 7], pose
    of = [[e for e in range(m.neq) if d.eq_active[e] and m.eq_obj2id[e] == b] for b in bodies]
    m.eq_obj2id[of[0]], m.eq_obj2id[of[1]] = bodies[::-1]


def cut(m: Any, d: Any) -> None:
    """The drive of r5 does nothing."""
    m.actuator_biasprm[4, 1:3] = m.actuator_gaintype[4] = m.actuator_gainprm[4] = 0


@pytest.mark.parametrize(
    ("fired", "times", "act", "late", "caught"),
    [
        ("sub1_e", 1, displaced("part/part2#1", -0.05, axis=2), 0.05, ["Dropped r3 part2 7"]),
        ("part1_e", 2, exchanged_copies, 0.05, ["Exchanged r5 part1 6"]),
    ],
)  # fmt: skip
def test_what_is_done_to_the_engine(
    paper: Layout, fired: str, times: int, act: Acts, late: float, caught: list[str]
) -> None:
    """As a transition has fired so often."""
    simulation = Simulation(paper, RunRequest(units=2))
    step, done = simulation.supervisor.step, list[float]()

    def stepped(ticks: int = 1) -> None:
        if not done and times <= sum(e.transition == fired for e in simulation.supervisor.events):
            act(simulation.world.m, simulation.world.d)
            done.append(simulation.world.time)
        step(ticks)

    simulation.supervisor.step = stepped  # type: ignore[method-assign]
    run, report = watched(simulation)
    for words in caught:
        where, _, message = words.partition(": ")
        code, robot, label, line = where.split()
        assert message in report.violations[0].message
        assert_caught(report, code, robot, label, int(line), done[0], late)
    assert act is not cut or run.trouble.code == "Stalled"


def hurry(simulation: Simulation, label: str, delay: float) -> list[float]:
    """The supervisor ends an operation so long after it started, whatever its robots do."""
    supervisor, done = simulation.supervisor, list[float]()
    number = simulation.layout.factory.by_label[label].index
    finished, own = supervisor._finished, (f"{label}_s", f"{label}_e")

    def hasty() -> list[int]:
        found = list(finished())
        last = next((e for e in reversed(supervisor.events) if e.transition in own), None)
        since = last.t if last and last.transition == own[0] else float("inf")
        if not done and since + delay <= supervisor.world.time and number not in found:
            done.append(supervisor.world.time)
            found.append(number)
        return found

    supervisor._finished = hasty
    return done


@pytest.mark.parametrize(("label", "delay", "robot", "line"), [("sub2", 0.9, "r4", 4)])
def test_an_operation_ended_before_its_goal(
    paper: Layout, label: str, delay: float, robot: str, line: int
) -> None:
    simulation = Simulation(paper, RunRequest(units=2))
    done = hurry(simulation, label, delay)
    _, report = watched(simulation, 4)
    assert_caught(report, "Early", robot, label, line, done[0])


def test_parts_that_the_marking_does_not_account_for(paper: Layout) -> None:
    start = legal_marking(paper.factory.net, "r3:sub1")
    simulation = Simulation(paper, RunRequest(units=1, start=start))
    simulation.request = replace(simulation.request, start=None)
    monitor = beside(simulation)
    found = [(v.code, v.robot, v.label) for v in monitor.violations]
    assert ("Start", "r3", "part1") in found


def test_firings_in_an_impossible_order(paper: Layout) -> None:
    """The difference constraints alone: one firing too early is one violation."""
    subject: MonitorSubject = MonitorSubject.of(paper, Settings())
    events = paper.factory.net.threaded.net.transition_index
    explanation = SeenFirings(subject, 0.015)
    for name, t in (("part1_e", 1.0), ("part2_e", 1.0), ("sub1_e", 3.0)):
        explanation.saw(events[name], 0, t, t + 0.01, t, "r3")
    _, inferred, found = explanation.solve(0.0, 9.0)
    assert not found
    bounds = {f.transition: (f.earliest, f.latest) for f in inferred}
    assert bounds["sub1_s"] == (1.0, 3.01) and bounds["part1_s"] == (0.0, 1.01)
    explanation.saw(events["sub2_s"], 0, 0.0, 2.0, 2.0, "r3")
    _, _, found = explanation.solve(0.0, 9.0)
    assert [(v.code, v.robot, v.label, v.t) for v in found] == [("Order", "r3", "sub2", 2.0)]
    explanation.saw(events["sub3_s"], 0, 0.0, 4.0, 4.0, "r2")
    _, _, found = explanation.solve(0.0, 9.0)
    assert [v.label for v in found] == ["sub2", "sub3"]
    assert "part3_e must come first, and was not observed" in found[1].message


def test_logs_that_cannot_be_watched(paper: Layout, tmp_path: Path, run: Terminal) -> None:
    path = tmp_path / "ideal"
    with LogWriter(path, simulation := Simulation(paper, RunRequest("ideal"))) as writer:
        simulation.run([writer.observe])
    done = run("monitor", path, "--json")
    assert done.status == 2 and done.codes == ["BadLog"]
    assert "ideal world" in done.json["errors"][0]["message"]
    assert run("monitor", PAPER, "--json").codes == ["BadLog"]
    with LogWriter(path, simulation := Simulation(paper)) as writer:
        simulation.run([writer.observe], 0.1)
    log = read_log(path)
    for key in ("monitor", "start", "templates"):
        header = {k: v for k, v in log.header.items() if k != key}
        with pytest.raises(InputError, match="BadLog"):
            watch_log(factory_log(log, header))
    with pytest.raises(InputError, match="differs from the factory in its header"):
        watch_log(factory_log(log, {**log.header, "transitions": ["x_s"]}))


def factory_log(log: Log, header: dict[str, Any], **changes: Any) -> Log:
    return replace(log, header=header, **changes)


SECOND = Campaign(
    (
        Deviation("misplaced", label="part2", unit=2, metres=4e-3),
        *(Deviation("bad_joint", label="sub1", unit=3, metres=2e-3) for _ in range(3)),
        Deviation("down", robot="r2", unit=5),
    ),
    clear=2.0,
)


@pytest.fixture(scope="module", params=[CAMPAIGN, SECOND], ids=["drops", "scraps"])
def log(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Log:
    return failing(tmp_path_factory.mktemp("failing") / "log", units=8, campaign=request.param)


def test_spells_have_no_failure(log: Log) -> None:
    assert log.failures is not None
    factory = recorded_subject(log.header).factory
    found, last = [*spells(log, factory, model_of(log))], 0.0
    for begin, end in found:
        assert last <= begin < end
        assert not any(begin <= one.t <= end for one in log.failures.found)
        assert not any(begin <= undone.t <= end for _, undone in log.undone)
        last = end


@pytest.mark.parametrize("change", ["more", "less", "other"])
def test_an_undo_that_is_not_the_least_is_caught(log: Log, change: str) -> None:
    """By the replay of the record, whatever the states say."""
    after, undone = log.undone[0]
    names = undone.transitions
    planted = {
        "more": (*names, "part3_s"),
        "less": names[1:],
        "other": ("part3_s", "part3_e", *names[2:]),
    }[change]
    wrong = replace(undone, transitions=planted)
    assert isinstance(wrong, Undone)
    bad = replace(log, undone=((after, wrong), *log.undone[1:]))
    report, subject = watch_log(bad)
    assert not verdict_on(bad, subject.factory, report).succeeded


def test_a_part_that_is_turned_in_the_product_shows_in_its_angle() -> None:
    places = _Places.__new__(_Places)
    labels, turn = ["a", "b"], np.radians(3.0)
    places._anatomy = SimpleNamespace(  # type: ignore[assignment]
        label=labels, copy_of=np.arange(2), body=np.array([0, 7])
    )
    places._order, places._reach = {"a": 0, "b": 1}, np.array([0.0, 0.1])
    places._place = {"a": np.zeros(3), "b": np.array([0.0, 0.0, 0.1])}
    places.figures, places.most_error = dict.fromkeys(WORDS), 0.0
    qpos = np.array([0, 0, 0, 1, 0, 0, 0, 0, 0, 0.1, np.cos(turn / 2), 0, 0, np.sin(turn / 2)])
    places._finished([0, 1], qpos)
    assert places.figures["product_angle_max_deg"] == pytest.approx(3.0)
    assert places.figures["product_error_max_mm"] == pytest.approx(0.0)
    assert places.most_error == pytest.approx(1e3 * turn * 0.1)
