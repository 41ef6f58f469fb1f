"""A plant at the network's mercy: whatever a client writes, subscribes to or drives, the plant goes
on, commands that fit nothing are refused, and machines that touch stop for good."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Iterable
from threading import Event, Thread
from typing import Any

import numpy as np
import pytest

from factory.apps.deviations import Deviation, deviate
from factory.apps.plc.corridors import Corridors
from factory.apps.plc.driven import DrivenSupervisor, drive
from factory.apps.plc.signals import NOBODY, Commands, Sensed
from factory.engine.simulation.compiled import compiled
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from tests.apps.plc.test_plc import text
from tests.examples import with_hands
from tests.hostile_controllers import HostileController
from tests.structured_text import Plc

pytest.importorskip("asyncua", reason="the extra `opcua` is not installed")

from asyncua import Client, ua

from factory.apps.plc import opcua_server
from factory.apps.plc.opcua import SPACE, OpcuaPlant
from tests.hostile_clients import KIND, MISTYPED, Deaf, HostileClient, plain, unfit

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


def test_what_fits_no_command_is_refused_by_name_and_the_plant_stands() -> None:
    seen = dict[str, tuple[str, bool, bool]]()

    async def talk(plant: OpcuaPlant) -> None:
        async with Client(plant.address) as client:
            space = await client.get_namespace_index(SPACE)
            nodes = {
                name: client.get_node(f"ns={space};s={folder}.{name}")
                for folder, names in (
                    ("Outputs", ("Target", "Grip", "Job", "Heartbeat")),
                    ("Plant", ("LastRefusal", "ProtectiveStop")),
                    ("Inputs", ("Position",)),
                )
                for name in names
            }
            last, stands = nodes["LastRefusal"].read_value, nodes["ProtectiveStop"].read_value
            home = await nodes["Position"].read_value()
            good = {
                "Target": plain(home, KIND.Double),
                "Grip": plain([False] * 6, KIND.Boolean),
                "Job": plain([0] * 6, KIND.UInt16),
            }
            for beat, (kind, (name, value, told)) in enumerate(unfit(6, 6).items(), start=1):
                await nodes[name].write_value(value)
                message = await until(last, lambda text, told=told: told in text)
                stood = await until(stands, lambda stop: stop)
                if name in good:
                    await nodes[name].write_value(good[name])
                await nodes["Heartbeat"].write_value(beat, KIND.UInt32)
                seen[kind] = message, stood, not await until(stands, lambda stop: not stop)
            for name, value in MISTYPED.values():
                with pytest.raises(ua.uaerrors.BadTypeMismatch):
                    await nodes[name].write_value(value)
            for name in ("Position", "LastRefusal", "ProtectiveStop"):
                with pytest.raises(ua.uaerrors.BadUserAccessDenied):
                    await nodes[name].write_value(await nodes[name].read_data_value())

    plant = served(talk)
    for kind, (_, _, told) in unfit(6, 6).items():
        message, stood, went_on = seen[kind]
        assert told in message, kind
        assert stood and went_on, kind
    assert len(plant.refusals) == len(seen)


def test_there_are_no_accounts() -> None:
    async def talk(plant: OpcuaPlant) -> None:
        for user, password in (("admin", None), ("Admin", ""), ("root", "root")):
            client = Client(plant.address)
            client.set_user(user)
            if password is not None:
                client.set_password(password)
            with pytest.raises((ua.UaError, OSError)):
                await client.connect()
        async with Client(plant.address) as client:
            with pytest.raises(ua.UaError):
                await client.nodes.objects.add_object(2, "mine")
            with pytest.raises(ua.UaError):
                await client.delete_nodes([client.nodes.objects])

    served(talk)


def test_who_is_gone_has_no_subscriptions_and_nobody_has_many(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(opcua_server, "MOST_ITEMS", 20)

    async def talk(plant: OpcuaPlant) -> None:
        taken = plant._server.server.iserver.subscription_service.subscriptions

        async def count() -> int:
            return len(taken)

        gone = [Client(plant.address) for _ in range(3)]
        for client in gone:
            await client.connect()
            for _ in range(4):
                made = await client.create_subscription(1e-6, Deaf())
                await made.subscribe_events()
        periods = {one.data.RevisedPublishingInterval for one in taken.values()}
        assert periods == {opcua_server.SHORTEST}
        assert len(taken) == 12
        for client in gone:
            client.uaclient.protocol.transport.abort()
        assert await until(count, lambda left: not left) == 0
        async with Client(plant.address) as client:
            space = await client.get_namespace_index(SPACE)
            time = client.get_node(f"ns={space};s=Plant.Time")
            kept = await client.create_subscription(100, Deaf())
            await kept.subscribe_data_change([time] * 10)
            greedy = await client.create_subscription(100, Deaf())
            await greedy.subscribe_data_change([time] * 11)
            assert await until(count, lambda left: left == 1) == 1
            assert kept.subscription_id in taken
            for _ in range(opcua_server.MOST_SUBSCRIPTIONS - 1):
                await client.create_subscription(1000, Deaf())
            with pytest.raises(ua.uaerrors.BadTooManySubscriptions):
                await client.create_subscription(1000, Deaf())

    served(talk)


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


# what is driven


def driven(
    controller: Any, name: str = "paper", busy: float = float("inf"), most: float = 6.0
) -> tuple[Simulation, DrivenSupervisor]:
    simulation = Simulation(with_hands(name), RunRequest(units=5))
    supervisor = drive(simulation, controller, 0.01)
    simulation.world.hooks.busy = busy
    simulation.run(max_time=most)
    return simulation, supervisor


class Sending:
    """A controller that sends axes to targets [m], and does nothing else."""

    def __init__(self, **targets: float) -> None:
        self._targets = {int(axis[1:]): at for axis, at in targets.items()}

    def scan(self, sensed: Sensed) -> Commands:
        target, robots = sensed.position.copy(), len(sensed.held)
        for axis, at in self._targets.items():
            target[axis] = at
        return Commands(target, (False,) * robots, (0,) * robots)


@pytest.mark.parametrize("far", [-1e308, -1.0, 1e308])
def test_targets_end_where_the_corridor_does(far: float) -> None:
    layout = with_hands("paper")
    simulation, supervisor = driven(Sending(x2=far), most=2.0)
    at, length = float(simulation.world.sense()[0][2]), layout.guidepaths[2].length
    assert -1e-3 <= at <= length + 1e-3
    (refusal,) = supervisor.refusals
    assert refusal.robot == 2
    assert refusal.message.startswith(f"r3 is sent to {far:.6g} m: it may go between ")
    assert simulation.world.collision == ""


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


def test_a_plant_in_which_a_part_is_dropped_says_that_it_stopped() -> None:
    simulation = deviate(
        Simulation(with_hands("lamp"), RunRequest(units=2)), Deviation("mass", factor=2.0)
    )
    plc = Plc(text("lamp"))
    supervisor = drive(simulation, plc, plc.interval)
    simulation.run(max_time=10.0)
    assert simulation.world.dropped is not None
    assert supervisor.tripped
    stop = supervisor.refusals[-1]
    assert stop.robot == NOBODY and stop.message.startswith("r3 drops 'shade'")
    assert "all axes stand until the plant is started anew" in stop.message


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


def test_parts_change_hands_at_rest_only() -> None:
    """A program that gives a job up on its way past the goal is refused."""
    program = text("paper")
    moving = program.replace(".Speed) < 0.0099", ".Speed) < 9.9")
    assert moving != program
    simulation = Simulation(with_hands("paper"), RunRequest(units=2))
    plc = Plc(moving.replace("< 0.0002", "< 0.0009"))
    supervisor = drive(simulation, plc, plc.interval)
    simulation.run(max_time=10.0)
    messages = [refusal.message for refusal in supervisor.refusals]
    assert any("still moves at " in message for message in messages), messages
    assert simulation.world.collision == ""


def test_hostile_controllers_do_no_harm() -> None:
    assert harmed_by("paper", range(1, 4), 6.0) == {}


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
