"""End stops: what is pushed against one stays there, touches nothing foreign, and comes back."""

from __future__ import annotations

from dataclasses import replace
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from factory.engine.mjcf import names
from factory.engine.mjcf.scene import SHOE
from factory.engine.mjcf.stops import OVERLOAD
from factory.engine.mjcf.timestep import timed
from factory.engine.record.state import State
from factory.engine.simulation.modelling import physical_model
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.dimensions import Clearance
from factory.support.arrays import Array, Index
from factory.support.engine import mujoco
from factory.support.resources import mjcf_folder
from factory.support.settings import TICK, Settings
from factory.theory.problem.robot_bodies import CARRIAGE, CARRIAGE_TOP
from tests.simulation_values import layout_of

MOST = 1e-3
"""By so much a stop may give [m]."""


def at_rest(name: str, timestep: float) -> Simulation:
    """A run of a factory that has not begun."""
    settings = Settings(timestep=timestep, substeps=max(1, round(TICK / timestep)))
    return Simulation(layout_of(name), RunRequest(units=1, settings=settings))


def ends(world: Any, side: int) -> tuple[Array, Array]:
    """For each axis the end of its way on a side (-1 or 1), and its stop there [m]."""
    m, axes = world.m, world.motion.axes
    joint = m.dof_jntid[axes.dof]
    stop = m.jnt_range[joint, (side + 1) // 2]
    room = np.full(len(axes), Clearance(world.model.layout.clearance).stop)
    room[axes.tray] *= 2
    return stop - side * room, stop


def pressed(
    world: Any, chosen: Index, side: int, seconds: float = 1.0, force: float = OVERLOAD
) -> float:
    """How far beyond its stop any chosen axis ever is [m], as it is pressed against it from the end
    of its way by its drive, and by so many times its force besides; it is left pressed."""
    m, d, axes = world.m, world.d, world.motion.axes
    way, stop = ends(world, side)
    d.qpos[axes.qpos[chosen]] = way[chosen]
    world.motion.sleep.stay_awake(chosen)
    world.motion.drives.stand(chosen, way[chosen] + side)
    d.qfrc_applied[axes.dof[chosen]] = (
        side * force * m.actuator_forcerange[axes.actuator[chosen], 1]
    )
    most = -np.inf
    for _ in range(round(seconds / m.opt.timestep)):
        mujoco.mj_step(m, d)
        world.inspection.contacts()
        most = max(most, float((side * (d.qpos[axes.qpos] - stop))[chosen].max()))
    d.qfrc_applied[:] = 0.0
    return most


def steps_of(name: str) -> tuple[float, ...]:
    """The timesteps from 2 ms to the one that is chosen for a factory."""
    longest = timed(Settings(), layout_of(name)).step
    return tuple(step for step in (0.002, 0.0025, 0.005, 0.01) if step <= longest)


@pytest.mark.parametrize(
    ("name", "timestep"), [(name, h) for name in ("paper", "fence") for h in steps_of(name)]
)
@pytest.mark.parametrize("side", [-1, 1])
def test_they_withstand_six_times_the_force_of_a_drive(
    name: str, timestep: float, side: int
) -> None:
    """Carriages, lifts and the tray stay on their rails, rest at the faces of their buffers, and
    come back."""
    world = at_rest(name, timestep).physical
    world.m.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_EQUALITY  # nothing is carried
    every = np.arange(world.motion.axes.tray + 1)
    assert pressed(world, every, side) < MOST
    way, stop = (found[every] for found in ends(world, side))
    qpos, dof = world.motion.axes.qpos[every], world.motion.axes.dof[every]
    play = np.abs(stop - way) / 9
    assert np.abs(world.d.qpos[qpos] - way).max() < (play + 0.2e-3).max()
    assert np.abs(world.d.qvel[dof]).max() < 1e-6
    world.motion.drives.stand(every, way)
    mujoco.mj_step(world.m, world.d, round(1 / timestep))
    assert np.abs(world.d.qpos[qpos] - way).max() < 0.2e-3


@pytest.mark.parametrize("timestep", [0.002, 0.005, 0.01])
@pytest.mark.parametrize("side", [-1, 1])
def test_the_shutter_withstands_its_drive(timestep: float, side: int) -> None:
    """Nothing else can push it: it is stopped above by its buffer and below, before that, by the
    belt, and comes back."""
    world = at_rest("paper", timestep).physical
    axes, shutter = world.motion.axes, np.array([world.motion.axes.tray + 1])
    assert pressed(world, shutter, side, force=0.0) < MOST
    way, stop = (found[shutter] for found in ends(world, side))
    beyond = side * (world.d.qpos[axes.qpos[shutter]] - way)
    assert 0.0 < beyond < (MOST if side < 0 else np.abs(stop - way) / 9 + 0.2e-3)
    assert np.abs(world.d.qvel[axes.dof[shutter]]) < 1e-6
    world.motion.drives.stand(shutter, way)
    mujoco.mj_step(world.m, world.d, round(1 / timestep))
    assert np.abs(world.d.qpos[axes.qpos[shutter]] - way) < 0.2e-3


@pytest.mark.parametrize("side", [-1, 1])
def test_what_carries_much_stays_within_the_clearance(side: int) -> None:
    """Drives for 5 kg throw an empty robot past its stop for a step, and not to its neighbour."""
    layout = layout_of("41")
    world = at_rest("41", timed(Settings(), layout).step).physical
    world.m.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_EQUALITY
    beyond = pressed(world, np.arange(len(layout.guidepaths)), side, 0.2)
    assert 0.0 < beyond < layout.clearance - Clearance(layout.clearance).stop


def test_the_certificate_says_where_they_are() -> None:
    """Two that are pressed against theirs use up less than the clearance."""
    certificate = layout_of("paper").certificate
    assert certificate is not None
    found: Any = certificate.as_json()
    joint = at_rest("paper", 0.01).physical.m.joint("r1/slide")
    assert found["stops_beyond_m"] == pytest.approx(joint.range[1] - joint.qpos0[0])
    assert 2 * found["stops_beyond_m"] < found["clearance_m"]


def test_without_one_a_robot_leaves_its_rail() -> None:
    world = at_rest("paper", 0.002).physical
    world.m.jnt_limited[:] = False
    assert pressed(world, np.arange(2), 1) > 0.1


@pytest.mark.parametrize("side", [-1, 1])
def test_what_is_pressed_against_one_touches_nothing_foreign(side: int) -> None:
    """All robots at once; without stops some do. What a robot's own feeder presents is not foreign
    to its hand: it comes down when that is back (`Hand.first`), while here it is down already."""
    touched = []
    for stops in (True, False):
        world = at_rest("chest", 0.01).physical
        world.m.jnt_limited[:] &= stops
        pressed(world, np.arange(len(layout_of("chest").factory.robots)), side, 0.3)
        touched.append(_foreign(world))
    assert not touched[0] and touched[1]


def _foreign(world: Any) -> list[tuple[str, str]]:
    """What has touched each other but for robots and what their own feeders present."""
    factory = world.model.factory
    own = {(factory.robots[o.carrier].name, f"part/{o.label}") for o in factory.leaves}
    return [
        (one, other)
        for one, other in world.inspection.unintended
        if (one.partition("/")[0], other.partition("#")[0]) not in own
    ]


def test_nothing_of_a_run_meets_one() -> None:
    """They are beyond all that a robot goes by itself, and cost nothing."""
    simulation, limits = at_rest("chest", 0.01), int(mujoco.mjtConstraint.mjCNSTR_LIMIT_JOINT)
    touched = []

    def observe(_: State) -> None:
        touched.append(int(np.count_nonzero(simulation.physical.d.efc_type == limits)))

    run = simulation.run([observe])
    assert run.trouble is None
    assert max(touched) == 0


def test_a_longer_timestep_than_they_allow_is_not_chosen() -> None:
    """Drives that are far too strong throw an empty robot farther in a step than it has room."""
    floor = layout_of("paper")
    usual = timed(Settings(), floor).step
    strong = timed(replace(Settings(), force=20.0), floor).step
    assert strong < usual


def test_buffers_are_where_the_shoes_of_carriages_meet_them() -> None:
    """Shown ones stand beyond the shoe, under the carriage, within what it sweeps at its stop."""
    files = [ElementTree.parse(path) for path in sorted(mjcf_folder().rglob("*.xml"))]
    shoes = [g for file in files for g in file.iter("geom") if g.get("name") == "shoe"]
    assert {float((shoe.get("size") or "").split()[0]) for shoe in shoes} == {SHOE}
    layout = layout_of("paper")
    m = at_rest("paper", 0.01).physical.m
    for robot, path in zip(layout.factory.robots, layout.guidepaths, strict=True):
        joint = m.joint(names.slide(robot.name))
        for end, stop, margin in (("A", joint.range[0], 1), ("B", joint.range[1], -1)):
            face = float(stop + margin * joint.margin[0])
            buffer = m.geom(f"{robot.name}/buffer/{end}")
            middle = np.hypot(*(buffer.pos[:2] - path.carriage(face)))
            assert middle - buffer.size[0] == pytest.approx(SHOE, abs=1e-6)
            far = np.hypot(*(buffer.pos[:2] - path.carriage(float(stop)))) + buffer.size[0]
            assert far == pytest.approx(CARRIAGE / 2, abs=1e-6)
            assert buffer.pos[2] + buffer.size[2] < CARRIAGE_TOP - 0.035


def test_the_urdf_has_them() -> None:
    """The ranges of joints are those of the model."""
    from factory.apps.exports.urdf import _Writer
    from factory.engine.mjcf.loading import load

    m = load(physical_model(layout_of("fence"), 1))
    root = ElementTree.fromstring(_Writer(m, 0.5, {}, "meshes").text("fence"))
    found = {
        joint.get("name"): [float(limit.get(key, "nan")) for key in ("lower", "upper")]
        for joint in root.iter("joint")
        for limit in joint.iter("limit")
    }
    assert found
    for name, (low, high) in found.items():
        assert [low, high] == pytest.approx(m.joint(str(name)).range, abs=1e-9)
