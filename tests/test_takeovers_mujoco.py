"""A deputy takes over in the engine: the dead robot is lifted out, its parts come from the deputy's
feeder, and the monitor judges what follows with the crew of then."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest

from benches.faults.takeovers import PAPER as INSERTS
from benches.faults.takeovers import interval_after
from factory.commands.run import summarise
from factory.compiler.taking_over import crew_with
from factory.control.mode import Limits
from factory.exporting import Subject, exporters
from factory.exporting.motion import motion_of
from factory.layout import standby
from factory.layout.bins import bins_of
from factory.layout.exclusions import goes_early
from factory.layout.feeding import feeder_of, lines_of, outlets_of
from factory.layout.layout import Layout
from factory.layout.request import Ground
from factory.layout.standby import deputies_in, part_of
from factory.mjcf import names
from factory.mjcf.masks import feeder_codes
from factory.pipeline import read
from factory.record.log import LogWriter, read_log
from factory.record.monitor.record import watch_log
from factory.record.monitor.subject import MonitorSubject, subject_of
from factory.record.state import State
from factory.show.report.pace import measured
from factory.show.report.recording import recording_of
from factory.simulation.modelling import physical_model
from factory.simulation.mujoco.feeders import Feeders
from factory.simulation.recovery import Campaign, Recovery, WorldFault, deputising, recover
from factory.simulation.request import RunRequest
from factory.simulation.run import Run
from factory.simulation.simulation import Simulation
from factory.support.engine import mujoco
from factory.support.settings import Settings
from factory.timing.timed import timed
from factory.timing.timing import Timing
from tests.command_line import ROOT, Terminal
from tests.layout_values import with_visits

STEPS = """root = s2; s1 = insert ( base, a ); s2 = insert ( s1, b );
base = atomic ( box = ( 0.16, 0.1, 0.02 ), pos = ( 0, 0, 0.01 ) );
a = atomic ( box = ( 0.03, 0.03, 0.02 ), pos = ( -0.04, 0, 0.03 ) );
b = atomic ( box = ( 0.03, 0.03, 0.03 ), pos = ( 0.04, 0, 0.035 ) )"""
"""Two robots with lifts put parts of two heights onto a base; each can do the other's."""

DEATH = '[[fault]]\nkind = "dead"\nrobot = "r4"\nat = 7\n'


@cache
def laid_out(text: str, with_deputies: bool = True) -> Layout:
    """The layout of a product."""
    with TemporaryDirectory() as folder:
        file = Path(folder) / "product.pag"
        file.write_text(text)
        return read(file, ground=Ground(deputies=with_deputies)).layout


def simulated(
    text: str, robot: str, at: float, more: tuple[WorldFault, ...] = (), **asked: Any
) -> tuple[Simulation, Recovery]:
    """A run in which a robot dies and no spare is there."""
    simulation = Simulation(laid_out(text), RunRequest("mujoco", 10, recovers=True, **asked))
    faults = (WorldFault("dead", robot=robot, at=at), *more)
    return simulation, recover(simulation, Campaign(faults, swap=4.0))


def figures(run: Run) -> tuple[int, int, float]:
    """Onsets of contact, products, and the largest residual of a weld [mm]."""
    assert run.physics is not None
    return run.physics.unintended_contacts, run.products, run.physics.weld_residual_max_mm


# --- runs -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(("dead", "deputy", "fuse"), [("r2", "r4", False), ("r4", "r2", True)])
def test_all_units_are_made(dead: str, deputy: str, fuse: bool) -> None:
    """At the pace that is predicted for N', and nothing touches."""
    simulation, _ = simulated(INSERTS, dead, 7.0, fuse=fuse)
    run = simulation.run(max_time=150.0)
    assert (run.products, run.trouble, run.refines_net) == (10, None, True)
    (change,) = run.exchanges
    assert (change.dead, change.deputy) == (dead, deputy)
    assert interval_after(run) == pytest.approx(change.cycle_time, rel=0.03)
    contacts, _, residual = figures(run)
    assert not contacts and residual < 0.1
    assert run.physics is not None and (run.physics.product_error_max_mm or 0.0) < 0.1


@pytest.mark.parametrize("dead", ["r2", "r3"])
def test_parts_of_two_heights(dead: str) -> None:
    """The deputy's lift rises by the same stroke on both tours, from the beginning."""
    layout = laid_out(STEPS)
    assert layout.factory.strokes == {1: 0.04, 2: 0.02} and deputies_in(layout) == {1: 2, 2: 1}
    assert {v.up for (_, robot), v in layout.visits.items() if robot in (1, 2)} == {0.04, 0.041}
    run = simulated(STEPS, dead, 5.0)[0].run(max_time=150.0)
    contacts, products, residual = figures(run)
    assert (contacts, products, len(run.exchanges)) == (0, 10, 1) and residual < 0.1


def test_each_axis_keeps_its_limits(monkeypatch: pytest.MonkeyPatch) -> None:
    """Robots differ, and their lifts with them; those that stay have limits of their own."""
    seen = list[tuple[Layout, Limits]]()

    def look(timing: Timing, **given: Any) -> Any:
        seen.append((timing.layout, timing.limits))
        return timed(timing, **given)

    monkeypatch.setattr(deputising, "timed", look)
    simulation, _ = simulated(STEPS, "r2", 5.0, jitter=0.3)
    before = speeds(simulation.layout, simulation.limits)
    simulation.run(max_time=60.0)
    ((crew, limits),) = seen
    assert speeds(crew, limits) == before
    assert len(before) == 5 and before["lift of r2"] != before["lift of r3"]


def speeds(layout: Layout, limits: Limits) -> dict[str, float]:
    """How fast each axis can be [m/s], by its robot."""
    robots = [robot.name for robot in layout.factory.robots]
    axes = [*robots, *(f"lift of {robots[robot]}" for robot in layout.strokes)]
    return dict(zip(axes, np.asarray(limits.speed).tolist(), strict=True))


def test_other_faults_go_on() -> None:
    """What is dropped before and after is made again; what is dropped just before a deputy takes
    over first: it waits for all that are on their way back. What has slipped in its hand is joined
    again, and kept."""
    more = tuple(WorldFault("drop", label="part2", unit=unit) for unit in (1, 9))
    slip = WorldFault("bad_joint", label="sub1", unit=7, metres=3e-3)
    simulation, recovery = simulated(INSERTS, "r4", 7.0, (*more, slip))
    respond, late = recovery.responding, list[float]()

    def lose(state: State) -> None:
        if not late and any(until < state.time + 0.25 for until in respond.dead.values()):
            late.extend([state.time] * recovery.plant.lose(0))

    run = simulation.run([lose], max_time=300.0)
    assert (run.products, run.trouble, run.refines_net) == (10, None, True)
    assert figures(run)[0] == 0
    (change,) = run.exchanges
    assert change.t > late[0] + 1.0
    told = [(one.test, one.t > change.t) for one in recovery.found]
    before = [("lost", False), ("jammed", False), ("lost", False)]
    assert told == [*before, ("residual", True), ("lost", True)]


def test_inputs_that_a_deputy_joins_may_touch() -> None:
    """Each other, and its pad what it now holds."""
    simulation, recovery = simulated(INSERTS, "r4", 7.0)
    made = laid_out(INSERTS).factory.by_label["sub1"]
    found = list[bool]()

    def touch(_: State) -> None:
        world, supervisor = simulation.physical, simulation.supervisor
        holdings, m, d = world.parts.holdings, world.m, world.d
        if not recovery.exchanges or found or made.index not in supervisor.active.operations:
            return
        inputs = holdings.hand(0)["part1"], holdings.hand(1)["part2"]
        a, b = (m.jnt_qposadr[m.body_jntadr[body]] for body in inputs)
        place = d.qpos[b : b + 3].copy()
        d.qpos[b : b + 3] = d.qpos[a : a + 3]
        mujoco.mj_forward(m, d)
        world.inspection.contacts()
        d.qpos[b : b + 3] = place
        mujoco.mj_forward(m, d)
        pad, part = m.geom("r2/pad").id, int(m.body_geomadr[inputs[1]])
        found.append(world.inspection.pressing.meant(pad, part, 0.0))

    run = simulation.run([touch], max_time=40.0)
    assert found == [True] and run.physics is not None
    assert not run.physics.unintended_contacts and {*run.physics.mating_forces} == {"sub1"}


# --- the model ------------------------------------------------------------------------------------


def test_the_model_has_what_deputies_need() -> None:
    """For each part a weld more in the feeder of its deputy, and one in its hand; and no more than
    that without deputies."""
    layout = laid_out(INSERTS)
    outlets = outlets_of(layout)
    assert [outlet.name for outlet in outlets] == [
        "part1",
        "part2",
        "part3",
        "part3@r4",
        "part2@r2",
    ]
    assert [names.shown(outlet.name) for outlet in outlets] == [o.label for o in outlets]
    assert [len(line) for line in lines_of(layout)] == [1, 2, 0, 2]
    for line in lines_of(layout):
        assert len({outlet.feeder.housing for outlet in line}) <= 1
    xml = physical_model(layout, 3).xml
    plain = physical_model(laid_out(INSERTS, False), 3).xml
    for found in ("feed/part2@r2", "feed/part3@r4", "grip/r2/part2", "grip/r4/part3"):
        assert f'name="{found}"' in xml and f'name="{found}"' not in plain
    made = {layout.named(o.label) for o in layout.whole.factory.making}
    assert made | {"dropoff"} == {*layout.factory.by_label}
    assert {label for one in bins_of(layout) for label in one.labels} <= made


def test_a_crew_has_the_tours_that_are_left() -> None:
    """What is left when a robot is gone is a part of the same whole, with its feeders."""
    layout = laid_out(INSERTS)
    crew = part_of(layout, crew_with(layout.factory, 1, 3))
    assert crew is not None and crew.whole is layout.whole
    assert [*map(crew.magazine, range(4))] == [("part1",), (), (), ("part2", "part3")]
    assert feeder_of(crew, "part2") == feeder_of(layout, "part2")


def test_a_monitor_knows_who_goes_ahead() -> None:
    """By the numbers that robots have in the crew that stays."""
    layout = laid_out(STEPS)
    left = crew_with(layout.factory, 1, 2)
    crew = part_of(layout, left)
    assert crew is not None
    early = {(operation, (0, 2).index(robot)) for operation, robot in goes_early(crew)}
    assert early and early <= subject_of(layout, Settings()).after(left).early


# --- planted faults -------------------------------------------------------------------------------


def test_levels_of_the_first_factory_do_not_fit_the_deputy(monkeypatch: pytest.MonkeyPatch) -> None:
    """Planted: each factory has the levels that its own tours ask for."""
    found = standby.part_of

    def with_own(*args: Any) -> Layout | None:
        part = found(*args)
        return part and with_visits(part)

    monkeypatch.setattr(deputising, "part_of", with_own)
    layout = replace(with_visits(laid_out(STEPS)), certificate=laid_out(STEPS).certificate)
    simulation = Simulation(layout, RunRequest("mujoco", 10, recovers=True))
    recover(simulation, Campaign((WorldFault("dead", robot="r2", at=5.0),), swap=4.0))
    assert figures(simulation.run(max_time=150.0))[2] > 1.0, "a weld pulls its part into place"


def test_a_robot_that_dies_where_it_went_ahead() -> None:
    """No operation waits for it that is under way: it is late all the same, lifted out from where
    its hand is down in the station, and can touch nothing from then on."""
    simulation = Simulation(laid_out(STEPS), RunRequest("mujoco", 6, recovers=True))
    recovery = recover(simulation, Campaign(swap=4.0))

    def strike(_: State) -> None:
        world = simulation.physical
        if not recovery.found and world.parts.holdings.hand(2) and world.sense()[0][4] < 0.01:
            recovery.strike(WorldFault("dead", robot="r3", at=0.0))

    run = simulation.run([strike], max_time=60.0)
    assert (figures(run)[:2], run.trouble, len(run.exchanges)) == ((0, 6), None, 1)
    assert [(one.robot, one.response) for one in recovery.found] == [("r3", "deputy")]
    m = simulation.physical.m
    owner = [m.body(body).name.partition("/")[0] for body in m.geom_bodyid]
    touching = {name for name, type_ in zip(owner, m.geom_contype, strict=True) if type_}
    assert "r3" in owner and "r3" not in touching and {"r1", "r2"} <= touching


def test_what_a_dead_robots_feeder_shows_goes_back(monkeypatch: pytest.MonkeyPatch) -> None:
    """Planted: it does not, and hangs there for good."""
    layout = laid_out(STEPS)
    feeder = feeder_codes(layout.factory, outlets_of(layout))[2]
    for goes_back in (True, False):
        if not goes_back:
            monkeypatch.setattr(Feeders, "elsewhere", lambda feeders, layout: [])
        simulation = simulated(STEPS, "r3", 5.0)[0]
        run, holdings = simulation.run(max_time=60.0), simulation.physical.parts.holdings
        assert (len(run.exchanges), not holdings.held(feeder)) == (1, goes_back)


def test_what_a_robot_that_is_gone_stood_under_goes_back() -> None:
    """It is in nobody's way any more."""
    layout = laid_out(INSERTS)
    simulation = Simulation(layout, RunRequest("mujoco", 4, recovers=True))
    recovery = recover(simulation, Campaign(swap=4.0))
    length, standing = layout.guidepaths[3].length, recovery.striking.standing

    def stop(_: State) -> None:
        world = simulation.physical
        is_there = "part2" in world.parts.feeders.shown() and world.sense()[0][3] > length - 0.07
        is_new = world.time > 3.0 and not recovery.found
        if is_new and is_there and not world.parts.holdings.hand(3):
            standing[3] = 1e6

    run = simulation.run([stop], max_time=60.0)
    assert figures(run)[:2] == (0, 4) and len(run.exchanges) == 1
    assert not simulation.world.parts.feeders.back.numbers


def test_a_part_that_comes_late_waits_for_its_robot(monkeypatch: pytest.MonkeyPatch) -> None:
    """The last product is lost when feeders have nothing to show any more, and a robot whose hand
    holds from above has gone where its next part would come down: it makes way. Planted: it does
    not."""
    layout = read(ROOT / "examples" / "truck.pag").layout
    robot = layout.factory.by_label["roof"].carrier
    lift = len(layout.guidepaths) + [*layout.strokes].index(robot)
    for is_kept in (True, False):
        if not is_kept:
            monkeypatch.setattr(Feeders, "_obstructed", lambda feeders: [])
        simulation = Simulation(layout, RunRequest("mujoco", 1, recovers=True))
        recovery = recover(simulation, Campaign())

        def lose(_: State, made: Simulation = simulation, by: Recovery = recovery) -> None:
            if not by.found and made.supervisor.fired[layout.factory.dropoff.start] == 1:
                made.physical.motion.put({robot: 0.144, lift: layout.strokes[robot]})
                by.plant.lose(0)

        run = simulation.run([lose], max_time=120.0)
        assert run.products == 1 and {one.test for one in recovery.found} == {"lost"}
        assert (figures(run)[0] == 0) == is_kept


def test_what_the_crew_that_stays_cannot_carry_back(monkeypatch: pytest.MonkeyPatch) -> None:
    """Falls where the deputy is as it takes over. Planted: that is all that robots ever bring."""

    def every(crew: Layout) -> frozenset[tuple[int, str]]:
        robots = range(len(crew.factory.robots))
        return frozenset((robot, label) for robot in robots for label in ("part2", "part3"))

    for binned in (1, 0):
        if not binned:
            monkeypatch.setattr(deputising, "not_carried_back", every)
        simulation = Simulation(laid_out(INSERTS), RunRequest("mujoco", 3, recovers=True))
        recovery = recover(
            simulation, Campaign((WorldFault("dead", robot="r2", at=5.0),), swap=4.0)
        )
        run = simulation.run(max_time=60.0)
        assert figures(run)[:2] == (0, 3) and len(run.exchanges) == 1
        assert recovery.plant.binned == binned


# --- the command and the monitor ------------------------------------------------------------------


def test_end_to_end(run: Terminal, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The run succeeds, and so says the monitor of its log, which knows where the deputy goes.
    Planted: it does not."""
    pag, faults, log = (tmp_path / name for name in ("inserts.pag", "faults.toml", "run.log"))
    pag.write_text(INSERTS)
    faults.write_text(DEATH)
    words = ("run", pag, "--units", 8, "--faults", faults, "--swap", 4, "--deputies")
    done = run(*words, "--log", log, "--json")
    assert done.status == 0, done.err
    (change,) = done.json["exchanges"]
    assert (change["dead"], change["deputy"]) == ("r4", "r2")
    assert done.json["unintended_contacts"] == 0
    judged = run("monitor", log)
    assert judged.status == 0 and "consistent with the net" in judged.out
    report, subject = watch_log(read_log(log))
    assert not report.violations and {robots for _, robots in subject.others} >= {(3,), (1,)}
    later = [one for one in report.seen if one.seen and one.seen > change["t"]]
    assert {one.transition for one in later} >= {"part2_e", "part3_e", "sub1_e", "sub3_e"}
    after = MonitorSubject.after

    def strange(subject: MonitorSubject, crew: Any) -> MonitorSubject:
        return after(replace(subject, others={}), crew)

    monkeypatch.setattr(MonitorSubject, "after", strange)
    assert watch_log(read_log(log))[0].violations


# --- what is shown of it --------------------------------------------------------------------------


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[Run, Path]:
    """A run in which r2 takes over for r4, and its log."""
    path = tmp_path_factory.mktemp("taken_over") / "run.log"
    simulation = Simulation(laid_out(INSERTS), RunRequest("mujoco", 5, recovers=True))
    recover(simulation, Campaign((WorldFault("dead", robot="r4", at=5.0),), swap=4.0))
    with LogWriter(path, simulation) as log:
        return simulation.run([log.observe]), path


def test_the_report_counts_work_for_the_robot_that_did_it(recorded: tuple[Run, Path]) -> None:
    run, path = recorded
    busy = measured(recording_of(path, laid_out(INSERTS))).busy
    assert busy == pytest.approx(run.utilisation, abs=1e-6)
    r2, r4 = busy[1], busy[3]
    assert r4 * run.sim_time_s < run.exchanges[0].t and r2 > 2 * r4


def test_the_prediction_is_said_to_be_that_with_all_robots(
    recorded: tuple[Run, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    run, _ = recorded
    for record, count in ((run, 1), (replace(run, exchanges=()), 0)):
        summarise(record, laid_out(INSERTS).factory, False)
        assert "".join(capsys.readouterr()).count(" s with all robots; ") == count


def test_exports_of_motion_leave_out_the_robot_that_is_gone(recorded: tuple[Run, Path]) -> None:
    run, path = recorded
    log, t = read_log(path), run.exchanges[0].t
    motion = motion_of(log)
    unseen, late = motion.unseen(), log.time[motion.rows] >= t
    theirs = [body for body in range(motion.m.nbody) if motion.name(body).startswith("r4/")]
    assert len(theirs) > 1 and motion.m.body(names.carriage("r4")).id in theirs
    assert (late == unseen[:, theirs].T).all() and late.any() and not late.all()
    assert not unseen[:, motion.m.body(names.carriage("r2")).id].any()


def test_usd_leaves_out_the_robot_that_is_gone(recorded: tuple[Run, Path], tmp_path: Path) -> None:
    pytest.importorskip("pxr", reason="the extra `usd` is not installed")
    from pxr import Usd, UsdGeom

    run, path = recorded
    log = read_log(path)
    files = exporters()["usd"].export(Subject(path, log, name="x.usd"))
    assert isinstance(files, Mapping)
    (tmp_path / "x.usd").write_bytes(files[""])
    stage = Usd.Stage.Open(str(tmp_path / "x.usd"))
    motion = motion_of(log)
    times = log.time[motion.rows]
    drawn = {prim.GetName(): prim for prim in stage.Traverse()}
    for robot, goes in (("r4", True), ("r2", False)):
        geom = motion.m.geom(names.carriage(robot)).id
        prim = UsdGeom.Imageable(drawn[f"Mesh_Xform_{robot}_carriage_id{geom}_geom"])
        for frame in range(0, len(times), 7):
            seen = prim.ComputeVisibility(frame) != "invisible"
            assert seen == (not goes or times[frame] < run.exchanges[0].t), (robot, times[frame])
