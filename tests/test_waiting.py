"""Who waits is asked again only where something has changed that it may wait for."""

from __future__ import annotations

from typing import Any

import pytest

from factory.control.mode import Array, Truth
from factory.control.navigation import Bundle
from factory.simulation.request import RunRequest
from factory.simulation.simulation import Simulation
from factory.support.settings import Settings
from tests.test_vicinity import layout

RUNS: list[tuple[str, dict[str, Any]]] = [
    ("paper", {}),
    ("chest", {"settings": Settings(stage=1)}),
    ("gearbox", {"fuse": True}),
    ("20", {"wip": 2}),
    ("20", {"wip": 1, "fuse": True}),
    ("paper", {"settings": Settings(outfeed=0.05)}),
    ("paper", {"world": "ideal", "wip": 1}),
    ("20", {"world": "ideal", "wip": 2}),
]

LONG = 120.0
"""Four products take no more than half of it [s], or somebody waits for ever."""


@pytest.mark.parametrize(("name", "given"), RUNS)
def test_nobody_need_be_asked_twice(name: str, given: dict[str, Any]) -> None:
    """A run is the same where everybody is asked in every tick."""
    runs = [
        Simulation(layout(name), RunRequest(units=6, seed=3, jitter=0.3, **given)) for _ in range(2)
    ]
    for supervisor in (simulation.supervisor for simulation in runs):
        while supervisor.world.delivered() < 4:
            supervisor.enabled |= supervisor is runs[0].supervisor
            supervisor.step()
            assert supervisor.world.time < LONG
    asked, told = (simulation.supervisor.events for simulation in runs)
    assert asked == told


@pytest.mark.parametrize(("name", "given"), RUNS)
def test_nobody_is_asked_while_nothing_changes(name: str, given: dict[str, Any]) -> None:
    """But when something has fired, or the outfeed's tray has gone or come home."""
    simulation = Simulation(layout(name), RunRequest(units=6, **given))
    supervisor, world = simulation.supervisor, simulation.world
    prepared, asked, ticks = world.prepared, set(), 0

    def counted(*about: Any) -> bool:
        asked.add(ticks)
        return bool(prepared(*about))

    world.prepared = counted
    while world.delivered() < 4:
        supervisor.step()
        ticks += 1
        assert world.time < LONG
    changes = len({event.t for event in supervisor.events}) + 2 * world.delivered()
    assert len(asked) <= changes + 1 < ticks / 2


@pytest.mark.parametrize("world", ["ideal", "mujoco"])
def test_who_is_not_in_the_domain_yet_is_asked_again(
    world: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    inside, simulation = Bundle.in_domain, Simulation(layout("paper"), RunRequest(world))
    supervisor = simulation.supervisor

    def late(bundle: Bundle, x: Array) -> Truth:
        return inside(bundle, x) & (supervisor.world.time > 0.5)

    monkeypatch.setattr(Bundle, "in_domain", late)
    while not supervisor.events:
        supervisor.step()
        assert supervisor.world.time < 1.0
    assert supervisor.events[0].t > 0.5
