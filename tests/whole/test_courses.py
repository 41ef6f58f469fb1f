"""Courses: what references do, planned ahead; kept or planned anew, cut short or followed to their
end."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from factory.apps.live.interventions import Interventions
from factory.engine.simulation.mujoco import courses, motion
from factory.engine.simulation.mujoco.courses import Course, Follower, planned
from factory.engine.simulation.mujoco.fast import strides
from factory.engine.simulation.mujoco.fast.strides import Strides
from factory.engine.simulation.mujoco.motion import Motion
from factory.engine.simulation.simulation import Simulation
from factory.support.engine import mujoco
from factory.support.settings import MOST, Settings
from factory.theory.control.governor import follow
from factory.theory.control.mode import ROUNDING
from factory.theory.control.navigation import Bundle
from tests.simulation_values import FINE, read_by, ready, stepping


def kept(simulation: Simulation) -> dict[Any, Course]:
    """The courses that a run has planned."""
    stepping_ = simulation.physical.motion.stepping
    assert isinstance(stepping_, Strides)
    return stepping_._courses  # type: ignore[return-value]


def test_steady_production_repeats_itself() -> None:
    simulation = ready("paper", units=20, jitter=0.0)
    while simulation.world.delivered() < 5:
        simulation.supervisor.step()
    known = len(kept(simulation))
    while simulation.world.delivered() < 9:
        simulation.supervisor.step()
    assert len(kept(simulation)) == known > 10


def test_there_is_room_for_so_many_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(strides, "ROOM", 42)
    cache = ready("paper").physical.motion.stepping
    assert isinstance(cache, Strides)
    still = np.zeros((2, 1))
    for number in range(100):
        course = cache.course(number % 7, lambda: Course(still, still, np.zeros((1, 4, 3)), False))
        again = cache.course(number % 7, lambda: pytest.fail("it was forgotten"))
        assert again is course
        assert 1 <= len(cache._courses) <= 42 // 16


# --- what drives read -----------------------------------------------------------------------------


@pytest.mark.parametrize("ticks", [1, MOST])
@pytest.mark.parametrize("name", ["paper", "fence"])
def test_each_step_has_its_own_setpoints(name: str, ticks: int) -> None:
    """What a drive reads in a step is where its axis is then, how fast it was half a step before,
    and the force for its acceleration and weight."""
    simulation = ready(name)
    world, supervisor = simulation.physical, simulation.supervisor
    motion, h = world.motion, world.m.opt.timestep
    every, seen = np.arange(motion.axes.tray), dict[float, np.ndarray]()

    def step(m: mujoco.MjModel, d: mujoco.MjData, steps: int) -> None:
        for _ in range(steps):
            seen[float(d.time)] = read_by(simulation, every)
            mujoco.mj_step(m, d)

    looked, moved = 0, 0
    with stepping(step):
        for _ in range(150 if ticks == 1 else 60):
            x, v, begun = motion.robots.x.copy(), motion.robots.v.copy(), world.time
            seen.clear()
            supervisor.step(ticks)
            axes, bundle = supervisor.active.axes, supervisor.active.bundle
            if bundle is None:
                continue
            still = np.setdiff1d(every, axes)
            for number in range(round((world.time - begun) / world.model.settings.tick)):
                x1, v1, a = follow(bundle, x[axes], v[axes], world.model.settings.tick)
                v1[np.abs(v1) < ROUNDING] = 0.0
                since = begun + number * world.model.settings.tick
                until = since + world.model.settings.tick
                mine = [time for time in seen if since - h / 2 < time < until - h / 2]
                assert len(mine) == 5
                for time in mine:
                    t, read = time - since, seen[time]
                    force = a * motion.drives.mass[axes] + motion.drives.weight[axes]
                    told = x[axes] + v[axes] * t + a * t * t / 2
                    assert np.allclose(read[axes, 0], told, atol=1e-12)
                    assert np.allclose(read[axes, 1], v[axes] + a * (t - h / 2), atol=1e-12)
                    assert np.allclose(read[axes, 2], force, atol=1e-9)
                    assert (read[still, 0] == x[still]).all() and (read[still, 1] == 0.0).all()
                    looked += 1
                x[axes], v[axes] = x1, v1
            moved += bool(v[axes].any())
            assert np.allclose(motion.robots.x[axes], x[axes], rtol=0, atol=1e-12)
    assert looked > 300 and moved > 5


@pytest.mark.parametrize("name", ["chest", "fence"])
def test_setpoints_shown_are_those_that_drives_read(name: str) -> None:
    """After every call, in `ctrl`: in a course; and where it is over, the references."""
    simulation = ready(name)
    world, supervisor = simulation.physical, simulation.supervisor
    control, inside = world.m.actuator_ctrladr[world.motion.drives._actuators], 0
    for number in range(200):
        supervisor.step(1 if number % 3 else MOST)
        axes = supervisor.active.axes
        shown = world.d.ctrl[control[axes, None] + np.arange(3)]
        assert np.array_equal(world.motion.robots.x[axes], shown[:, 0])
        if world.motion.robots.left:
            assert np.array_equal(read_by(simulation, axes), shown)
            inside += 1
        else:
            assert np.array_equal(world.motion.robots.v[axes], shown[:, 1])
    assert inside > 50


def test_a_course_ends_where_it_is_near() -> None:
    """After as many ticks as are asked for at most; it has a setpoint for each step, and one to
    hold."""
    drives = ready("paper").physical.motion.drives
    axes, begin = np.array([1]), (np.zeros(1), np.ones(1))

    def go(x: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, bool]:
        return x + 0.01, v, np.zeros(1), bool(x[0] > 0.025)

    cut, whole = (planned(drives, axes, begin, (ticks, 5), go) for ticks in (2, 9))
    assert (cut.ticks, cut.near) == (2, False) and (whole.ticks, whole.near) == (4, True)
    assert cut.setpoints.shape == (1, 11, 3) and whole.setpoints.shape == (1, 21, 3)
    assert whole.x[:, 0] == pytest.approx([0.0, 0.01, 0.02, 0.03, 0.04])


@pytest.mark.parametrize("lags", [True, False])
def test_robots_are_slow_where_a_course_is_over_near_their_goal(
    lags: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nearly always something ends then. Planted fault: speeds that lag nothing; robots are still
    too fast then, and asked again a tick later."""
    if not lags:
        monkeypatch.setattr(
            motion, "along", lambda bundle, tick, _: courses.along(bundle, tick, 0.0)
        )
    simulation = ready("20", settings=Settings(timestep=0.01, substeps=1), jitter=0.0)
    supervisor, found = simulation.supervisor, list[bool]()
    finished = supervisor._finished

    def finishing() -> list[int]:
        over = finished()
        if supervisor.near and supervisor.active.bundle is not None:
            found.append(bool(over))
        return over

    monkeypatch.setattr(supervisor, "_finished", finishing)
    while not simulation.physical.delivered():
        supervisor.step(MOST)
    assert len(found) > 15 and (np.mean(found) > 0.8) == lags


def test_a_follower_keeps_its_own_references() -> None:
    """The others stay as they are; it is near a goal only where its course ends."""
    drives = ready("paper").physical.motion.drives
    x, v = np.full(7, 9.0), np.full(7, 9.0)
    follower, axes = Follower(x, v, drives, 5), np.array([1, 4])
    assert (follower.left, follower.near) == (0, False)
    at = np.array([[0.0, 0.0], [0.1, 0.2], [0.2, 0.4]])
    course = Course(at, at + 1.0, np.zeros((2, 11, 3)), True)
    follower.begin(axes, course)
    follower.show(1)
    assert (follower.left, follower.near) == (1, False)
    assert x[axes].tolist() == [0.1, 0.2] and v[axes].tolist() == [1.1, 1.2]
    follower.show(1)
    assert (follower.left, follower.near) == (0, True)
    assert (np.delete(x, axes) == 9.0).all() and (np.delete(v, axes) == 9.0).all()
    follower.stop(axes[:1])
    assert follower.course is None and v[axes].tolist() == [0.0, 1.4]


# --- courses that are cut short -------------------------------------------------------------------


def slowed(ticks: int, fast: bool) -> tuple[float, float, float]:
    """The greatest speed of a robot's reference [m/s] in the tick after it is slowed down to a
    tenth, and then; and how long the run takes [s]."""
    simulation = ready("paper", fast=fast, units=1)
    world = simulation.physical
    robot = next(iter(simulation.layout.factory.by_label["part1"].robots))
    while abs(world.motion.robots.v[robot]) < 0.9 * simulation.limits.speed[robot]:
        simulation.supervisor.step(ticks)
    assert world.motion.robots.left
    Interventions(simulation).slow(robot, 0.1)
    before = abs(world.motion.robots.v[robot])
    simulation.supervisor.step()
    first = before - abs(world.motion.robots.v[robot])
    for _ in range(40):
        simulation.supervisor.step()
    later = abs(world.motion.robots.v[robot])
    assert later <= simulation.limits.speed[robot] + 1e-12
    run = simulation.run()
    assert run.refines_net
    return first, later, run.sim_time_s


@pytest.mark.parametrize("ticks", [1, 3])
def test_a_slower_limit_cuts_a_course_short(ticks: int) -> None:
    """At once, not at the end of the stride."""
    first, _, _ = slowed(ticks, True)
    assert first > 0.5 * FINE.acceleration * FINE.tick


def test_a_slower_limit_does_the_same_without_what_is_fast() -> None:
    assert slowed(1, True) == slowed(1, False)


def test_a_course_that_goes_on_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Planted fault: other modes do not end a course."""
    turn = Motion.turn

    def goes_on(self: Motion, active: Any) -> None:
        course = self.robots.course
        turn(self, active)
        self.robots.course = course

    simulation = ready("paper", units=1)
    world = simulation.physical
    while world.motion.robots.left < 4 or not world.motion.robots.v.any():
        simulation.supervisor.step()
    robot = int(np.abs(world.motion.robots.v).argmax())
    monkeypatch.setattr(Motion, "turn", goes_on)
    Interventions(simulation).slow(robot, 0.1)
    before = world.motion.robots.v.copy()
    with pytest.raises(AssertionError):
        for _ in range(2):
            simulation.supervisor.step()
        after = world.motion.robots.v
        assert abs(before[robot]) - abs(after[robot]) > 0.5 * FINE.acceleration * FINE.tick


@pytest.mark.parametrize("name", ["paper", pytest.param("20", marks=pytest.mark.slow)])
@pytest.mark.parametrize("eps", [2e-4, 5e-3])
def test_no_robot_comes_to_a_goal_before_its_reference_rests(
    name: str, eps: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Courses that end as soon as references are close to a goal, at any speed, end no operation
    any earlier."""
    settings = replace(FINE, eps=eps)
    asked, near_goal = ready(name, settings=settings), Bundle.near_goal
    expected = asked.run()
    monkeypatch.setattr(
        Bundle, "near_goal", lambda self, x, within, slow=None: near_goal(self, x, within)
    )
    assert ready(name, settings=settings).run().events == expected.events


def test_long_timesteps_have_courses_of_several_ticks() -> None:
    simulation = ready("paper", settings=Settings(timestep=0.02, substeps=1))
    while not simulation.physical.motion.robots.v.any():
        simulation.supervisor.step()
    assert simulation.physical.motion.robots.left >= 1
