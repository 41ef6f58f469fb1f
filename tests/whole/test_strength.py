"""The strength of hands: what their loads use of it is measured, agrees with what was predicted,
and where it is too little the part falls and the run ends by that name."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import factory
from factory.apps.deviations import Deviation, deviate
from factory.apps.live import Session
from factory.apps.live.commands import Command
from factory.apps.log import read_log
from factory.apps.monitor.record import verdict_on, watch_log
from factory.apps.runs.watched import watched
from factory.engine.mjcf import names
from factory.engine.record.state import State
from factory.engine.simulation.mujoco import strength
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.run import Run
from factory.engine.simulation.simulation import Simulation
from factory.engine.simulation.world import FALL
from factory.floor.geometry.product import product_geometry
from factory.floor.layout.embedding import lay_out
from factory.floor.layout.hands import gauges
from factory.floor.layout.hands.gauges import gauge, middle
from factory.floor.layout.hands.holding import Holding, held
from factory.floor.layout.hands.places import GRAVITY, PUSH, SURGE, centre_of
from factory.floor.layout.hands.tips import Tip, TipName, shares, tip
from factory.floor.layout.layout import Layout
from factory.floor.layout.request import Ground
from factory.support.engine import mujoco
from factory.support.settings import Settings
from factory.theory.control.mode import Limits
from tests.command_line import Terminal
from tests.live_sessions import Stopped
from tests.paths import ROOT

EXAMPLES = ROOT / "examples"


@cache
def with_hands(name: str) -> Layout:
    """An example laid out with hands."""
    plan = factory.compile(factory.load_pag(EXAMPLES / f"{name}.pag"))
    return Ground().lay_out(plan, product_geometry(plan.pag), Settings())


def ready(name: str | Layout, **more: Any) -> Simulation:
    """A simulation of an example."""
    layout = with_hands(name) if isinstance(name, str) else name
    return Simulation(layout, RunRequest(**{"units": 2, "seed": 1, "jitter": 0.3, **more}))


def moved(layout: Layout, robot: int, axis: int, by: float) -> Layout:
    """A layout whose robot (index) has its hand elsewhere."""
    hand = layout.hands[robot]
    assert hand is not None
    place = np.array(hand.places) + by * np.eye(3)[axis]
    off = replace(hand, places=tuple((float(x), float(y), float(z)) for x, y, z in place))
    return replace(layout, hands=(*layout.hands[:robot], off, *layout.hands[robot + 1 :]))


def weaken(monkeypatch: pytest.MonkeyPatch, factor: float) -> None:
    """Tips pull less than the catalogue said as hands were chosen."""

    def weak(name: TipName) -> Tip:
        return replace(tip(name), pull=factor * tip(name).pull)

    monkeypatch.setattr(gauges, "tip", weak)


# --- what a load is -------------------------------------------------------------------------------

SCENE = """<mujoco><option timestep="0.002" gravity="0 0 -9.81"/><worldbody>
  <body name="hand"><joint type="slide" axis="1 0 0" armature="100"/>
    <geom type="sphere" size="0.01" mass="1" contype="0" conaffinity="0"/></body>
  <body name="part" pos="0.1 0.05 0.2"><freejoint/>
    <geom type="box" size="0.03 0.02 0.01" mass="0.7" contype="0" conaffinity="0"/></body>
  </worldbody><equality><weld body1="hand" body2="part" relpose="0.1 0.05 0.2 1 0 0 0"/></equality>
</mujoco>"""


def test_the_rows_of_a_weld_are_the_load_on_its_holder() -> None:
    """Of place: m (g - a). Of turn: half of what would turn the part, here by a couple."""
    m: Any = mujoco.MjModel.from_xml_string(SCENE)
    d = mujoco.MjData(m)
    part = m.body("part").id
    couple = np.array([0.1, -0.2, 0.3])
    d.xfrc_applied[part, 3:] = couple
    d.qfrc_applied[0] = 3.0 * (101 + 0.7)
    for _ in range(400):
        mujoco.mj_step(m, d)
    assert d.qacc[0] == pytest.approx(3.0, rel=1e-3)
    load = d.efc_force[:6] * [1, 1, 1, 0.5, 0.5, 0.5]
    np.testing.assert_allclose(load[:3], 0.7 * np.array([-3.0, 0.0, -GRAVITY]), atol=0.01)
    np.testing.assert_allclose(load[3:], couple, atol=0.001)
    exact, pull = np.zeros(m.nv), np.zeros(d.nefc)
    pull[:6] = d.efc_force[:6]
    mujoco.mj_mulJacTVec(m, d, exact, pull)
    np.testing.assert_allclose(load, -exact[1:7], atol=1e-3 * np.abs(load).max())


@pytest.mark.parametrize("name", ["paper", "lamp", "stool"])
def test_a_hand_at_rest_bears_the_weight_of_what_it_holds(name: str) -> None:
    """About the middle of its tips, whatever bodies it is made of."""
    simulation, loads = ready(name), 0
    world, layout = simulation.physical, simulation.layout
    used, solids = world.parts.strength, layout.product.solids
    for _ in range(600):
        simulation.supervisor.step()
        if (np.abs(world.d.qvel) > 1e-5).any():
            continue
        grips = used._grip[world.d.efc_id[: world.d.ne : 6]]
        terms = used._gauges[grips] @ world.d.efc_force[: world.d.ne].reshape(-1, 6, 1)
        for number, robot in enumerate(used._robots.tolist()):
            mine, hand = used._hand[grips] == number, layout.hands[robot]
            bodies = {used._grips[grip][0][1] for grip in grips[mine].tolist()}
            parts = [solids[p] for body in bodies for p in world.model.carried.parts(body)]
            if not parts or hand is None:
                continue
            weights = np.array([[0, 0, -part.mass * GRAVITY] for part in parts])
            arms = np.array([part.centre for part in parts]) - middle(hand)
            load = np.concatenate([weights.sum(axis=0), np.cross(arms, weights).sum(axis=0)])
            expected = gauge(hand, layout.guidepaths[robot].heading) @ load
            least = 0.01 * np.abs(expected).max()
            np.testing.assert_allclose(terms[mine][:, :, 0].sum(axis=0), expected, atol=least)
            loads += 1
    assert loads


@pytest.mark.parametrize(
    ("force", "moment", "apart", "most"),
    [
        ((0, 0, -10.0), (0, 0, 0), (0, 0, 0), -10.0),
        ((0, 0, 10.0), (0, 0, 0), (0, 0, 0), 10.0),
        ((3.0, 4.0, 0), (0, 0, 0), (0, 0, 0), 5.0 / 0.5),
        ((0, 0, 0), (0, 0, 0.01), (0, 0, 0), 1.5 * 0.01 / 0.01 / 0.5),
        ((0, 0, 0), (0.01, 0, 0), (0, 0, 0), 2 * 0.01 / 0.01),
        ((0, 0, 10.0), (0, 0, 0), (0.1, 0, 0), 5.0),
        ((0, 0, 0), (0.01, 0, 0), (0.1, 0, 0), 0.01 / 0.01),
        ((0, 0, 0), (0, 0.01, 0), (0.1, 0, 0), 0.01 / 0.1),
        ((0, 0, 0), (0, 0, 0.01), (0.1, 0, 0), 0.01 / 0.1 / 0.5),
    ],
)
def test_what_a_tip_bears(force: Any, moment: Any, apart: Any, most: float) -> None:
    """Newtons of what presses it on: pulled off, beside, turned, bent; two on a line likewise."""
    pad, up = Tip("suction", 5e4, 0.5), np.array([0.0, 0.0, 1.0])
    terms = pad.gauge(up, np.array(0.01), np.array(apart, float)) @ [*force, *moment]
    assert shares(terms) * 5e4 * np.pi * 1e-4 == pytest.approx(most)
    found = pad.used(up, np.array(0.01), np.array(apart, float), np.array(force), np.array(moment))
    assert found * 5e4 * np.pi * 1e-4 == pytest.approx(max(0.0, most))


# --- honest runs ----------------------------------------------------------------------------------

LARGE = [pytest.param(name, marks=pytest.mark.slow) for name in ("truck", "chair", "gearbox")]


@pytest.mark.parametrize("name", ["paper", "lamp", "stool", *LARGE])
def test_hands_bear_what_was_predicted(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Less where a load is pushed only to some sides; hands are strong enough."""
    simulation, most = ready(name, units=3), dict[int, float]()
    robots = simulation.physical.parts.strength._robots.tolist()

    def measured(terms: Any) -> Any:
        found = shares(terms)
        for robot, share in zip(robots, found.tolist(), strict=True):
            most[robot] = max(most.get(robot, 0.0), share)
        return found

    monkeypatch.setattr(strength, "shares", measured)
    run = watched(simulation)
    assert run.succeeded, run.verdict.failures
    figures = run.physics
    assert figures is not None and figures.grip_strength_share_max is not None
    assert figures.grip_strength_share_max == max(most.values()) < 1
    hands = {int(robot): simulation.layout.hands[robot] for robot in robots}
    assert figures.grip_strength_robot == f"r{max(most, key=most.__getitem__) + 1}"
    for robot, hand in hands.items():
        assert hand is not None
        assert most[robot] <= hand.share + 1e-3, robot
        assert most[robot] >= 0.45 * hand.share, robot


@pytest.mark.parametrize("name", ["paper", "stool"])
def test_robots_accelerate_no_more_than_their_hands_are_chosen_for(name: str) -> None:
    """Drives fall behind their references, and make up for it."""
    simulation = ready(name)
    world, most = simulation.physical, 0.0
    robots = world.motion.axes.dof[: len(simulation.layout.factory.robots)]

    def look() -> None:
        nonlocal most
        most = max(most, float(np.abs(world.d.qacc[robots]).max()))

    world.hooks.before_step.append(look)
    assert simulation.run().products == 2
    assert 1.01 * PUSH < most < SURGE * PUSH


def test_without_hands_there_is_nothing_to_measure() -> None:
    plan = factory.compile(factory.load_pag(EXAMPLES / "paper.pag"))
    figures = watched(ready(lay_out(plan, product_geometry(plan.pag)), units=1)).physics
    assert figures is not None and figures.grip_strength_share_max is None
    assert figures.grip_strength_robot is None and figures.grip_strength_label is None


def test_a_distributed_run_is_measured_too() -> None:
    run = watched(ready("paper", distributed=True))
    assert run.succeeded and run.physics is not None
    assert run.physics.grip_strength_share_max == pytest.approx(0.306, rel=0.05)


def test_hands_are_chosen_for_all_that_they_ever_hold() -> None:
    """A robot holds what it takes first, and in the end all that was joined to it."""
    layout, grown = with_hands("lamp"), 0
    made, product = layout.factory, layout.product
    holding = Holding(made, product)
    for robot in range(len(made.robots)):
        first, last = (held(made, robot, at_last) for at_last in (False, True))
        if first:
            loads = holding.loads(first)
            for number, label in ((0, first), (-1, last)):
                mass, centre = centre_of(product, made.contents[label])
                assert loads.mass[number] == mass and (loads.centre[number] == centre).all()
            grown += loads.mass[-1] > loads.mass[0]
    assert grown
    assert Holding(made, product, 6.0).loads(first or "post").push == 6.0


# --- planted faults -------------------------------------------------------------------------------


def lighter(simulation: Simulation) -> Simulation:
    """Robots gain speed three times as fast as hands were chosen for."""
    limits = simulation.limits
    simulation.limit(Limits(limits.speed, 3 * limits.acceleration))
    return simulation


def dropped(run: Run, robot: str, label: str) -> None:
    """A robot has dropped something, and that has ended the run."""
    assert run.trouble is not None and run.trouble.code == "Dropped"
    assert run.trouble.message.startswith(f"{robot} drops '{label}' at ")
    assert run.trouble.position is not None
    figures = run.physics
    assert figures is not None and (figures.grip_strength_share_max or 0) > 1
    assert not run.succeeded and not replace(run, lenient=True).succeeded
    assert run.monitor is not None and run.replays
    seen = [v for v in run.monitor.violations if v.code == "Dropped"]
    assert robot in {violation.robot for violation in seen}
    assert max((event.t for event in run.events), default=0.0) <= run.sim_time_s - FALL + 0.011


@pytest.mark.parametrize("more", [{}, {"fast": False}, {"distributed": True}], ids=str)
def test_a_tip_of_a_tenth_of_its_pull(monkeypatch: pytest.MonkeyPatch, more: Any) -> None:
    weaken(monkeypatch, 0.1)
    dropped(watched(ready("paper", **more)), "r3", "sub1")


@pytest.mark.parametrize(
    ("name", "robot", "label"), [("lamp", "r3", "shade"), ("stool", "r4", "legs/2")]
)
def test_a_payload_twice_as_heavy(name: str, robot: str, label: str) -> None:
    dropped(watched(deviate(ready(name), Deviation("mass", factor=2.0))), robot, label)


@pytest.mark.parametrize(
    ("name", "robot", "label"), [("shelf", "r8", "board1"), ("stool", "r7", "leg2")]
)
def test_robots_with_thrice_the_acceleration(name: str, robot: str, label: str) -> None:
    dropped(watched(lighter(ready(name))), robot, label)


@pytest.mark.parametrize(
    ("name", "robot", "axis", "label"),
    [("lamp", 5, 1, "holder"), ("stool", 3, 1, "legs")],
)
def test_a_hand_that_is_50_mm_off(name: str, robot: int, axis: int, label: str) -> None:
    off = moved(with_hands(name), robot, axis, 0.05)
    dropped(watched(ready(off)), f"r{robot + 1}", label)


def test_what_is_dropped_falls_and_nothing_fires_any_more() -> None:
    simulation = ready(moved(with_hands("lamp"), 5, 1, 0.05))
    world, seen = simulation.physical, list[tuple[float, float, int]]()
    body = world.m.body(names.part("holder", 1)).id

    def look(state: State) -> None:
        seen.append((state.time, float(world.d.xpos[body, 2]), len(state.events)))

    run = simulation.run([look])
    assert run.trouble is not None and world.dropped is not None
    since = world.dropped.time
    assert run.sim_time_s == pytest.approx(since + FALL, abs=0.02) and since < 0.2
    fallen = [z for t, z, _ in seen if t > since]
    assert seen[0][1] - fallen[-1] > 0.05 and min(z for t, z, _ in seen if t <= since) > 0.2
    free = [z for t, z, _ in seen if since <= t <= since + 0.1]
    assert free[0] - free[-1] == pytest.approx(GRAVITY * 0.1**2 / 2, rel=0.3)
    assert len({count for t, _, count in seen if t > since}) == 1


def test_a_grip_that_has_just_closed_is_not_judged() -> None:
    """It pulls its part into place within some timesteps."""
    simulation = ready("paper")
    for _ in range(120):
        simulation.supervisor.step()
    parts = simulation.physical.parts
    parts.strength._next = -np.inf
    parts.strength._gauges *= 100
    parts.welds.closed = simulation.world.time
    assert not parts.bear() and simulation.world.dropped is None
    parts.welds.closed = simulation.world.time - 1.0
    assert parts.bear() and simulation.world.dropped is not None


def test_a_live_view_says_what_was_dropped(monkeypatch: pytest.MonkeyPatch) -> None:
    weaken(monkeypatch, 0.1)
    session = Session(lambda: ready("paper", units=10**9))
    session.send(Command("speed", factor=0.0))

    def observe(_: State) -> None:
        if session.frame.note:
            raise Stopped

    with pytest.raises(Stopped):
        session.run(observe)
    assert session.frame.note.startswith("r3 drops 'sub1' at ")
    assert session.frame.note.endswith(": restart it")


# --- what is said ---------------------------------------------------------------------------------


def test_a_run_says_what_was_dropped(
    run: Terminal, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    weaken(monkeypatch, 0.1)
    log, page = tmp_path / "run.log", tmp_path / "run.html"
    paper = EXAMPLES / "paper.pag"
    done = run("run", paper, "--json", "--lenient", "--log", log)
    assert done.status == 1
    assert [error["code"] for error in done.json["errors"]] == ["Dropped"]
    assert done.json["cut_off"]["code"] == "Dropped" and done.json["grip_strength_share_max"] > 1
    assert (done.json["grip_strength_robot"], done.json["grip_strength_label"]) == ("r3", "sub1")
    report, subject = watch_log(read_log(log))
    verdict = verdict_on(read_log(log), subject.factory, report)
    assert {failure.code for failure in verdict.failures} >= {"Dropped"}
    assert run("monitor", log).status == 1
    assert run("report", log, "-o", page).status == 1
    assert "Dropped" in page.read_text("utf-8")
    again = run("run", paper)
    assert again.status == 1 and "drops 'sub1'" in again.err and "Dropped" in again.out


def test_a_run_says_how_much_is_used(run: Terminal, tmp_path: Path) -> None:
    log, page = tmp_path / "run.log", tmp_path / "run.html"
    done = run("run", EXAMPLES / "paper.pag", "--units", 2, "--log", log)
    assert (
        done.status == 0 and "highest grip load: 31 % of the hand's strength (r3 with" in done.out
    )
    figures = read_log(log).figures
    assert figures is not None
    assert figures["grip_strength_share_max"] == pytest.approx(0.306, abs=0.01)
    assert run("report", log, "-o", page).status == 0
    assert "strength share max" in page.read_text("utf-8")
    (tmp_path / "p.pag").write_text("root = s; s = mate(a, b); a = atomic(); b = atomic()")
    words = "fidelity", tmp_path / "p.pag", "--seeds", 1, "--json"
    assert "grip_strength_share_max" in str(run(*words).json)
