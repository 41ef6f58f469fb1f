"""Sleep: what is in an active mode stays awake, all else sleeps, and is woken by what concerns
it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from factory.engine.simulation.mujoco import sleep
from factory.engine.simulation.mujoco.sleep import AWAKE, FRESH, MAY_SLEEP, STAYS_AWAKE, Sleep
from factory.engine.simulation.simulation import Simulation
from factory.support.settings import Settings
from tests.good_runs import assert_good
from tests.simulation_values import FINE, layout_of, ready


def crept(fast: bool, seconds: float = 1.5) -> float:
    """How far the first robot under way gets behind its reference [m] at 1 mm/s, which the engine
    takes for rest."""
    simulation = ready("paper", settings=replace(FINE, speed=0.001), fast=fast)
    world, behind = simulation.physical, 0.0
    while world.time < seconds:
        simulation.supervisor.step()
        x, _ = world.sense()
        behind = max(behind, float(np.abs(x - world.motion.robots.x[: len(x)]).max()))
    assert world.motion.robots.v.any()
    return behind


@pytest.mark.parametrize("fast", [True, False])
def test_what_creeps_stays_awake(fast: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Planted fault: it may sleep, and never moves again."""
    assert crept(fast) < 1e-4
    monkeypatch.setattr(sleep, "STAYS_AWAKE", MAY_SLEEP)
    assert crept(fast) > 4e-4


def awake(simulation: Simulation) -> np.ndarray:
    """The axes that are in an active mode, or those of the outfeed while its tray is under way."""
    motion = simulation.physical.motion
    moving = np.zeros(len(motion.axes), bool)
    moving[motion.active] = True
    moving[motion.outfeed.axes] = motion.outfeed.moves or motion.outfeed.follower.course is not None
    return moving


@pytest.mark.parametrize(("name", "stage"), [("chest", 0), ("fence", 1), ("20", 1)])
def test_what_waits_sleeps(name: str, stage: int) -> None:
    """In every tick exactly the active robots stay awake, and the tray on its way; a lift stops
    where its carriage goes ahead at once: the two are one tree."""
    simulation = ready(name, settings=replace(FINE, stage=stage))
    world, supervisor, asleep, tray = simulation.physical, simulation.supervisor, 0, 0
    trees = world.motion.axes.tree
    while world.delivered() < 1 or world.time < 6.0:
        supervisor.step()
        stays = world.m.tree_sleep_policy[trees] == STAYS_AWAKE
        moves = np.isin(trees, trees[awake(simulation)])
        assert (stays == moves).all()
        assert (world.d.tree_asleep[trees[moves]] < 0).all()
        asleep += int((world.d.tree_asleep[trees] >= 0).sum())
        tray += bool(stays[-1])
        assert world.time < 40.0
    assert asleep > 300 and tray > 20


def test_a_robot_that_may_sleep_on_its_way_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Planted fault: an active robot may sleep; it does, before its next setpoint."""
    settings = replace(FINE, speed=0.001)
    simulation = ready("paper", settings=settings)
    monkeypatch.setattr(Sleep, "stay_awake", lambda self, axes: None)
    world = simulation.physical
    while world.time < 1.0:
        simulation.supervisor.step()
    trees = world.motion.axes.tree[awake(simulation)]
    assert len(trees) and (world.d.tree_asleep[trees] >= 0).any()


def test_a_lift_that_stands_does_not_put_its_carriage_to_sleep() -> None:
    world = ready("fence", units=1).physical
    axes, policy = world.motion.axes, world.m.tree_sleep_policy
    carriage, lift = next(mine for mine in axes.of_robot if mine[1:])
    tree = axes.tree[carriage]
    assert tree == axes.tree[lift]
    asleep = world.motion.sleep
    asleep.stay_awake(np.array([carriage]))
    asleep.stay_awake(np.array([lift]))
    asleep.may_sleep(np.array([lift]))
    assert policy[tree] == STAYS_AWAKE
    asleep.may_sleep(np.array([carriage]))
    assert policy[tree] == MAY_SLEEP


def test_bodies_that_are_woken_are_awake_in_the_next_step() -> None:
    """Those that sleep get a speed that wakes them and changes nothing; those that are about to
    fall asleep begin anew to be slow; fixed ones are left alone."""
    simulation = ready("20")
    for _ in range(200):
        simulation.supervisor.step()
    world = simulation.physical
    m, d, axes = world.m, world.d, world.motion.axes
    (sleeping,) = (d.tree_asleep[axes.tree] >= 0).nonzero()
    (going,) = (d.tree_asleep[axes.tree] < 0).nonzero()
    one, other = int(sleeping[0]), int(going[0])
    d.tree_asleep[axes.tree[other]] = -2
    floor = int(np.flatnonzero((m.body_treeid < 0) & (np.arange(m.nbody) > 0))[0])
    before = d.qvel.copy()
    world.motion.sleep.wake([int(axes.body[one]), int(axes.body[other]), floor])
    assert d.tree_asleep[axes.tree[other]] == FRESH
    assert np.signbit(d.qvel[axes.dof[one]]) == np.signbit(AWAKE)
    assert (d.qvel == before).all()
    world.advance(1)
    assert d.tree_asleep[axes.tree[one]] < 0


def test_short_steps_and_slow_starts_do_not_send_robots_to_sleep() -> None:
    """The engine puts to sleep what is slow for ten steps, in the middle of a trajectory too."""
    for settings in (
        Settings(timestep=1e-4, substeps=20, acceleration=0.2),
        Settings(timestep=0.002, substeps=5, acceleration=0.002, speed=0.05),
    ):
        run = ready("paper", units=1, jitter=0.0, settings=settings).run()
        assert run.products == 1
        assert_good(run)


def test_the_tray_sleeps_at_home() -> None:
    simulation = ready("paper", units=1)
    world = simulation.physical
    while not world.delivered():
        simulation.supervisor.step()
    assert world.m.tree_sleep_policy[world.motion.axes.tree[-1]] == STAYS_AWAKE
    for _ in range(300):
        simulation.supervisor.step()
    assert not world.motion.outfeed.busy
    assert world.m.tree_sleep_policy[world.motion.axes.tree[-1]] == MAY_SLEEP
    assert world.d.tree_asleep[world.motion.axes.tree[-1]] >= 0
    assert layout_of("paper").outfeed_way > 0.0
