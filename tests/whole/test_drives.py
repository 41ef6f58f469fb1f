"""Drives in the engine's discrete time: stable with any timestep and load, and on their
reference."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from factory.engine.mjcf import driving
from factory.engine.mjcf.driving import GRAVITY, HOIST_STIFFNESS, STIFFNESS, drive_for
from factory.engine.mjcf.robots import Drive
from factory.engine.simulation.mujoco.drives import Drives
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.durations import Pace
from factory.floor.layout.embedding import lay_out
from factory.support.engine import mujoco
from factory.support.settings import RANGES, TICK, Settings
from tests.simulation_values import layout_of, read_by, ready

CARRIAGE, HEAD = 1.9, 0.4
"""What a carriage, and a lift's head, weigh without payload [kg]."""

MOST = 1.9
"""Jitter draws no greater factor on a drive's gains."""


def growth(drive: Drive, mass: float, timestep: float, factor: float = 1.0) -> float:
    """By how much an offset and a speed of a mass [kg] may grow in a timestep, in the long run:
    v' = v - h (kp x + kv v) / m, x' = x + h v'."""
    push = factor * timestep * drive.kp / mass
    brake = 1 - factor * timestep * drive.kv / mass
    step = np.array([[1 - timestep * push, timestep * brake], [-push, brake]])
    return float(np.abs(np.linalg.eigvals(step)).max())


@given(
    own=st.floats(0.1, 10),
    load=st.floats(0, 1000),
    timestep=st.floats(*RANGES["timestep"]),
    stiffness=st.sampled_from((STIFFNESS, HOIST_STIFFNESS)),
    factor=st.floats(0.1, MOST),
    share=st.floats(0, 1),
)
def test_drives_are_stable(
    own: float, load: float, timestep: float, stiffness: float, factor: float, share: float
) -> None:
    """With any timestep, whatever they carry, and with all gains that jitter draws."""
    drive = drive_for(own, load, 2.0, replace(Settings(), timestep=timestep), stiffness)
    assert growth(drive, own + drive.inertia + share * load, timestep, factor) < 1


def test_a_drive_that_knew_no_timestep_would_not_be() -> None:
    loose = drive_for(CARRIAGE, 0.1, 2.0, Settings(timestep=1e-4))
    assert growth(loose, CARRIAGE, 1e-4) < 1 < growth(loose, CARRIAGE, 0.02)


def test_with_short_timesteps_drives_are_as_stiff_as_ever() -> None:
    short, usual = (
        drive_for(CARRIAGE, 0.5, 2.0, Settings(timestep=timestep)) for timestep in (1e-4, 0.002)
    )
    assert (short.kp, short.kv) == (usual.kp, usual.kv)


@pytest.mark.parametrize("name", ["paper", "fence"])
@pytest.mark.parametrize("timestep", [0.008, 0.02])
def test_long_timesteps_do(name: str, timestep: float) -> None:
    """Gaps stay below 0.3 mm and welds hold, with robots and drives that differ. At 20 ms drives
    may be further off than the 0.2 mm of air over a pad, so that is a draft without hands."""
    settings = Settings(timestep=timestep, substeps=1)
    layout = layout_of(name)
    if timestep > TICK:
        layout = lay_out(layout.factory, layout.product, pace=Pace.of(settings))
    run = ready(layout, jitter=0.5, settings=settings).run()
    figures: Any = run.physics
    assert run.trouble is None
    assert run.refines_net
    assert max(figures.handoff_gap_max_mm, figures.weld_residual_max_mm) < 0.3
    assert figures.unintended_contacts == 0


def test_drives_that_are_too_stiff_for_the_timestep_are_noticed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(driving, "PUSHED", 1e9)
    monkeypatch.setattr(driving, "DAMPED", 1e9)
    settings = Settings(timestep=0.02, substeps=1)
    run = Simulation(layout_of("paper"), RunRequest(units=2, settings=settings)).run()
    assert run.trouble is not None


def largest_error() -> float:
    """How far any robot of the paper's example is from its reference [m] at the end of any tick of
    8 m/s^2, while that moves, with the 2 ms of which h a / w is told."""
    settings = Settings(acceleration=8.0, speed=2.0, timestep=0.002, substeps=5)
    simulation = Simulation(layout_of("paper"), RunRequest(units=2, settings=settings))
    world, largest = simulation.physical, 0.0
    robots, count = world.motion.robots, world.motion.axes.tray
    while not world.delivered():
        simulation.supervisor.step()
        moving = robots.v[:count] != 0.0
        error = np.abs(world.sense()[0] - robots.x[:count])[moving]
        largest = max(largest, float(error.max(initial=0.0)))
    return largest


def test_robots_are_where_their_references_are(monkeypatch: pytest.MonkeyPatch) -> None:
    """To a third of what it would be if setpoints had current-time velocities: half a timestep's
    acceleration, against their stiffness, is h a / w = 0.23 mm."""
    good, sampled = largest_error(), Drives.sampled

    def current(self: Drives, axes: Any, x: Any, v: Any, a: Any, steps: int) -> Any:
        found = sampled(self, axes, x, v, a, steps)
        found[:, :-1, 1] += (self.timestep / 2) * np.repeat(a, steps, axis=0).T
        return found

    monkeypatch.setattr(Drives, "sampled", current)
    assert largest_error() == pytest.approx(0.23e-3, rel=0.2)
    assert good < 0.1e-3


# --- setpoints in the engine's buffers ------------------------------------------------------------


def still(name: str = "paper") -> tuple[Simulation, Drives, mujoco.MjModel, mujoco.MjData]:
    """A run after three ticks, its drives and the engine's model and data."""
    simulation = ready(name)
    for _ in range(3):
        simulation.supervisor.step()
    world = simulation.physical
    return simulation, world.motion.drives, world.m, world.d


def test_setpoints_are_read_one_a_step_and_the_last_is_held() -> None:
    """For ever after: however long the samples were, also while others are written."""
    simulation, drives, m, d = still()
    axes, other = np.array([1, 4]), np.array([2])
    setpoints = np.random.default_rng(1).normal(size=(2, 7, 3))
    before = read_by(simulation, other)
    drives.follow(axes, setpoints)
    for step in range(3 * drives.most):
        expected = setpoints[:, min(step, 6)]
        assert np.array_equal(read_by(simulation, axes), expected)
        if step < 20:
            assert np.array_equal(read_by(simulation, other), before)
        elif step == 20:
            drives.follow(other, setpoints[:1] + 1.0)
        mujoco.mj_step(m, d)
    assert np.array_equal(read_by(simulation, other)[0], setpoints[0, -1] + 1.0)


def test_as_many_setpoints_as_fit_are_read() -> None:
    simulation, drives, m, d = still()
    axes = np.array([1])
    setpoints = np.random.default_rng(2).normal(size=(1, drives.most + 1, 3))
    drives.follow(axes, setpoints)
    for step in range(drives.most):
        assert np.array_equal(read_by(simulation, axes), setpoints[:, step])
        mujoco.mj_step(m, d)


def test_what_is_written_over_is_gone() -> None:
    """In the middle of a leg an axis is told another; nothing of the first is read again."""
    simulation, drives, m, d = still()
    axes, count = np.array([1]), drives.most + 1
    drives.follow(axes, np.full((1, count, 3), 1.0))
    mujoco.mj_step(m, d, 9)
    drives.follow(axes, np.full((1, 4, 3), 2.0))
    for _ in range(2 * count):
        assert (read_by(simulation, axes) == 2.0).all()
        mujoco.mj_step(m, d)


def test_what_comes_to_rest_stands_there() -> None:
    """With the weight that it carries, and no force to accelerate it."""
    simulation, drives, m, d = still()
    axes = np.array([1])
    drives.load(axes, np.array([0.5]), np.array([0.3]))
    assert drives.mass[1] == drives.own[1] + 0.5
    drives.stand(axes, np.array([0.1]))
    for _ in range(2 * drives.most):
        assert read_by(simulation, axes).tolist() == [[0.1, 0.0, 0.3]]
        mujoco.mj_step(m, d)


def test_what_stands_keeps_no_samples() -> None:
    """Which the engine would write and read in every step; what sets out again does."""
    _, drives, m, _ = still()
    axes, samples = np.array([1]), drives.most + 2
    actuator = drives._actuators[axes]
    drives.stand(axes, np.array([0.1]))
    assert not m.actuator_history[actuator, 0].any() and not m.actuator_delay[actuator].any()
    drives.follow(axes, np.full((1, 4, 3), 2.0))
    assert m.actuator_history[actuator, 0] == samples
    assert m.actuator_delay[actuator] == drives.most * drives.timestep


def test_samples_are_of_each_leg_and_end_at_rest() -> None:
    """Positions on parabolas, speeds half a step late, forces for mass and weight; one that rests
    after them carries its weight alone."""
    _, drives, _, _ = still()
    axes, h = np.array([1, 2]), drives.timestep
    drives.load(axes, np.array([1.0, 2.0]), np.array([3.0, 0.0]))
    a = np.array([[1.0, -2.0], [-1.0, 0.0]])
    v = np.array([[0.0, 0.4]]) + np.concatenate([np.zeros((1, 2)), np.cumsum(a * 4 * h, axis=0)])
    v[-1, 0] = 0.0
    x = np.array([[0.0, 1.0], [8e-6, 1.003136], [1.6e-5, 1.006208]])
    found = drives.sampled(axes, x, v, a, 4)
    assert found.shape == (2, 9, 3)
    for leg in range(2):
        for step in range(4):
            t, row = step * h, found[:, 4 * leg + step]
            assert row[:, 0] == pytest.approx(x[leg] + v[leg] * t + a[leg] * t * t / 2)
            assert row[:, 1] == pytest.approx(v[leg] + a[leg] * (t - h / 2))
            assert row[:, 2] == pytest.approx(drives.mass[axes] * a[leg] + [3.0, 0.0])
    assert found[:, -1, 0] == pytest.approx(x[-1]) and found[:, -1, 1] == pytest.approx(v[-1])
    assert found[0, -1, 2] == 3.0


def test_lifts_carry_their_loads() -> None:
    """Those whose robots have been given something; no carriage carries a weight."""
    simulation = ready("fence")
    motion = simulation.physical.motion
    lifts = {robot: mine[1] for robot, mine in enumerate(motion.axes.of_robot) if mine[1:]}
    robots = [*lifts][:2]
    bare = next(r for r in range(9) if r not in lifts)
    axes, drives = np.array([lifts[robot] for robot in robots]), motion.drives
    motion.load([*robots, bare], [1.0, 2.0, 3.0])
    assert drives.weight[axes] == pytest.approx([(HEAD + kg) * GRAVITY for kg in (1.0, 2.0)])
    assert drives.mass[axes] - drives.own[axes] == pytest.approx([1.0, 2.0])
    assert drives.mass[[*robots, bare]] - drives.own[[*robots, bare]] == pytest.approx([1, 2, 3])
    assert (drives.weight[[*robots, bare]] == 0.0).all()


def test_loads_of_robots_are_what_they_hold() -> None:
    """In every tick, lifts' too."""
    simulation = ready("fence")
    world, supervisor = simulation.physical, simulation.supervisor
    motion, mass = world.motion, world.model.carried.mass
    while world.delivered() < 1:
        supervisor.step()
        for robot in range(len(simulation.layout.factory.robots)):
            held = sum(mass[label] for label in world.parts.holdings.hand(robot))
            for axis in motion.axes.of_robot[robot]:
                load = motion.drives.mass[axis] - motion.drives.own[axis]
                assert load == pytest.approx(held, abs=1e-9)


def sagging() -> float:
    """How far a lift that has stood for 0.2 s hangs below its reference [m], at most."""
    simulation = ready("fence")
    world, lowest = simulation.physical, 0.0
    lifts = np.array([mine[1] for mine in world.motion.axes.of_robot if mine[1:]])
    stood = np.zeros(len(lifts))
    while world.time < 4.0:
        simulation.supervisor.step()
        stood = np.where(world.motion.robots.v[lifts] == 0.0, stood + 1, 0)
        sag = (world.motion.robots.x[lifts] - world.sense()[0][lifts])[stood > 20]
        lowest = max(lowest, float(sag.max(initial=0.0)))
    return lowest


def test_a_lift_that_stands_does_not_sag(monkeypatch: pytest.MonkeyPatch) -> None:
    """Planted fault: it is not told what it carries, not even its own head."""
    assert sagging() < 2e-6
    monkeypatch.setattr(Drives, "load", lambda *_: None)
    assert sagging() > 4e-5


def test_an_axis_goes_on_as_it_has_been_set_going() -> None:
    """For as long as setpoints can be written ahead; and references are there after each tick."""
    simulation = ready("paper")
    world, h = simulation.physical, simulation.physical.m.opt.timestep
    motion, axes = world.motion, np.array([1, 4])
    x, v, a = motion.robots.x[axes].copy(), np.array([-0.1, -0.2]), np.array([0.3, 0.4])
    world.move(axes, x, v, a)
    for step in range(motion.drives.most):
        t, read = step * h, read_by(simulation, axes)
        assert read[:, 0] == pytest.approx(x + v * t + a * t * t / 2, abs=1e-12)
        assert read[:, 1] == pytest.approx(v + a * (t - h / 2), abs=1e-12)
        world.advance(1)
        if step % 5 == 4:
            world.settle()
            t = world.time
            assert motion.robots.x[axes] == pytest.approx(x + v * t + a * t * t / 2, abs=1e-12)
            assert motion.robots.v[axes] == pytest.approx(v + a * t, abs=1e-12)
    world.move(axes, motion.robots.x[axes], np.zeros(2), np.zeros(2))
    world.advance(100)
    world.settle()
    assert (read_by(simulation, axes)[:, 1:] == 0.0).all()
    assert np.abs(world.sense()[0][axes] - motion.robots.x[axes]).max() < 1e-4
