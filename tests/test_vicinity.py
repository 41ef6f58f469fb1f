"""What the broad phase is spared: a run is the same to the last bit, also where things collide."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from factory.disturbance import Push, disturb
from factory.disturbance.hands import Hands
from factory.layout.plan import Layout
from factory.simulation import Simulation
from factory.world import vicinity
from factory.world.vicinity import Vicinity
from tests.bench.factories import balanced
from tests.bench.factories import laid_out as floor_of
from tests.test_fuse import layout_of


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


def test_who_sees_only_what_moves_misses_collisions(monkeypatch: pytest.MonkeyPatch) -> None:
    reached = Vicinity._reached

    def short_sighted(self: Vicinity, bodies: np.ndarray) -> np.ndarray:
        near = np.zeros_like(reached(self, bodies))
        near[self.holder[bodies]] = True
        return near

    monkeypatch.setattr(Vicinity, "_reached", short_sighted)
    assert any(crash(seed, True) != crash(seed, False) for seed in range(4))


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
