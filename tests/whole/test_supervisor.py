"""The supervisor: what waits is asked for again only where something has changed that it may wait
for; clocks go on; nothing fires that is not enabled."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from factory.engine.simulation.mujoco.feeders import Feeders
from factory.engine.simulation.mujoco.world import MujocoWorld
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.support.arrays import Array, Truth
from factory.support.settings import Settings
from factory.theory.control.navigation import Bundle
from tests.pag_texts import KARY, laid_out
from tests.simulation_values import layout_of

RUNS: list[Any] = [
    ("paper", {}),
    pytest.param("chest", {"settings": Settings(stage=1)}, marks=pytest.mark.slow),
    pytest.param("truck", {"fuse": True}, marks=pytest.mark.slow),
    ("20", {"wip": 1, "fuse": True}),
    ("paper", {"settings": Settings(outfeed=0.05)}),
    ("paper", {"world": "ideal", "wip": 1}),
]

LONG = 120.0
"""Four products take no more than half of it [s], or a robot waits for ever."""


@pytest.mark.parametrize(("name", "given"), RUNS)
def test_no_question_need_be_asked_twice(name: str, given: dict[str, Any]) -> None:
    """A run is the same where every operation is asked about in every tick."""
    runs = [
        Simulation(layout_of(name), RunRequest(units=6, seed=3, jitter=0.3, **given))
        for _ in range(2)
    ]
    for supervisor in (simulation.supervisor for simulation in runs):
        while supervisor.world.delivered() < 4:
            supervisor.enabled |= supervisor is runs[0].supervisor
            supervisor.step()
            assert supervisor.world.time < LONG
    asked, told = (simulation.supervisor.events for simulation in runs)
    assert asked == told


@pytest.mark.parametrize(("name", "given"), RUNS)
def test_nothing_is_asked_while_nothing_changes(
    name: str, given: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """But when something has fired, the outfeed's tray has gone or come home, a part that is waited
    for comes down or is about to be there, or a hand that is waited for has gone."""
    changed, tend = list[str](), Feeders.tend

    def told(what: str, change: bool) -> bool:
        changed.extend([what] * change)
        return change

    monkeypatch.setattr(Feeders, "tend", lambda *given: told("part", tend(*given)))
    simulation = Simulation(layout_of(name), RunRequest(units=6, **given))
    supervisor, world = simulation.supervisor, simulation.world
    asked, ticks = set(), 0

    def gate(*_: Any) -> bool:
        asked.add(ticks)
        return True

    world.hooks.gates.append(gate)
    while world.delivered() < 4:
        due = _due(world)
        supervisor.step()
        told("hand", bool(supervisor.ordering.held) and supervisor.enabled)
        ticks += 1
        told("there", due <= world.time + 1e-6)
        assert world.time < LONG
    changes = len({event.t for event in supervisor.events}) + 2 * world.delivered()
    assert len(asked) <= changes + len(changed) + 1 < ticks / 2
    waits = name in ("chest", "truck") and isinstance(world, MujocoWorld)
    assert ("hand" in changed) is waits


def _due(world: Any) -> float:
    """When a part that is waited for is about to be there [s]; never in the ideal world."""
    return world.parts.feeders.due if isinstance(world, MujocoWorld) else np.inf


@pytest.mark.parametrize("world", ["ideal", "mujoco"])
def test_what_is_not_in_the_domain_yet_is_asked_for_again(
    world: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    inside, simulation = Bundle.in_domain, Simulation(layout_of("paper"), RunRequest(world))
    supervisor = simulation.supervisor

    def late(bundle: Bundle, x: Array) -> Truth:
        return inside(bundle, x) & (supervisor.world.time > 0.5)

    monkeypatch.setattr(Bundle, "in_domain", late)
    while not supervisor.events:
        supervisor.step()
        assert supervisor.world.time < 1.0
    assert supervisor.events[0].t > 0.5


def test_clocks_go_on_when_other_modes_begin() -> None:
    simulation = Simulation(laid_out(KARY), RunRequest(units=2))
    supervisor = simulation.supervisor
    while len(supervisor.active.operations) < 2 or not any(_clocks(supervisor).values()):
        supervisor.step()
    active, run = supervisor.active, _clocks(supervisor)
    supervisor._activate(reversed(active.operations), reversed(active.ahead))
    assert _clocks(supervisor) == run


def _clocks(supervisor: Any) -> dict[int, float]:
    """The clock [s] of every mode under way, by its number."""
    active = supervisor.active
    if active.clocks is None:
        return {}
    numbers = (*active.operations, *active.ahead)
    return dict(zip(numbers, active.clocks.tolist(), strict=True))


def test_an_event_that_is_not_enabled_cannot_fire() -> None:
    """Planted fault: the supervisor is made to end an operation that has not begun."""
    simulation = Simulation(layout_of("paper"), RunRequest("ideal", units=1))
    sub3 = simulation.layout.factory.by_label["sub3"].index
    with pytest.raises(AssertionError, match="not all are enabled that fire: sub3_e"):
        simulation.supervisor._fire([], [sub3])
