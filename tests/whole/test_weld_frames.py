"""The frames that welds join, against the engine's own."""

from __future__ import annotations

import numpy as np
import pytest

from factory.apps.monitor.anatomy import check_holders
from factory.engine.mjcf.weld_frames import gaps
from factory.engine.simulation.simulation import Simulation
from factory.support.engine import mujoco
from tests.examples import without_hands
from tests.good_runs import random_marking
from tests.simulation_values import layout_of, ready


@pytest.fixture(scope="module", params=["paper", "gearbox"])
def model(request: pytest.FixtureRequest) -> mujoco.MjModel:
    return Simulation(without_hands(request.param)).world.m


def anywhere(m: mujoco.MjModel, seed: int) -> mujoco.MjData:
    """The engine in a configuration in which all slides are somewhere."""
    d, draw = mujoco.MjData(m), np.random.default_rng(seed)
    slides = m.jnt_qposadr[m.jnt_type == int(mujoco.mjtJoint.mjJNT_SLIDE)]
    d.qpos[slides] = draw.uniform(-1, 1, len(slides))
    mujoco.mj_kinematics(m, d)
    return d


def test_gaps_are_what_the_engine_has_to_close(model: mujoco.MjModel) -> None:
    d = anywhere(model, 4)
    welds = np.arange(model.neq)
    d.eq_active[:] = 1
    mujoco.mj_forward(model, d)
    position = d.efc_pos[: d.ne].reshape(-1, 6)[:, :3]
    assert len(position) == model.neq
    found = gaps(model, welds, d.xpos, d.xmat)
    assert found == pytest.approx(np.linalg.norm(position, axis=1), abs=1e-12)


def test_a_holder_with_a_joint_of_another_kind_is_refused() -> None:
    xml = """<mujoco><worldbody>
      <body name="slider"><joint type="slide"/><geom size="0.1"/>
        <body name="arm"><joint type="{}" axis="1 0 0"/><geom size="0.1"/></body></body>
      <body name="part"><freejoint/><geom size="0.1"/></body>
    </worldbody><equality><weld body1="arm" body2="part"/></equality></mujoco>"""
    for kind in ("slide", "hinge"):
        check_holders(mujoco.MjModel.from_xml_string(xml.format(kind)), np.array([0]))
    rolls = mujoco.MjModel.from_xml_string(xml.format("ball"))
    check_holders(rolls, np.array([], int))
    with pytest.raises(ValueError, match="arm holds parts and does more than slide"):
        check_holders(rolls, np.array([0]))


def test_a_run_from_a_marking_begins_with_what_robots_hold() -> None:
    """Where the welds hold it: nothing jumps."""
    start = random_marking(layout_of("paper"), 1)
    world = ready("paper", start=start).physical
    places = world.d.xpos.copy()
    for _ in range(20):
        world.advance(1)
    held = [body for held in world.parts.holdings.in_hands().values() for body in held.values()]
    assert np.abs(world.d.xpos[held] - places[held]).max(initial=0.0) < 1e-4
    assert not world.inspection.unintended
