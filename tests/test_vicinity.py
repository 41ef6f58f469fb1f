"""What the broad phase is spared: a run is the same to the last bit, also where things collide."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest

from factory import settings
from factory.disturbance import Push, disturb
from factory.disturbance.hands import Hands
from factory.engine import mujoco
from factory.fidelity.shadow import Shadow
from factory.layout.plan import Layout
from factory.settings import Settings
from factory.simulation import Simulation
from factory.world import vicinity
from factory.world.contacts import NOBODY
from factory.world.vicinity import Vicinity
from tests.bench.factories import balanced
from tests.bench.factories import laid_out as floor_of
from tests.bench.replaying import stepping
from tests.test_fuse import layout_of

IS_AWAKE = int(mujoco.mjtSleepState.mjS_AWAKE)


@pytest.fixture(autouse=True)
def _also_in_small_factories(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(vicinity, "FEW", 0)


@cache
def layout(name: str) -> Layout:
    """Of an example, or of a balanced product of so many parts."""
    return floor_of(balanced(int(name))) if name.isdigit() else layout_of(name)


def ready(name: str, culls: bool, **given: object) -> Simulation:
    simulation = Simulation(layout(name), units=2, seed=3, jitter=0.3, **given)  # type: ignore[arg-type]
    if not culls:
        simulation.world.vicinity.everything()
    return simulation


def states(simulation: Simulation, tick: Callable[[], None], ticks: int) -> list[bytes]:
    """Where everything is after each tick, and how many contacts there have been."""
    d, found = simulation.world.d, []
    for _ in range(ticks):
        tick()
        seen = len(simulation.world.inspection.unintended)
        found.append(d.qpos.tobytes() + d.qvel.tobytes() + bytes([d.ncon, seen % 256]))
    return found


def looked_at(simulation: Simulation) -> float:
    """The share of the bodies that can collide which the broad phase looks at."""
    m, collides = simulation.world.m, simulation.world.stock.contacts.collides
    return float(((m.body_contype | m.body_conaffinity) != 0).sum() / collides.sum())


@pytest.mark.parametrize(
    ("name", "fuse"),
    [("paper", False), ("gearbox", False), ("chest", False), ("20", False), ("20", True)],
)
def test_a_run_is_the_same_to_the_last_bit(name: str, fuse: bool) -> None:
    whole, culled = (ready(name, culls, fuse=fuse) for culls in (False, True))
    assert states(whole, whole.supervisor.step, 400) == states(culled, culled.supervisor.step, 400)


def test_most_of_a_factory_is_left_out() -> None:
    simulation = ready("20", True)
    shares = []
    for _ in range(800):
        simulation.supervisor.step()
        shares.append(looked_at(simulation))
    assert np.mean(shares[400:]) < 0.5
    simulation.world.vicinity.everything()
    simulation.supervisor.step()
    assert looked_at(simulation) == 1.0


def gone_wild(simulation: Simulation, seed: int) -> Callable[[], None]:
    """Some robots run wherever they like from now on, and through whoever rests there."""
    world, rng = simulation.world, np.random.default_rng(seed)
    for _ in range(100):
        simulation.supervisor.step()
    axes = rng.choice(world.tray, 6, replace=False)
    world.move(axes, world.reference[axes], rng.uniform(-0.5, 0.5, 6), np.zeros(6))
    return lambda: world.advance(5)


def crash(seed: int, culls: bool) -> tuple[list[bytes], int]:
    simulation = ready("20", culls)
    found = states(simulation, gone_wild(simulation, seed), 150)
    return found, len(simulation.world.inspection.unintended)


@pytest.mark.parametrize("seed", range(4))
def test_a_collision_is_the_same_to_the_last_bit(seed: int) -> None:
    whole, touched = crash(seed, False)
    assert touched
    assert crash(seed, True) == (whole, touched)


@pytest.mark.parametrize("seed", [3, 4, 7])
def test_a_sudden_collision_is_the_same_to_the_last_bit(seed: int) -> None:
    """At four hundred metres a second squared, if the settings ask for that."""
    found = []
    for culls in (True, False):
        simulation = ready("20", culls, settings=Settings(acceleration=400.0, speed=10.0))
        rng, world = np.random.default_rng(seed), simulation.world
        for _ in range(60):
            simulation.supervisor.step()
        axes = rng.choice(world.tray, 6, replace=False)
        world.move(axes, world.reference[axes], np.zeros(6), rng.choice([-1, 1], 6) * 360.0)
        seen = states(simulation, lambda world=world: world.advance(5), 30)
        found.append((seen, len(world.inspection.unintended)))
    assert found[0] == found[1]


def boxes(m: mujoco.MjModel, d: mujoco.MjData, bodies: np.ndarray) -> np.ndarray:
    """The boxes (n, 2, 3) that the engine's broad phase has for bodies, in the world's axes."""
    solid = (m.geom_contype | m.geom_conaffinity) != 0
    turn = d.geom_xmat.reshape(-1, 3, 3)
    middle = d.geom_xpos + (turn @ m.geom_aabb[:, :3, None])[:, :, 0]
    half = (np.abs(turn) @ m.geom_aabb[:, 3:, None])[:, :, 0]
    found = np.empty((m.nbody, 2, 3))
    found[:, 0], found[:, 1] = np.inf, -np.inf
    np.minimum.at(found[:, 0], m.geom_bodyid[solid], (middle - half)[solid])
    np.maximum.at(found[:, 1], m.geom_bodyid[solid], (middle + half)[solid])
    return np.asarray(found[bodies])


def overlooked(m: mujoco.MjModel, d: mujoco.MjData, contacts: Any) -> set[str]:
    """Whatever meets the box of something awake and was left out of the last step, and whatever is
    awake and was left out."""
    bodies = np.flatnonzero(contacts.collides)
    seen = (m.body_contype[bodies] | m.body_conaffinity[bodies]) != 0
    awake = d.body_awake[bodies] == IS_AWAKE
    low, high = boxes(m, d, bodies).transpose(1, 0, 2)
    meets = (low[awake, None] <= high) & (low <= high[awake, None])
    near = meets.all(axis=2).any(axis=0)
    return {m.body(body).name for body in bodies[(near | awake) & ~seen]}


def all_overlooked(seed: int, ticks: int = 150) -> set[str]:
    """In a run in which robots collide."""
    simulation, found = ready("20", True), set[str]()
    contacts = simulation.world.stock.contacts

    def step(m: mujoco.MjModel, d: mujoco.MjData, steps: int = 1) -> None:
        for _ in range(steps):
            mujoco.mj_step(m, d)
            found.update(overlooked(m, d, contacts))

    with stepping(step):
        tick = gone_wild(simulation, seed)
        for _ in range(ticks):
            tick()
    return found


@pytest.mark.parametrize("seed", range(2))
def test_nothing_near_what_moves_is_overlooked(seed: int) -> None:
    assert all_overlooked(seed) == set()


def test_who_sees_only_what_moves_overlooks_what_is_near(monkeypatch: pytest.MonkeyPatch) -> None:
    reached = Vicinity._reached

    def short_sighted(self: Vicinity, who: np.ndarray, bodies: np.ndarray) -> np.ndarray:
        near = np.zeros_like(reached(self, who, bodies))
        near[who] = True
        return near

    monkeypatch.setattr(Vicinity, "_reached", short_sighted)
    assert all_overlooked(0)
    assert any(crash(seed, True) != crash(seed, False) for seed in range(4))


def test_who_looks_too_short_ahead_overlooks_what_is_near(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(settings, "LOOK", 2.0)
    monkeypatch.setattr(settings, "MOST", 200)
    monkeypatch.setattr(vicinity, "SUDDEN", -0.5)
    monkeypatch.setattr(vicinity, "TIMES", -1.0)
    assert all_overlooked(0)


def all_overlooked_by_one(seed: int) -> set[str]:
    """All others rest while one robot runs into somebody, and is looked at four times as rarely as
    usual."""
    simulation, found, rng = ready("20", True), set[str](), np.random.default_rng(seed)
    world, contacts = simulation.world, simulation.world.stock.contacts
    for _ in range(int(rng.integers(20, 100))):
        simulation.supervisor.step()
    axis, speed = rng.integers(0, world.tray, 1), rng.choice([-0.5, 0.5], 1)
    everybody, still = np.arange(world.tray), np.zeros(world.tray)
    world.move(everybody, world.reference[everybody], still, still)
    for _ in range(20):
        world.advance(5)

    def step(m: mujoco.MjModel, d: mujoco.MjData, steps: int = 1) -> None:
        for _ in range(steps):
            mujoco.mj_step(m, d)
            found.update(overlooked(m, d, contacts))

    with stepping(step):
        world.move(axis, world.reference[axis], speed, np.zeros(1))
        for _ in range(100):
            if world.d.ncon:
                break
            world.advance(5)
    return found


def test_who_looks_back_overlooks_what_is_ahead(monkeypatch: pytest.MonkeyPatch) -> None:
    reach, seeds = Vicinity._reach, (1, 5, 8, 13)

    def backwards(self: Vicinity, who: np.ndarray) -> np.ndarray:
        return np.roll(reach(self, who), 2, axis=0)

    monkeypatch.setattr(settings, "LOOK", 0.16)
    monkeypatch.setattr(settings, "MOST", 16)
    monkeypatch.setattr(vicinity, "TIMES", 0.0)
    assert not any(all_overlooked_by_one(seed) for seed in seeds)
    monkeypatch.setattr(Vicinity, "_reach", backwards)
    assert any(all_overlooked_by_one(seed) for seed in seeds)


def test_who_forgets_what_is_held_overlooks_what_is_near_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def forgotten(self: Vicinity, who: np.ndarray) -> None:
        self._changed[who] = False
        holder = self.holder.copy()
        self.holder[[*self.contacts.solid]] = NOBODY
        try:
            measure(self, who)
        finally:
            self.holder[:] = holder

    measure = Vicinity._measure
    monkeypatch.setattr(Vicinity, "_measure", forgotten)
    assert all_overlooked(0)


def test_what_the_engine_wakes_by_itself_is_seen_a_tick_later() -> None:
    simulation = ready("20", True)
    for _ in range(600):
        simulation.supervisor.step()
    world = simulation.world
    m, d, collides = world.m, world.d, world.stock.contacts.collides
    sleeps = collides & (m.body_contype == 0) & (d.body_awake == 0)
    body = int(np.flatnonzero(sleeps)[0])
    world.vicinity._due = np.inf
    d.xfrc_applied[body, 2] = 1e-6
    world.advance(1)
    assert d.body_awake[body] == IS_AWAKE
    world.advance(1)
    assert m.body_contype[body] | m.body_conaffinity[body]


def test_the_box_of_a_part_holds_it_whichever_way_it_is_turned() -> None:
    simulation, rng = ready("gearbox", True), np.random.default_rng(4)
    world = simulation.world
    m, d, seen = world.m, world.d, world.vicinity
    for _ in range(60):
        simulation.supervisor.step()
    parts = np.array([*world.stock.contacts.solid])
    at = m.jnt_qposadr[m.body_jntadr[parts]]
    for _ in range(5):
        d.qpos[at[:, None] + np.arange(3, 7)] = rng.normal(size=(len(parts), 4))
        mujoco.mj_normalizeQuat(m, d.qpos)
        mujoco.mj_kinematics(m, d)
        here = parts[world.stock.contacts.collides[parts]]
        low, high = boxes(m, d, here).transpose(1, 0, 2)
        assert (d.xpos[here] + seen._lowest[here] <= low + 1e-9).all()
        assert (high <= d.xpos[here] + seen._highest[here] + 1e-9).all()


def test_a_shadow_sees_what_is_left_out() -> None:
    simulation = ready("20", True)
    for _ in range(600):
        simulation.supervisor.step()
    world = simulation.world
    assert looked_at(simulation) < 1.0
    shadow = Shadow(world.m, world.d, 0.01)
    shadow.collide()
    parts = [*world.stock.contacts.solid]
    assert np.array_equal(shadow.m.body_contype[parts], world.stock.contacts.contype[parts])
    assert np.array_equal(shadow.m.body_conaffinity[parts], world.stock.contacts.conaffinity[parts])


def test_a_small_factory_is_looked_at_as_a_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(vicinity, "FEW", 250)
    simulation = ready("paper", True)
    for _ in range(100):
        simulation.supervisor.step()
        assert looked_at(simulation) == 1.0


def test_where_somebody_pushes_nothing_is_left_out() -> None:
    pushed = disturb(ready("paper", True), Push("r1/carriage", (0.0, 1.0, 0.0), 0.1, 0.1))
    handled = ready("paper", True)
    Hands(handled).push(0, 0.5, 0.1)
    for simulation in (pushed, handled):
        simulation.supervisor.step()
        assert looked_at(simulation) == 1.0
