"""A plant at the network's mercy: whatever a client writes, subscribes to or drives, the plant goes
on, commands that fit nothing are refused, and machines that touch stop for good."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Iterable
from threading import Event, Thread
from typing import Any

import numpy as np
import pytest

from factory.apps.plc.corridors import Corridors
from factory.apps.plc.driven import DrivenSupervisor, drive
from factory.apps.plc.signals import NOBODY
from factory.engine.simulation.compiled import compiled
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from tests.apps.plc.test_plc import text
from tests.examples import with_hands
from tests.hostile_controllers import HostileController
from tests.structured_text import Plc

pytest.importorskip("asyncua", reason="the extra `opcua` is not installed")

from asyncua import Client

from factory.apps.plc.opcua import SPACE, OpcuaPlant
from tests.hostile_clients import KIND, Deaf, HostileClient

TRIES = 300
"""So often, every 20 ms, what has to come about is looked for."""


def served(talk: Callable[[OpcuaPlant], Awaitable[None]]) -> OpcuaPlant:
    """A plant while a client talks to it."""
    simulation = Simulation(with_hands("paper"), RunRequest(units=1))
    plant, done, errors = OpcuaPlant(simulation, 0.01, pace=10.0), Event(), list[BaseException]()

    def run() -> None:
        try:
            asyncio.run(asyncio.wait_for(talk(plant), 60))
        except BaseException as error:
            errors.append(error)
        done.set()

    def look(_: Any) -> None:
        if done.is_set() and simulation.world.hooks.trouble is None:
            simulation.world.hooks.trouble = simulation._trouble("Over", "the client is gone", "")

    with plant:
        Thread(target=run, daemon=True).start()
        simulation.run([look])
    if errors:
        raise errors[0]
    return plant


async def until(read: Callable[[], Awaitable[Any]], wanted: Callable[[Any], bool]) -> Any:
    """What is read, once it is as wanted, or the last that was."""
    for _ in range(TRIES):
        value = await read()
        if wanted(value):
            break
        await asyncio.sleep(0.02)
    return value


def test_a_subscription_whose_filter_fails_is_dropped() -> None:
    """It selects what an event does not have in a way that the server cannot read."""

    async def talk(plant: OpcuaPlant) -> None:
        service = plant._server.server.iserver.subscription_service

        async def count() -> int:
            return len(service.subscriptions)

        async with Client(plant.address) as client:
            made = await client.create_subscription(100, Deaf())
            await made.subscribe_events()
            for one in service.subscriptions.values():
                for item in one.monitored_item_srv._monitored_items.values():
                    item.filter = None
            space = await client.get_namespace_index(SPACE)
            beat = client.get_node(f"ns={space};s=Outputs.Heartbeat")
            await beat.write_value([1, 2], KIND.UInt32)
            assert await until(count, lambda left: not left) == 0

    served(talk)


def driven(
    controller: Any, name: str = "paper", busy: float = float("inf"), most: float = 6.0
) -> tuple[Simulation, DrivenSupervisor]:
    simulation = Simulation(with_hands(name), RunRequest(units=5))
    supervisor = drive(simulation, controller, 0.01)
    simulation.world.hooks.busy = busy
    simulation.run(max_time=most)
    return simulation, supervisor


def test_machines_that_touch_stop_for_good(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without corridors two parts are driven into each other: all axes stand from then on."""

    def anywhere(*_: Any) -> tuple[Any, Any]:
        return np.full(6, -1.0), np.full(6, 2.0)

    monkeypatch.setattr(Corridors, "bounds", anywhere)
    hostile = HostileController(with_hands("paper"), 1, Plc(text("paper")))
    simulation, supervisor = driven(hostile)
    assert simulation.world.collision
    (stop,) = (refusal for refusal in supervisor.refusals if refusal.robot == NOBODY)
    assert "touch: all axes stand until the plant is started anew" in stop.message
    assert supervisor.tripped
    assert np.abs(simulation.world.sense()[1]).max() < 1e-3


def test_a_carrier_stays_for_what_can_no_longer_stop_before_it() -> None:
    """Its lift was let go down, on its way already, after the carrier had been sent away: the lid
    came onto a shaft. One that waits at its standoff is let in only while the carrier rests."""
    layout, request = with_hands("lamp"), RunRequest(units=1)
    simulation = Simulation(layout, request)
    corridors = Corridors(layout, simulation.timing.coordinated, simulation.modes)
    factory, fired = layout.factory, [0] * len(layout.factory.net.threaded.transitions)
    tried = 0
    for operation, mode in zip(factory.operations, simulation.modes, strict=True):
        marked = [0] * len(factory.net.threaded.places)
        marked[operation.place] = 1
        axes = [*factory.moves[operation.index]]
        for slot, gate in enumerate(mode.gate.tolist()):
            standoff = float(mode.standoff[slot])
            if gate < 0 or standoff <= 0.0:
                continue
            goal, nearest = float(mode.goals[gate]), float(mode.goals[slot]) + standoff
            x = simulation.world.sense()[0].copy()
            x[axes] = mode.goals
            x[axes[slot]] = nearest
            for after in np.flatnonzero(mode.gate == slot).tolist():  # waits in its turn
                x[axes[after]] += float(mode.standoff[after])
            stops = x.copy()
            for entering, leaving in ((0.0, 0.0), (0.002, 0.0), (0.0, 0.002)):
                stops[axes[slot]], stops[axes[gate]] = nearest - entering, goal + leaving
                low, high = corridors.bounds(marked, fired, x, stops)
                stays = low[axes[gate]] == high[axes[gate]] == pytest.approx(goal)
                let_in = low[axes[slot]] < nearest - 1e-9
                assert stays or entering == 0.0
                assert stays or not let_in, "both may go"
                assert let_in == (leaving == 0.0)
                tried += 1
    assert tried >= 12


@pytest.mark.slow
@pytest.mark.parametrize("name", ["paper", "truck", "gearbox", "chest", "stool", "lamp", "family"])
def test_many_hostile_controllers_do_no_harm(name: str) -> None:
    assert harmed_by(name, range(50), 15.0) == {}


def harmed_by(name: str, seeds: Iterable[int], most: float) -> dict[int, bool]:
    """The seeds of hostile controllers under which machines touch or drop something, and whether
    the plant stopped then."""
    layout, request = with_hands(name), RunRequest(units=5)
    shared, program, harmed = compiled(layout, request), text(name), dict[int, bool]()
    for seed in seeds:
        simulation = Simulation(layout, request, shared)
        under = Plc(program) if seed % 2 else None
        supervisor = drive(simulation, HostileController(layout, seed, under), 0.01)
        simulation.world.hooks.busy = float("inf")
        simulation.run(max_time=most)
        if simulation.world.collision or simulation.world.dropped:
            harmed[seed] = supervisor.tripped
    return harmed


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100))
def test_hostile_clients_do_no_harm(seed: int) -> None:
    """Three at once, beside a program."""
    layout = with_hands("paper")
    simulation, over = Simulation(layout, RunRequest(units=50)), Event()
    plant = OpcuaPlant(simulation, 0.01, pace=5.0)
    length = max(path.length for path in layout.guidepaths)

    async def talk() -> None:
        clients = [HostileClient(plant.address, 3 * seed + n, 6, 6, length) for n in range(3)]
        await asyncio.gather(*(client.run(over.is_set) for client in clients))

    with plant:
        thread = Thread(target=lambda: asyncio.run(talk()))
        thread.start()
        simulation.run(max_time=12.0)
        over.set()
        thread.join(30)
    assert plant.refusals
    if simulation.world.collision or simulation.world.dropped:
        assert plant._plant.tripped
