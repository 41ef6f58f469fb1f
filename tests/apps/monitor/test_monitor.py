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
from factory.apps.log import Log, LogWriter, read_log
from factory.apps.monitor import MonitorSubject, Report, beside
from factory.apps.monitor.explanation import SeenFirings
from factory.apps.monitor.motion import AxisMotion
from factory.apps.monitor.record import watch_log
from factory.apps.monitor.recount import WORDS, _Places
from factory.engine.record.state import Observation
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.layout import Layout
from factory.pipeline import all_templates
from factory.support.errors import InputError
from factory.support.settings import Settings
from factory.theory.lang import read_pag
from factory.theory.nets.history import legal_marking
from tests.command_line import Terminal
from tests.examples import with_hands
from tests.good_runs import assert_good, random_marking
from tests.layout_values import random_layout
from tests.pag_texts import PRODUCTS, UNARY, laid_out
from tests.paths import PAPER, ROOT
from tests.planted import Acts, both, displaced, reframed, welded


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


# --- good runs ------------------------------------------------------------------------------------


@pytest.mark.parametrize("number", range(len(PRODUCTS)))
def test_every_shape_of_product_is_explained(number: int) -> None:
    """Every second one by robots that run by themselves."""
    layout = laid_out([*PRODUCTS.values()][number])
    asked = RunRequest(units=2, seed=1, jitter=0.3, distributed=number % 2 == 1)
    simulation = Simulation(layout, asked)
    assert_explained(simulation, *watched(simulation))


@pytest.mark.parametrize("seed", [1, 2, 4])
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


@pytest.mark.parametrize("seed", range(6))
def test_a_run_from_a_marking_is_explained(paper: Layout, seed: int) -> None:
    simulation = Simulation(
        paper, RunRequest(units=2, seed=seed, start=random_marking(paper, seed))
    )
    assert_explained(simulation, *watched(simulation))


@pytest.mark.parametrize("seed", [1, 3, 6, 7])
def test_random_factories_give_no_false_alarm(seed: int) -> None:
    style = ("plain", "small", "medium", "mixed")[seed % 4]
    layout = random_layout(3 + seed, seed, style=style)
    simulation = Simulation(
        layout, RunRequest(units=2, seed=seed, jitter=0.3 * (seed % 2), distributed=seed % 4 == 3)
    )
    assert_explained(simulation, *watched(simulation))


def test_firings_are_seen_to_a_tick(paper: Layout) -> None:
    """Parts that change hands show X_e, the first robot that leaves shows X_s; what has no motion
    of its own is inferred: the first atomic_s, and the ends of welds."""
    simulation = Simulation(paper, RunRequest(units=2))
    run, report = watched(simulation)
    count: Counter[str] = Counter()
    when = {}
    for event in run.events:
        when[event.transition, count[event.transition]] = event.t
        count[event.transition] += 1
    for firing in report.seen:
        assert firing.seen == pytest.approx(when[firing.transition, firing.unit], abs=1e-9)
        assert firing.latest - firing.seen <= simulation.request.settings.tick + 1e-9
    inferred = {(f.transition, f.unit) for f in report.inferred}
    assert inferred == {
        *((f"part{n}_s", 0) for n in (1, 2, 3)),
        *(("sub2_e", unit) for unit in (0, 1)),
    }
    assert report.time_s > 0


def test_setpoints_are_two_ticks_old_at_most_though_something_ends_in_every_tick(
    paper: Layout,
) -> None:
    """Else a robot that ends its operation where it came to in these ticks would seem to be where
    it was before them, and then to leave from there."""
    simulation = Simulation(paper, RunRequest())
    monitor, tick = beside(simulation), simulation.request.settings.tick
    first, drives = simulation.state().observation.kept(), monitor.anatomy.drive
    for number in range(1, 9):
        ctrl = first.ctrl.copy()
        ctrl[drives] += 1e-3 * number
        time = first.time + 0.9 * tick * number
        monitor.motion.look(replace(first, time=time, ctrl=ctrl, at_end=True))
        before = first.ctrl[drives] + 1e-3 * max(number - 2, 0)
        assert monitor.motion.now.s == pytest.approx(before, abs=1e-12)


def test_robots_that_lower_what_they_bring_are_explained() -> None:
    layout = with_hands("lamp")
    lifts = [r for r in layout.factory.robots if r.type == "lift"]
    assert lifts
    simulation = Simulation(layout, RunRequest(units=1, seed=2, jitter=0.3))
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


# --- planted faults -------------------------------------------------------------------------------


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


def exchanged_grips(m: Any, d: Any) -> None:
    """Grips are aimed at each other's parts."""
    grips = [m.equality(f"grip/r3/part{n}").id for n in (1, 2)]
    m.eq_obj2id[grips] = m.eq_obj2id[grips[::-1]]


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


def locked(m: Any, d: Any) -> None:
    """The joint of r6 is locked."""
    m.dof_frictionloss[m.jnt_dofadr[m.joint("r6/slide").id]] = 1e4


LET_GO = "nothing holds part1#1, which r3 held"


@pytest.mark.parametrize(
    ("fired", "times", "act", "late", "caught"),
    [
        ("sub1_e", 1, welded("grip/r3/part1", False), 0.05, [f"Dropped r3 part1 6: {LET_GO}"]),
        ("sub1_e", 1, displaced("part/part2#1", -0.05, axis=2), 0.05, ["Dropped r3 part2 7"]),
        ("sub1_e", 1, both(reframed("grip/r3/part1", 5e-3)), 0.05, ["Dropped r3 part1 6"]),
        ("sub1_e", 1, exchanged_grips, 0.05, ["Exchanged r3 part1 6", "Exchanged r3 part2 7"]),
        ("part1_e", 2, exchanged_copies, 0.05, ["Exchanged r5 part1 6"]),
        ("part1_e", 1, cut, 1.0, ["Stuck r5 sub1 5", "Stalled r5 sub1 5"]),
        ("part2_e", 1, locked, 0.5, ["Stuck r6 sub1 5"]),
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


@pytest.mark.parametrize(
    ("label", "delay", "robot", "line"),
    [
        ("part1", 0.05, "r5", 6),
        ("sub1", 0.2, "r5", 5),
        ("sub3", 0.1, "r3", 3),
        ("dropoff", 0.1, "r1", 3),
        ("sub2", 0.9, "r4", 4),
    ],
)
def test_an_operation_ended_before_its_goal(
    paper: Layout, label: str, delay: float, robot: str, line: int
) -> None:
    simulation = Simulation(paper, RunRequest(units=2))
    done = hurry(simulation, label, delay)
    _, report = watched(simulation, 4)
    assert_caught(report, "Early", robot, label, line, done[0])


def test_a_weld_ended_on_the_way_to_it(paper: Layout) -> None:
    """The robot does not stop there, and the next operation starts before this one can end."""
    simulation = Simulation(paper, RunRequest(units=1))
    done = hurry(simulation, "sub2", 0.2)
    _, report = watched(simulation, 4)
    assert_caught(report, "Order", "r2", "sub3", 3, done[0])
    assert_caught(report, "Early", "r3", "sub2", 4, done[0], late=1.0)
    assert "since sub2_e must come first" in report.violations[0].message


def test_an_operation_that_does_not_go_on(paper: Layout) -> None:
    simulation = Simulation(paper, RunRequest(units=1))
    number = paper.factory.by_label["sub2"].index
    finished = simulation.supervisor._finished
    simulation.supervisor._finished = lambda: [o for o in finished() if o != number]
    run, report = watched(simulation)
    t = next(e.t for e in run.events if e.transition == "sub2_s")
    assert_caught(report, "Stalled", "r3", "sub2", 4, t, late=0.6)


def test_more_parts_let_in_than_allowed(paper: Layout) -> None:
    """The world lets in what it has; the bound in the monitor's subject is one unit at once."""
    simulation = Simulation(paper, RunRequest(units=2))
    simulation.request = replace(simulation.request, wip=1)
    run, report = watched(simulation)
    t = [e.t for e in run.events if e.transition == "part1_s"][1]
    assert_caught(report, "Order", "r5", "part1", 6, t)
    assert "since dropoff_e must come first" in report.violations[0].message


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


def test_a_feeder_that_presents_while_its_robot_still_works_there() -> None:
    """Found by the monitor: a run from a marking fed a part into the one that was still there."""
    layout = laid_out(UNARY)
    start = legal_marking(layout.factory.net, "r1:a")
    simulation = Simulation(layout, RunRequest(units=2, start=start))
    assert_explained(simulation, *watched(simulation))


# --- logs and the command line --------------------------------------------------------------------


def test_a_log_gives_the_same_verdict(paper: Layout, tmp_path: Path) -> None:
    path = tmp_path / "run.log"
    start = legal_marking(paper.factory.net, "sub1")
    simulation = Simulation(paper, RunRequest(units=2, seed=2, jitter=0.3, wip=2, start=start))
    monitor = beside(simulation)
    with LogWriter(path, simulation) as writer:
        simulation.run([writer.observe, monitor.observe])
    live, (recorded, subject) = monitor.report(), watch_log(read_log(path))
    assert recorded.refines_net
    assert (recorded.seen, recorded.inferred) == (live.seen, live.inferred)
    assert subject.factory.net == paper.factory.net and subject.wip == 2


def test_a_log_stands_by_itself(tmp_path: Path, run: Terminal) -> None:
    """The PAG, the templates and the meshes that a run was made of may all be gone."""
    (tmp_path / "rivet.op").write_text(
        """rivet = (R, j, ~, <a; b>, F) where R = < dot, tool >; j = 1; ~ = { S1 = A2 };
        <a; b> = < LAB1, nopart; LAB2, nopart >;
        F = navigation on W to ( S1 + 2r, A2 + 2r ) within eps for dwell;
        parameters = ( dwell = 0.8 );"""
    )
    pag = tmp_path / "p.pag"
    pag.write_text(
        "root = c; c = rivet ( b, dwell = 0.3 ); b = mate ( x, y );\nx = atomic (); y = atomic ()"
    )
    log = tmp_path / "run.log"
    assert run("run", pag, "--templates", tmp_path, "--log", log, "--units", 2).status == 0
    for path in tmp_path.iterdir():
        if path != log:
            path.unlink()
    document = run("monitor", log, "--json").json
    assert document["refines_net"] and document["product"] == "c"
    assert len(document["firings_seen"]) + len(document["firings_inferred"]) == 2 * 10


def test_a_text_without_a_file_is_kept_in_the_log(tmp_path: Path) -> None:
    templates = all_templates()
    plan = factory.compile(read_pag(PRODUCTS["kary"], templates))
    with LogWriter(tmp_path / "log", simulation := Simulation(factory.lay_out(plan))) as writer:
        simulation.run([writer.observe])
    assert watch_log(read_log(tmp_path / "log"))[0].refines_net


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


def test_run_with_a_monitor(run: Terminal) -> None:
    document = run("run", PAPER, "--units", 1, "--monitor", "--json").json
    assert document["refines_net"] and document["monitor"]["refines_net"]
    assert document["monitor"]["violations"] == []
    found = document["monitor"]["firings_seen"] + document["monitor"]["firings_inferred"]
    assert len(found) == document["transitions_fired"]
    assert document["monitor_time_s"] > 0
    spent = document["physics_time_s"] + document["supervisor_time_s"]
    assert spent == pytest.approx(document["wall_time_s"])
    assert "consistent with the net" in run("run", PAPER, "--monitor").out
    refused = run("run", PAPER, "--world", "ideal", "--monitor", "--json")
    assert refused.status == 2 and refused.codes == ["Usage"]


def test_a_faulty_run_fails(run: Terminal, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two parts are never let go: status 1, beside the run and from its log."""
    from factory.engine.simulation.mujoco.welds import Welds

    release = Welds.open

    def sticky(self: Welds, off: Iterable[int]) -> None:
        release(self, [n for n in off if self._m.equality(n).name != "grip/r5/part1"])

    monkeypatch.setattr(Welds, "open", sticky)
    log = tmp_path / "log"
    done = run("run", PAPER, "--monitor", "--max-time", 1, "--json", "--log", log)
    assert done.status == 1 and not done.json["refines_net"]
    violation = done.json["monitor"]["violations"][0]
    assert violation["code"] == "TwoHolders" and violation["robot"] == "r5"
    assert violation["label"] == "part1" and violation["line"] == 6
    assert violation["file"] == str(PAPER)
    assert "TwoHolders" in done.err and "part1 = atomic()" in done.err
    again = run("monitor", log, "--json")
    assert again.status == 1
    assert again.json["violations"] == done.json["monitor"]["violations"]
    assert "VIOLATIONS" in run("monitor", log).out


def test_a_robot_seen_to_leave_first_as_operations_end_has_not_left_before() -> None:
    """Within a tick of another look its setpoint is not counted: that it stood is all that is
    known, however long it is that it came."""
    every = np.arange(1)
    bent = SimpleNamespace(robots=())
    anatomy = SimpleNamespace(slide=every, dof=every, drive=every, bent=bent)

    def seen(time: float, at: float, at_end: bool = True) -> Observation:
        return Observation(
            time, np.array([at]), np.zeros(1), np.array([at]), np.empty((0, 3), np.intp), at_end
        )

    motion = AxisMotion(anatomy, Settings(), np.full(1, 1e-4), seen(0.0, 0.2, False))  # type: ignore[arg-type]
    for time in (0.01, 0.02, 0.03):
        left, _, _ = motion.look(seen(time, 0.2))
        assert not len(left)
    motion.look(seen(0.035, 0.19))
    left, _, _ = motion.look(seen(0.045, 0.18))
    assert left.tolist() == [0] and motion.begun(0) == 0.045
    motion.leave(0, 0.1)
    left, _, _ = motion.look(seen(0.5, 0.1, False))
    motion.stand(0, 0.1)
    motion.look(seen(0.6, 0.1, False))
    left, _, _ = motion.look(seen(0.7, 0.05, False))
    assert left.tolist() == [0] and motion.begun(0) == 0.7


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
