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
from factory.engine.simulation.compiled import Compiled
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from tests.apps.plc.test_plc import text
from tests.examples import with_hands
from tests.structured_text import Plc

pytest.importorskip("asyncua", reason="the extra `opcua` is not installed")

from dataclasses import replace
from math import inf, nan
from random import Random

from asyncua import Client, ua

from factory.apps.plc.opcua import SPACE, OpcuaPlant
from factory.apps.plc.signals import Commands, Controller, Sensed
from factory.floor.layout.layout import Layout

SOON = 0.4
"""Mean time between two changes of mind [s]."""


class HostileController:
    """Changes the commands of a controller by chance, drawn from a `seed`: targets anywhere on the
    guidepaths and beyond, jobs and grips of any kind. Of a program, it changes a few robots at a
    time."""

    def __init__(self, layout: Layout, seed: int, program: Controller | None = None) -> None:
        self._draw, self._program = Random(seed), program
        strokes = [high for _, high in layout.spans[len(layout.guidepaths) :]]
        self._ways = [*(path.length for path in layout.guidepaths), *strokes]
        self._jobs = len(layout.factory.operations)
        self._robots = len(layout.factory.robots)
        self._next, self._last = 0.0, None if program else self._idle()
        self._changes = dict[tuple[str, int], float]()

    def _idle(self) -> Commands:
        return Commands(np.zeros(len(self._ways)), (False,) * self._robots, (0,) * self._robots)

    def scan(self, sensed: Sensed) -> Commands:
        draw = self._draw
        if self._program is not None:
            self._last = self._program.scan(sensed)
        elif not self._next:
            self._last = replace(self._idle(), target=sensed.position.copy())
        if sensed.time >= self._next:
            self._next = sensed.time + draw.expovariate(1 / SOON)
            self._changes = {} if self._program else self._changes
            for _ in range(draw.randint(1, 3)):
                self._change()
        return self._changed()

    def _change(self) -> None:
        draw = self._draw
        kind = draw.choice(["target", "target", "target", "job", "grip"])
        if kind == "target":
            axis = draw.randrange(len(self._ways))
            at = draw.choice([0.0, 1.0, draw.random(), draw.random(), -1e308, 1e308, 3.0])
            self._changes[kind, axis] = at * self._ways[axis] if abs(at) <= 3.0 else at
        else:
            most = self._jobs + 2 if kind == "job" else 2
            self._changes[kind, draw.randrange(self._robots)] = draw.randrange(most)

    def _changed(self) -> Commands:
        assert self._last is not None
        target, grip, job = self._last.target.copy(), [*self._last.grip], [*self._last.job]
        for (kind, which), value in self._changes.items():
            if kind == "target":
                target[which] = value
            elif kind == "job":
                job[which] = int(value)
            else:
                grip[which] = bool(value)
        return Commands(target, tuple(grip), tuple(job))


KIND = ua.VariantType

BAD = ua.StatusCode(ua.StatusCodes.BadSensorFailure)
UNCERTAIN = ua.StatusCode(ua.StatusCodes.UncertainLastUsableValue)


def plain(value: Any, kind: Any, status: Any = None, **how: Any) -> Any:
    """A value as it is written."""
    return ua.DataValue(ua.Variant(value, kind, **how), status)


Written = tuple[str, Any, str]
"""A variable of the outputs, what is written into it, and what is told of it then."""


def unfit(axes: int, robots: int) -> dict[str, Written]:
    """What fits no command, by its kind."""
    doubles, matrix = [0.1] * axes, [[0.1] * 6] * 6
    return {
        "a heartbeat with a bad status": (
            "Heartbeat",
            plain(7, KIND.UInt32, BAD),
            "Heartbeat was written with the status BadSensorFailure: not a number of type UInt32",
        ),
        "an uncertain heartbeat": (
            "Heartbeat",
            plain(7, KIND.UInt32, UNCERTAIN),
            "status UncertainLastUsableValue",
        ),
        "a list of heartbeats": ("Heartbeat", plain([1, 2], KIND.UInt32), "Heartbeat is [1, 2]"),
        "a target with a bad status": (
            "Target",
            plain(doubles, KIND.Double, BAD),
            "Target was written with the status BadSensorFailure",
        ),
        "a matrix": ("Target", plain(matrix, KIND.Double), "Target is [["),
        "no array": ("Target", plain(0.1, KIND.Double), "Target is 0.1"),
        "too short": ("Target", plain([0.1], KIND.Double), "Target is [0.1]"),
        "too long": ("Target", plain([0.1] * (axes + 1), KIND.Double), "Target is [0.1, "),
        "empty": ("Target", plain([], KIND.Double), "Target is "),
        "nan": ("Target", plain([nan] * axes, KIND.Double), "Target is [nan"),
        "inf": ("Target", plain([inf] * axes, KIND.Double), "Target is [inf"),
        "grips with a bad status": (
            "Grip",
            plain([True] * robots, KIND.Boolean, BAD),
            "Grip was written with the status",
        ),
        "one grip": ("Grip", plain(True, KIND.Boolean), "Grip is True"),
        "a matrix of grips": (
            "Grip",
            plain([[True] * robots] * robots, KIND.Boolean),
            "Grip is [[",
        ),
        "a job": ("Job", plain(3, KIND.UInt16), "Job is 3"),
    }


MISTYPED: dict[str, tuple[str, Any]] = {
    "text": ("Target", plain("home", KIND.String)),
    "texts": ("Target", plain(["home"] * 6, KIND.String)),
    "whole numbers": ("Target", plain([1] * 6, KIND.Int64)),
    "single precision": ("Target", plain([0.1] * 6, KIND.Float)),
    "bytes": ("Grip", plain(b"\x00" * 6, KIND.ByteString)),
    "numbers for grips": ("Grip", plain([1] * 6, KIND.Byte)),
    "signed jobs": ("Job", plain([-1] * 6, KIND.Int16)),
    "a null": ("Heartbeat", plain(None, KIND.Null)),
    "no value": ("Target", ua.DataValue()),
    "a negative heartbeat": ("Heartbeat", plain(-1, KIND.Int32)),
}
"""What the protocol itself refuses: values of another type."""


class HostileClient:
    """Writes and subscribes by chance, drawn from a `seed`, at an `address`, until told to
    `stop`."""

    def __init__(self, address: str, seed: int, axes: int, robots: int, length: float) -> None:
        self._address, self._draw = address, Random(seed)
        self._axes, self._robots, self._length = axes, robots, length
        self._beat, self.writes = 0, 0

    async def run(self, stop: Callable[[], bool]) -> None:
        """Connect, do harm, leave without a word, and come back."""
        while not stop():
            client = Client(self._address, timeout=2)
            try:
                await client.connect()
                await self._harm(client, stop)
                if self._draw.random() < 0.5:
                    client.uaclient.protocol.transport.abort()
                else:
                    await client.disconnect()
            except (TimeoutError, OSError, ua.UaError, RuntimeError):
                await asyncio.sleep(0.01)

    async def _harm(self, client: Client, stop: Callable[[], bool]) -> None:
        space = await client.get_namespace_index(SPACE)
        for _ in range(self._draw.randint(5, 60)):
            if stop():
                return
            name, value = self._value()
            self._beat += 1
            beat = client.get_node(f"ns={space};s=Outputs.Heartbeat")
            try:
                await client.get_node(f"ns={space};s={name}").write_value(value)
                self.writes += 1
                await beat.write_value(self._beat, KIND.UInt32)
                if self._draw.random() < 0.1:
                    period = self._draw.choice([0, 1e-6, 10, 1e9, nan])
                    made = await client.create_subscription(period, Deaf())
                    await made.subscribe_data_change(client.get_node(f"ns={space};s=Plant.Time"))
                    await made.subscribe_events()
            except ua.UaStatusCodeError:
                pass

    def _value(self) -> tuple[str, Any]:
        draw = self._draw
        kind = draw.random()
        if kind < 0.15:
            name, value, _ = draw.choice([*unfit(self._axes, self._robots).values()])
            return f"Outputs.{name}", value
        if kind < 0.25:
            name, value = draw.choice([*MISTYPED.values()])
            return f"Outputs.{name}", value
        if kind < 0.3:
            names = ["Inputs.Position", "Plant.Time", "Plant.ProtectiveStop", "Inputs.Held"]
            return draw.choice(names), plain([0.0] * self._axes, KIND.Double)
        if kind < 0.6:
            far = draw.choice([self._length, self._length, 1e308, -1e308])
            targets = [draw.random() * far for _ in range(self._axes)]
            return "Outputs.Target", plain(targets, KIND.Double)
        if kind < 0.8:
            jobs = [draw.choice([0, 0, 1, 2, 3, 4, 5, 65535]) for _ in range(self._robots)]
            return "Outputs.Job", plain(jobs, KIND.UInt16)
        grips = [draw.random() < 0.5 for _ in range(self._robots)]
        return "Outputs.Grip", plain(grips, KIND.Boolean)


class Deaf:
    """Takes what a subscription sends."""

    def datachange_notification(self, *_: Any) -> None:
        pass

    def event_notification(self, *_: Any) -> None:
        pass


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
    corridors = Corridors(simulation.timing)
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
    shared, program, harmed = Compiled.of(layout, request), text(name), dict[int, bool]()
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
