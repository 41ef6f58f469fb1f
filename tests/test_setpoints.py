"""What the drives are told ahead of the engine's steps, and what the world goes back for."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import get_ident
from typing import Any

import numpy as np
import pytest
from factory.simulation.mujoco.fast.checkpoint import Rewind, tell_who_is_awake
from factory.simulation.mujoco.fast.reference_cache import Course, Courses

from factory.control.governor import follow
from factory.mjcf.model import GRAVITY, HEAD_MASS
from factory.simulation import supervisor
from factory.simulation.mujoco import world as physics
from factory.simulation.mujoco.drives import INPUTS, Told
from factory.simulation.request import RunRequest
from factory.simulation.simulation import Simulation
from factory.support.engine import mujoco
from factory.support.settings import Settings
from tests.bench.replaying import stepping
from tests.test_fuse import layout_of
from tests.test_vicinity import gone_wild, ready, states


def one_by_one(m: mujoco.MjModel, d: mujoco.MjData, steps: int = 0) -> None:
    """Whatever is done at once is taken for contacts that came and went: the world goes back, and
    takes its steps one by one."""
    mujoco.mj_step(m, d, steps or 1)
    if steps:
        d.maxuse_con = 1


def never_at_once(m: mujoco.MjModel, d: mujoco.MjData, steps: int = 0) -> None:
    """Nothing is done at once to begin with."""
    if steps:
        d.maxuse_con = 1
    else:
        mujoco.mj_step(m, d)


@pytest.mark.parametrize(
    ("name", "given"),
    [
        ("paper", {}),
        ("chest", {}),
        ("gearbox", {"fuse": True}),
        ("20", {"fuse": True}),
        ("paper", {"settings": Settings(timestep=0.001, substeps=12, stage=1)}),
        ("paper", {"distributed": True}),
    ],
)
def test_who_goes_back_comes_to_the_same_state(name: str, given: dict[str, Any]) -> None:
    """To the last bit: all steps at once, and all of them twice, the second time one by one."""
    at_once, twice = ready(name, True, **given), ready(name, True, **given)
    expected = states(at_once, at_once.supervisor.step, 400)
    with stepping(one_by_one):
        assert states(twice, twice.supervisor.step, 400) == expected


@pytest.mark.parametrize("step", [one_by_one, never_at_once])
@pytest.mark.parametrize("seed", range(5))
def test_all_contacts_are_seen_that_are_seen_one_by_one(
    seed: int, step: Callable[..., None]
) -> None:
    at_once, singly = ready("20", True), ready("20", True)
    expected = states(at_once, gone_wild(at_once, seed), 150)
    with stepping(step):
        assert states(singly, gone_wild(singly, seed), 150) == expected
    touched = [simulation.world.inspection.unintended for simulation in (at_once, singly)]
    assert touched[0] and touched[0] == touched[1]


LISTS = ("tree_awake", "body_awake", "body_awake_ind", "parent_awake_ind", "dof_awake_ind")
COUNTS = ("ntree_awake", "nbody_awake", "nparent_awake", "nv_awake")


def test_who_is_awake_is_told_as_the_engine_does() -> None:
    simulation = ready("20", True)
    m, d = simulation.world.m, simulation.world.d
    tick = gone_wild(simulation, 0)
    for _ in range(100):
        tick()
        counts = [getattr(d, name) for name in COUNTS]
        lists = [getattr(d, name).copy() for name in LISTS]
        awake = dict(zip(LISTS[2:], counts[1:], strict=True))
        for name in LISTS:
            getattr(d, name)[:] = getattr(d, name) if name == "body_awake" else 0
        d.body_awake[m.body_treeid >= 0] = 0
        tell_who_is_awake(m, d)
        assert [getattr(d, name) for name in COUNTS] == counts
        for name, expected in zip(LISTS, lists, strict=True):
            length = awake.get(name, len(expected))
            assert (getattr(d, name)[:length] == expected[:length]).all(), name


@contextmanager
def forgetful(what: Callable[[Rewind], None]) -> Iterator[None]:
    """Going back forgets something."""
    restore = Rewind.restore

    def planted(self: Rewind) -> None:
        restore(self)
        what(self)

    Rewind.restore = planted  # type: ignore[method-assign]
    try:
        yield
    finally:
        Rewind.restore = restore  # type: ignore[method-assign]


def _warmstart(self: Rewind) -> None:
    self.d.qacc_warmstart[:] = 0.0


def _time(self: Rewind) -> None:
    self.d.time += self.m.opt.timestep


@pytest.mark.parametrize("what", [_warmstart, _time])
def test_who_forgets_something_does_not(what: Callable[[Rewind], None]) -> None:
    at_once, twice = ready("paper", True), ready("paper", True)
    expected = states(at_once, at_once.supervisor.step, 100)
    with stepping(one_by_one), forgetful(what):
        assert states(twice, twice.supervisor.step, 100) != expected


def test_each_step_has_its_own_setpoints() -> None:
    """What a drive reads in a step is where its axis is then, under the acceleration of the
    tick."""
    simulation = Simulation(layout_of("paper"), RunRequest(units=2))
    world, supervisor = simulation.world, simulation.supervisor
    seen: dict[float, np.ndarray] = {}
    m, d = world.m, world.d

    here = get_ident()

    def read(*_: Any) -> None:
        """Other threads may have an engine too."""
        if get_ident() != here:
            return
        drives = np.zeros((m.nactuator, INPUTS))
        for number, inputs in enumerate(drives):
            inputs[:] = mujoco.mj_readCtrl(m, d, number, d.time, np.zeros((INPUTS, 1)), -1)
        seen[float(d.time)] = drives

    mujoco.set_mjcb_control(read)
    try:
        for _ in range(150):
            before, speed, active = world.reference.copy(), world.speed.copy(), supervisor.active
            begun = world.time
            seen.clear()
            supervisor.step()
            axes = supervisor.active.axes
            if supervisor.active.bundle is None or supervisor.active is not active:
                continue
            x, v = before[axes], speed[axes]
            _, _, a = follow(supervisor.active.bundle, x, v, world.tick)
            assert len(seen) == simulation.request.settings.substeps
            half = simulation.request.settings.timestep / 2
            for time, drives in seen.items():
                t = time - begun
                assert np.allclose(drives[axes, 0], x + v * t + a * t * t / 2, atol=1e-12)
                assert np.allclose(drives[axes, 1], v + a * (t - half), atol=1e-12)
                assert np.allclose(drives[axes, 2], a * world.setpoints.mass[axes], atol=1e-12)
    finally:
        mujoco.set_mjcb_control(None)


def test_what_has_been_written_over_can_be_told_again() -> None:
    """The engine goes back in the middle of a tick that one axis has been told at its beginning,
    and another since. The samples of both are gone by then."""
    simulation = Simulation(
        layout_of("paper"), RunRequest(units=2, settings=Settings(timestep=0.002))
    )
    world, h = simulation.world, simulation.request.settings.step
    m, d, told = world.m, world.d, world.setpoints
    for _ in range(3):
        simulation.supervisor.step()
    begin, now, runs = Rewind(m, d), world.time, {}
    for axis, v, a in ((1, -0.2, 0.5), (4, -0.1, -0.3)):
        axes, x = np.array([axis]), world.reference[[axis]]
        begin.save()
        told.tell(told.of(axes, [(x, *np.array([[v], [a]]))], x, x))
        runs[axis] = world.time, float(x[0]), v, a
        mujoco.mj_step(m, d, 3 if axis == 1 else 9)
    begin.restore()
    told.again()
    assert d.time == pytest.approx(now + 3 * h)
    for _ in range(2):
        for axis, (since, x0, v, a) in runs.items():
            t = d.time - since
            read = mujoco.mj_readCtrl(m, d, axis, d.time, np.zeros((INPUTS, 1)), -1)
            told_now = x0 + v * t + a * t**2 / 2, v + a * (t - h / 2)
            assert read[:2] == pytest.approx(told_now, abs=1e-12)
        mujoco.mj_step(m, d)


def test_who_comes_to_rest_stands_for_ever_after() -> None:
    """Nobody tells a drive more than that: not while the samples last, nor later, nor when the
    engine goes back."""
    simulation = Simulation(layout_of("paper"), RunRequest(units=2))
    world, told = simulation.world, simulation.world.setpoints
    m, d, axis, tick = world.m, world.d, np.array([1]), world.tick
    x, rest, a = world.reference[axis], np.zeros(1), np.array([-2.0])
    told.weight[axis] = 0.3
    end = x + 0.5 * 2.0 * tick**2
    told.tell(told.of(axis, [(x, -a * tick, a)], end, rest))
    mujoco.mj_step(m, d, world.steps)
    for step in range(3 * simulation.request.settings.samples):
        begin = Rewind(m, d)
        begin.save()
        for _ in range(1 + (step % 7 == 0)):
            read = mujoco.mj_readCtrl(m, d, 1, d.time, np.zeros((INPUTS, 1)), -1)
            assert read.tolist() == [end[0], 0.0, 0.3]
            mujoco.mj_step(m, d)
            if step % 7 == 0:
                begin.restore()
                told.again()


def test_who_was_told_to_stand_and_then_went_elsewhere_stands_there() -> None:
    """Going back does not bring back what has been told before."""
    simulation = Simulation(layout_of("paper"), RunRequest(units=2))
    world, told = simulation.world, simulation.world.setpoints
    m, d, steps, begin = world.m, world.d, world.steps, Rewind(world.m, world.d)
    axis, rest = np.array([1]), np.zeros(1)
    x = world.reference[axis]
    told.move(axis, x, rest, rest)
    told.update(steps)
    mujoco.mj_step(m, d, steps)
    told.tell(told.of(axis, [(x, rest, rest)], x + 1e-3, rest))
    mujoco.mj_step(m, d, steps)
    begin.save()
    other = np.array([4])
    told.tell(told.of(other, [(world.reference[other], rest, rest)], world.reference[other], rest))
    mujoco.mj_step(m, d, steps)
    begin.restore()
    told.again()
    read = mujoco.mj_readCtrl(m, d, 1, d.time, np.zeros((INPUTS, 1)), -1)
    assert read[0] == x[0] + 1e-3


def test_lifts_that_carry_more_than_before_are_told() -> None:
    """All whose robots have been given something; who stands does not sag."""
    world = Simulation(layout_of("gearbox"), RunRequest(units=2)).world
    robots, told = [*world.lift][:2], world.setpoints
    axes = np.array([world.lift[robot] for robot in robots])
    assert not told.any_due
    world._load([*robots, next(r for r in range(9) if r not in world.lift)], [1.0, 2.0, 3.0])
    assert told.any_due
    told.update(world.steps)
    pushes = world.d.ctrl[world.control[axes] + 2]
    assert pushes.tolist() == pytest.approx([(HEAD_MASS + kg) * GRAVITY for kg in (1.0, 2.0)])
    assert (told.mass[axes] - told.own[axes]).tolist() == pytest.approx([1.0, 2.0])
    world._load(robots, [1.0, 2.0])
    assert not told.any_due, "nothing is new"


# --- courses ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "given"), [("paper", {}), ("chest", {"settings": Settings(stage=1)}), ("lamp", {})]
)
def test_a_course_is_the_same_when_it_is_kept(name: str, given: dict[str, Any]) -> None:
    kept, made = ready(name, True, **given), ready(name, True, **given)
    made.world.courses = Courses(0)
    expected = states(made, made.supervisor.step, 1500)
    assert states(kept, kept.supervisor.step, 1500) == expected
    assert len(made.world.courses) <= 1 < len(kept.world.courses)


def test_steady_production_repeats_itself() -> None:
    simulation = Simulation(layout_of("paper"), RunRequest(units=20))
    world = simulation.world
    while world.delivered() < 5:
        simulation.supervisor.step()
    known = len(world.courses)
    while world.delivered() < 9:
        simulation.supervisor.step()
    assert len(world.courses) == known


def test_bundles_are_forgotten_too(monkeypatch: pytest.MonkeyPatch) -> None:
    usual, forgetful_one = ready("chest", True), ready("chest", True)
    expected = states(usual, usual.supervisor.step, 800)
    monkeypatch.setattr(supervisor, "KEPT", 3)
    for state in expected:
        assert states(forgetful_one, forgetful_one.supervisor.step, 1) == [state]
        assert len(forgetful_one.supervisor.bundles) <= 3
    assert len(usual.supervisor.bundles) > 3


def test_there_is_room_for_so_many_numbers() -> None:
    courses, told = Courses(42), Told.of(np.zeros((2, 2, INPUTS)), np.zeros(2, int))
    for number in range(100):
        course = courses.of(number % 7, 1, lambda: Course(1, told, b"", False))
        assert courses.of(number % 7, 1, lambda: pytest.fail("was forgotten")) is course
        assert 1 <= len(courses) <= 3


# --- sleep -----------------------------------------------------------------------------------


def crept(seconds: float = 2.0) -> float:
    """How far the first robot under way gets behind its reference [m] at 0.5 mm/s, which the engine
    takes for rest."""
    settings = Settings(speed=0.0005)
    simulation = Simulation(layout_of("paper"), RunRequest(settings=settings))
    world, behind = simulation.world, 0.0
    while world.time < seconds:
        simulation.supervisor.step()
        x, _ = world.sense()
        behind = max(behind, float(np.abs(x - world.reference[: world.tray]).max()))
    assert world.speed.any()
    return behind


def test_who_creeps_stays_awake(monkeypatch: pytest.MonkeyPatch) -> None:
    assert crept() < 1e-4
    monkeypatch.setattr(physics, "STAYS_AWAKE", physics.MAY_SLEEP)
    assert crept() > 5e-4


@pytest.mark.parametrize(("name", "stage"), [("chest", 0), ("gearbox", 1)])
def test_who_waits_sleeps(name: str, stage: int) -> None:
    """A lift stops where its carriage goes ahead at once: the two are one tree."""
    simulation = Simulation(layout_of(name), RunRequest(units=2, settings=Settings(stage=stage)))
    world, supervisor = simulation.world, simulation.supervisor
    asleep = 0
    for _ in range(600):
        supervisor.step()
        stays = world.m.tree_sleep_policy[world.tree] == physics.STAYS_AWAKE
        moves = np.isin(world.tree, world.tree[world._under_way])
        assert (stays == moves).all()
        asleep += int((world.d.tree_asleep[world.tree] >= 0).sum())
    assert asleep > 600


def test_a_lift_that_stands_does_not_put_its_carriage_to_sleep() -> None:
    simulation = Simulation(layout_of("gearbox"), RunRequest(units=1))
    world = simulation.world
    carriage, lift = world.axes_of(next(iter(world.lift)))
    on, off = np.array([True]), np.array([False])
    for axis, moves in ((carriage, on), (lift, on), (lift, off)):
        world._attend(np.array([axis]), moves)
    assert world.m.tree_sleep_policy[world.tree[carriage]] == physics.STAYS_AWAKE
    world._attend(np.array([carriage]), off)
    assert world.m.tree_sleep_policy[world.tree[carriage]] == physics.MAY_SLEEP
