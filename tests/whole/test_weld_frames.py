"""The frames that welds join, against the engine's own."""

from __future__ import annotations

import numpy as np
import pytest

from factory.apps.monitor.anatomy import check_holders
from factory.engine.mjcf.weld_frames import WeldFrames, chain_of, gaps, held_at
from factory.engine.simulation.simulation import Simulation
from factory.support.engine import mujoco
from tests.arm_models import random_arm
from tests.examples import without_hands


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


@pytest.mark.parametrize("seed", range(1))
def test_frames_follow_from_the_slides_alone(model: mujoco.MjModel, seed: int) -> None:
    frames, d = WeldFrames.of(model, anywhere(model, 9)), anywhere(model, seed)
    welds = np.arange(model.neq)
    wanted = held_at(model, welds, d.xpos, d.xmat)
    assert frames.at(d.qpos[frames.along]) == pytest.approx(wanted, abs=1e-12)
    some = welds[::3]
    assert np.array_equal(frames.chosen(some).base, frames.base[some])
    for weld, holder in enumerate(model.eq_obj1id):
        turn = np.empty(4)
        mujoco.mju_mulQuat(turn, d.xquat[holder], model.eq_data[weld, 6:10])
        assert frames.turn[weld] == pytest.approx(turn, abs=1e-12)


def test_gaps_are_what_the_engine_has_to_close(model: mujoco.MjModel) -> None:
    d = anywhere(model, 4)
    welds = np.arange(model.neq)
    d.eq_active[:] = 1
    mujoco.mj_forward(model, d)
    position = d.efc_pos[: d.ne].reshape(-1, 6)[:, :3]
    assert len(position) == model.neq
    found = gaps(model, welds, d.xpos, d.xmat)
    assert found == pytest.approx(np.linalg.norm(position, axis=1), abs=1e-12)


@pytest.mark.parametrize("seed", range(12))
def test_frames_at_the_end_of_long_chains_follow_from_their_joints(seed: int) -> None:
    """Of random arms with hinges and slides, anywhere; beside one on a slide."""
    spec = mujoco.MjSpec.from_string(random_arm(seed))
    hand = spec.site("tool").parent
    hand.name = "hand"
    slider = spec.worldbody.add_body(name="slider", pos=[1, 2, 3])
    slider.add_joint(type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0, 0.6, 0.8])
    slider.add_geom(size=[0.1, 0, 0])
    for number, name in enumerate(("hand", "slider")):
        part = spec.worldbody.add_body(name=f"part{number}", pos=[number + 1, 1, 0])
        part.add_freejoint()
        part.add_geom(size=[0.1, 0, 0])
        weld = spec.add_equality(type=mujoco.mjtEq.mjEQ_WELD, objtype=mujoco.mjtObj.mjOBJ_BODY)
        weld.name1, weld.name2 = name, f"part{number}"
        weld.data[:11] = [0, 0, 0, 0.1, -0.2, 0.3, 0.5, 0.5, -0.5, 0.5, 1]
    m = spec.compile()
    if not chain_of(m, m.body("hand").id):
        pytest.skip("the chain is short")
    d, draw = mujoco.MjData(m), np.random.default_rng(seed)
    joints = [j for j in range(m.njnt) if m.jnt_type[j] != mujoco.mjtJoint.mjJNT_FREE]
    d.qpos[m.jnt_qposadr[joints]] = draw.uniform(-2, 2, len(joints))
    mujoco.mj_kinematics(m, d)
    frames, welds = WeldFrames.of(m, d), np.arange(m.neq)
    assert frames.deep.tolist() == [True, False]
    for _ in range(20):
        d.qpos[m.jnt_qposadr[joints]] = draw.uniform(-3, 3, len(joints))
        mujoco.mj_kinematics(m, d)
        at = d.qpos[frames.along]
        assert np.abs(frames.at(at) - held_at(m, welds, d.xpos, d.xmat)).max() < 1e-12
        for weld, turned in enumerate(frames.turned(at)):
            turn = np.empty(4)
            mujoco.mju_mulQuat(turn, d.xquat[m.eq_obj1id[weld]], m.eq_data[weld, 6:10])
            assert min(np.abs(turned - turn).max(), np.abs(turned + turn).max()) < 1e-12


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


def test_a_holder_that_turns_about_the_vertical_turns_what_it_holds() -> None:
    """Frames follow from the joints as the engine has them, off the axis too."""
    xml = """<mujoco><worldbody>
      <body name="head" pos="0.3 0.1 0.2"><joint type="slide" axis="0 0 1"/><geom size="0.1"/>
        <body name="tool" quat="0.8 0 0 0.6">
          <joint type="hinge" axis="0 0 -1" pos="0.05 0.02 0" ref="0.4"/><geom size="0.1"/>
        </body></body>
      <body name="part"><freejoint/><geom size="0.1"/></body>
    </worldbody><equality>
      <weld body1="tool" body2="part" relpose="0.07 0.01 -0.03 0.6 0 0 0.8"/>
    </equality></mujoco>"""
    m = mujoco.MjModel.from_xml_string(xml)
    check_holders(m, np.array([0]))
    d = mujoco.MjData(m)
    for start, at in (((0.0, 0.0), (0.1, 0.9)), ((0.05, 0.4), (0.02, -1.3))):
        d.qpos[:2] = start
        mujoco.mj_kinematics(m, d)
        frames = WeldFrames.of(m, d)
        d.qpos[:2] = at
        mujoco.mj_kinematics(m, d)
        slides = d.qpos[frames.along]
        turn = np.empty(4)
        mujoco.mju_mulQuat(turn, d.xquat[m.body("tool").id], m.eq_data[0, 6:10])
        wanted = held_at(m, np.array([0]), d.xpos, d.xmat)
        assert frames.at(slides) == pytest.approx(wanted, abs=1e-12)
        assert abs(frames.turned(slides)[0] @ turn) == pytest.approx(1.0, abs=1e-12)
