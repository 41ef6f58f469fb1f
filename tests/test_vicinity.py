"""What the broad phase is spared: a run is the same to the last bit, also where things collide."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from factory.simulation.disturbance.hands import Hands
from factory.simulation.mujoco.fast.broad_phase import CALM, SWAY, Vicinity
from factory.simulation.mujoco.fast.swept_boxes import CELL, Reach
from factory.simulation.mujoco.loads import Load, loads

from factory.layout.layout import Layout
from factory.simulation.disturbance import Push, disturb
from factory.simulation.mujoco import parts as stock
from factory.simulation.mujoco.contacts import NOBODY
from factory.simulation.mujoco.fast import broad_phase as vicinity
from factory.simulation.mujoco.parts import Stock
from factory.simulation.request import RunRequest
from factory.simulation.simulation import Simulation
from factory.study.fidelity.readings import Shadow
from factory.support.engine import mujoco
from factory.support.settings import MOST, Settings
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
    simulation = Simulation(layout(name), RunRequest(units=2, seed=3, jitter=0.3, **given))  # type: ignore[arg-type]
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


def test_a_view_is_the_same_when_it_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    kept, made = (Simulation(layout("20"), RunRequest(units=6)) for _ in range(2))
    expected = [*seen(kept, 1200)]
    monkeypatch.setattr(vicinity, "KEPT", 1)
    looks = counted(made.world.vicinity)
    assert [*seen(made, 1200)] == expected
    assert len(made.world.vicinity._views) == 1 < len(kept.world.vicinity._views) < 0.9 * looks[0]


def seen(simulation: Simulation, ticks: int) -> Iterator[bytes]:
    """Where everything is after each tick, and what the broad phase has looked at."""
    world = simulation.world
    for _ in range(ticks):
        simulation.supervisor.step()
        yield world.d.qpos.tobytes() + world.m.body_contype.tobytes()


def counted(vicinity: Vicinity) -> list[int]:
    """How often it has looked since."""
    looks, look = [0], vicinity.look

    def counting() -> None:
        looks[0] += 1
        look()

    vicinity.look = counting  # type: ignore[method-assign]
    return looks


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


def overlooked_in(name: str, **given: object) -> set[str]:
    """In a run in which all goes well."""
    simulation, found = ready(name, True, **given), set[str]()
    contacts = simulation.world.stock.contacts

    def step(m: mujoco.MjModel, d: mujoco.MjData, steps: int = 1) -> None:
        for _ in range(steps):
            mujoco.mj_step(m, d)
            found.update(overlooked(m, d, contacts))

    with stepping(step):
        while simulation.world.time < 5.0:
            simulation.supervisor.step(MOST)
    return found


RUNS: list[tuple[str, dict[str, Any]]] = [
    ("paper", {}),
    ("gearbox", {}),
    ("gearbox", {"fuse": True}),
    ("20", {"settings": Settings(stage=1)}),
    ("20", {"fuse": True}),
]


@pytest.mark.parametrize(("name", "given"), RUNS)
def test_nothing_that_anybody_meets_on_its_way_is_overlooked(
    name: str, given: dict[str, Any]
) -> None:
    assert overlooked_in(name, **given) == set()


@pytest.mark.parametrize("calm", [CALM, 0.0])
def test_everything_is_looked_at_from_where_anything_touches(
    calm: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And for a while; who is calm at once does not see it."""
    monkeypatch.setattr(vicinity, "CALM", calm)
    simulation, shares = ready("shelf", True, settings=Settings(timestep=0.004)), list[float]()
    touched = [-np.inf]

    def step(m: mujoco.MjModel, d: mujoco.MjData, steps: int = 1) -> None:
        if d.ncon:
            touched.append(d.time)
        if d.time < touched[-1] + 0.9 * CALM:
            shares.append(looked_at(simulation))
        mujoco.mj_step(m, d, steps)

    with stepping(step):
        while simulation.world.time < 8.0:
            simulation.supervisor.step(MOST)
    assert shares and (min(shares) == 1.0) == (calm > 0.0)


def test_who_sees_only_what_moves_overlooks_what_is_near(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Reach, "_meets", lambda *_: 0)
    assert overlooked_in("20")


def test_who_forgets_what_is_carried_overlooks_what_is_near_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def forgotten(*given: Any) -> dict[tuple[int, str], Load]:
        return {key: replace(load, welds=()) for key, load in loads(*given).items()}

    monkeypatch.setattr(stock, "loads", forgotten)
    assert overlooked_in("chest")


def stay_at_home(monkeypatch: pytest.MonkeyPatch) -> None:
    """Everybody goes somewhere else than was foreseen: nobody was to go anywhere."""
    goes = Vicinity.goes
    monkeypatch.setattr(Vicinity, "goes", lambda self, who, x, v, _: goes(self, who, x, 0 * v, x))


def test_who_leaves_the_way_that_was_foreseen_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    stay_at_home(monkeypatch)
    assert overlooked_in("chest") == set()


def test_who_does_not_watch_overlooks_what_is_met_on_other_ways(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    stay_at_home(monkeypatch)
    monkeypatch.setattr(Vicinity, "holds", lambda _: True)
    assert overlooked_in("chest")


def test_who_is_where_it_was_not_to_be_has_everything_looked_at(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """At rest there it would be overlooked by all others."""

    def never_far(*given: Any) -> dict[tuple[int, str], Load]:
        return {key: replace(load, high=load.low) for key, load in loads(*given).items()}

    monkeypatch.setattr(stock, "loads", never_far)
    simulation = ready("chest", True)
    assert simulation.run(max_time=3.0).events
    assert simulation.world.vicinity.reach.beyond and looked_at(simulation) == 1.0


def set_off(seed: int, culls: bool) -> tuple[list[bytes], int]:
    """Some robots run wherever they like, as those gone wild, and nobody has been told."""
    simulation = ready("20", culls)
    world, rng = simulation.world, np.random.default_rng(seed)
    for _ in range(100):
        simulation.supervisor.step()
    axes = rng.choice(world.tray, 6, replace=False)
    x, v = world.reference[axes], rng.uniform(-0.5, 0.5, 6)
    world.setpoints.move(axes, x, v, np.zeros(6))
    for axis in axes:
        world._attend(np.array([axis]), np.array([True]))
    found = states(simulation, lambda: world.advance(5), 150)
    return found, len(world.inspection.unintended)


@pytest.mark.parametrize("seed", range(3))
def test_a_collision_off_all_ways_is_the_same_to_the_last_bit(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Even if nobody was to meet anybody."""
    monkeypatch.setattr(Reach, "_meets", lambda *_: 0)
    whole, touched = set_off(seed, False)
    assert touched
    assert set_off(seed, True) == (whole, touched)


def test_who_does_not_watch_overlooks_a_collision(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Reach, "_meets", lambda *_: 0)
    monkeypatch.setattr(Vicinity, "holds", lambda _: True)
    assert any(set_off(seed, True) != set_off(seed, False) for seed in range(3))


def test_what_the_engine_wakes_by_itself_is_seen_a_tick_later() -> None:
    simulation = ready("20", True)
    for _ in range(600):
        simulation.supervisor.step()
    world = simulation.world
    m, d, collides = world.m, world.d, world.stock.contacts.collides
    sleeps = collides & (m.body_contype == 0) & (d.body_awake == 0)
    body = int(np.flatnonzero(sleeps)[0])
    d.xfrc_applied[body, 2] = 1e-6
    world.advance(1)
    assert d.body_awake[body] == IS_AWAKE
    world.advance(1)
    assert m.body_contype[body] | m.body_conaffinity[body]


def within_boxes(simulation: Simulation) -> bool:
    """Whether all that holders have is within the boxes that are foreseen for them."""
    world = simulation.world
    m, d, seen, contacts = world.m, world.d, world.vicinity, world.stock.contacts
    mujoco.mj_kinematics(m, d)
    bodies = np.flatnonzero(contacts.collides & (contacts.code != NOBODY))
    holder = contacts.code[bodies]
    low, high = boxes(m, d, bodies).transpose(1, 0, 2)
    place = np.where(seen.reach.address < 0, 0.0, d.qpos[seen.reach.address])[holder]
    box = seen.reach._between(seen._ways[0, holder], place, place) + SWAY
    most = seen.reach._most[:, holder] + 2 * SWAY
    return bool((box >= np.hstack([high[:, :2], -low[:, :2]]).T).all() and (box <= most).all())


@pytest.mark.parametrize("fuse", [False, True])
def test_what_a_holder_has_is_within_its_box(fuse: bool) -> None:
    simulation = ready("gearbox", True, fuse=fuse)
    for _ in range(60):
        for _ in range(10):
            simulation.supervisor.step()
        assert within_boxes(simulation)


def under_way(name: str) -> frozenset[int]:
    """A marking in which robots carry parts."""
    supervisor = ready(name, True).supervisor
    while supervisor.world.time < 3.0:
        supervisor.step()
    return frozenset(place for place, marked in enumerate(supervisor.marked) if marked)


def test_what_a_run_starts_with_is_within_boxes(monkeypatch: pytest.MonkeyPatch) -> None:
    """And is not where that is forgotten."""
    start, reach = under_way("chest"), Stock._reach
    assert within_boxes(ready("chest", True, start=start))
    monkeypatch.setattr(Stock, "_reach", lambda self, holders, _: reach(self, holders, False))
    assert not within_boxes(ready("chest", True, start=start))


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


def test_who_goes_elsewhere_is_heard_beside_who_goes_on() -> None:
    seen = ready("20", True).world.vicinity
    both, x, rest = np.array([1, 2]), np.array([0.1, 0.1]), np.zeros(2)
    seen.goes(both, x, rest, np.array([0.3, 0.4]))
    seen.look()
    seen.goes(both, x + 0.1, rest, np.array([0.3, 0.4]))
    assert not seen.stale, "nobody goes elsewhere"
    seen.goes(both, x + 0.1, rest, np.array([0.3, 0.5]))
    assert seen.stale
    low, high = seen._ways[1:, both] * CELL
    assert np.allclose(low, (0.1, 0.2), atol=2 * CELL)
    assert np.allclose(high, (0.3, 0.5), atol=2 * CELL)
