"""The strength of hands: what their loads use of it is measured, agrees with what was predicted,
and where it is too little the part falls and the run ends by that name."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

import factory
from factory.apps.live import Session
from factory.apps.live.commands import Command
from factory.apps.runs.watched import watched
from factory.engine.record.state import State
from factory.engine.simulation.mujoco import strength
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.run import Run
from factory.engine.simulation.simulation import Simulation
from factory.engine.simulation.world import FALL
from factory.floor.geometry.product import product_geometry
from factory.floor.layout.hands import gauges
from factory.floor.layout.hands.places import GRAVITY
from factory.floor.layout.hands.tips import Tip, TipName, shares, tip
from factory.floor.layout.layout import Layout
from factory.floor.layout.request import Ground
from factory.support.engine import mujoco
from factory.support.settings import Settings
from tests.live_sessions import Stopped
from tests.paths import ROOT
from tests.slow import slow_but

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


def weaken(monkeypatch: pytest.MonkeyPatch, factor: float) -> None:
    """Tips pull less than the catalogue said as hands were chosen."""

    def weak(name: TipName) -> Tip:
        return replace(tip(name), pull=factor * tip(name).pull)

    monkeypatch.setattr(gauges, "tip", weak)


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


@pytest.mark.parametrize(
    "name", slow_but(["paper"], ["paper", "lamp", "stool", "truck", "chair", "gearbox"])
)
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


def test_a_tip_of_a_tenth_of_its_pull(monkeypatch: pytest.MonkeyPatch) -> None:
    weaken(monkeypatch, 0.1)
    dropped(watched(ready("paper", distributed=True)), "r3", "sub1")


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
