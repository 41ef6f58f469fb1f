"""The plant as an OPC UA server: a PLC at the other end of a socket runs the cell; what it may not
is refused by name; when it is gone, the plant stands."""

from __future__ import annotations

import asyncio
import json
import re
import shlex
import signal
import socket
import sys
from subprocess import PIPE
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from factory.apps.plc.driven import DrivenSupervisor
from factory.apps.plc.signals import Sensed
from factory.apps.runs.watched import watched
from factory.engine.record.state import State
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.run import Run
from factory.engine.simulation.simulation import Simulation
from tests.apps.plc.test_plc import text
from tests.command_line import Terminal, started
from tests.examples import with_hands
from tests.paths import PAPER, ROOT
from tests.structured_text import Plc

pytest.importorskip("asyncua", reason="the extra `opcua` is not installed")

from factory.apps.plc.opcua import SPACE, OpcuaPlant
from factory.apps.plc.opcua_server import OpcuaServer
from tests.plc_client import PlcClient

SCAN = 0.01


def plant(units: int = 3, pace: float = 1.0) -> tuple[Simulation, OpcuaPlant]:
    simulation = Simulation(with_hands("paper"), RunRequest(units=units))
    return simulation, OpcuaPlant(simulation, SCAN, pace=pace)


def ran(simulation: Simulation, max_time: float = 60.0) -> Run:
    return watched(simulation, every_tick=True, max_time=max_time)


@pytest.mark.parametrize("scan", [pytest.param(4, marks=pytest.mark.slow), 20])
def test_three_products_through_a_socket(scan: int) -> None:
    simulation, served = plant()
    plc = Plc(text("paper", scan))
    with served, PlcClient(served.address, plc, plc.interval) as client:
        made = ran(simulation)
    assert client.error == []
    assert (made.trouble, made.products) == (None, 3)
    assert served.refusals == []
    assert made.succeeded, made.verdict
    assert made.physics is not None
    assert made.physics.handoff_gap_max_mm <= 0.1


def test_when_the_client_is_gone_the_plant_stands() -> None:
    """It leaves while r3 is on its way with what it holds. Nothing moves then, and no grip opens,
    until the PLC comes back with its memory."""
    simulation, served = plant(pace=4.0)
    plc, clients, seen = Plc(text("paper", 10)), list[PlcClient](), list[tuple[float, Any, Any]]()
    world, supervisor = simulation.world, simulation.supervisor
    assert isinstance(supervisor, DrivenSupervisor)

    def leaves(sensed: Sensed) -> bool:
        return sensed.held[2] and abs(sensed.speed[2]) > 0.1

    def look(_: State) -> None:
        if not clients:
            clients.append(PlcClient(served.address, plc, 0.01, leaves).start())
        elif clients[0].gone.is_set() and len(clients) == 1:
            seen.append((world.time, world.sense()[0].copy(), supervisor.sensed().held))
            if world.time > seen[0][0] + 6.0:
                clients.append(PlcClient(served.address, plc, 0.01).start())

    with served:
        made = watched(simulation, [look], 90.0)
        for client in clients:
            client.stop()
    assert [client.error for client in clients] == [[], []]
    stood = [(x, held) for time, x, held in seen if time > seen[0][0] + 4.0]
    assert len(stood) > 100
    assert stood[0][1][2]
    assert all(np.allclose(x, stood[0][0], atol=1e-5) and held == stood[0][1] for x, held in stood)
    assert (made.trouble, made.products, supervisor.refusals) == (None, 3, [])
    assert made.succeeded, made.verdict


def test_what_may_not_be_is_refused_by_name() -> None:
    """A driver of its own kind takes a part over from afar."""
    simulation, served = plant(units=1, pace=10.0)
    plc = Plc(re.sub(r"< 0\.0002 AND", "< 0.1 AND", text("paper", 10)))
    with served, PlcClient(served.address, plc, 0.005) as client:
        ran(simulation, 8.0)
        told = asyncio.run(_read(served.address, "LastRefusal", "Refusals", "Products"))
    assert client.error == []
    message, count, products = told
    assert re.search(r"r\d is \d+\.\d mm from where it has to be, and a grip reaches 1 mm", message)
    assert count == len(served.refusals) >= 1
    assert products == 0


def test_axes_have_the_names_of_the_companion_specification() -> None:
    simulation, served = plant(units=1, pace=10.0)

    async def browse() -> list[Any]:
        from asyncua import Client

        async with Client(served.address) as client:
            space = await client.get_namespace_index(SPACE)
            path = ["MotionDeviceSystem", "MotionDevices", "r3", "Axes", "Axis_1"]
            axis = await client.nodes.objects.get_child([f"{space}:{name}" for name in path])
            names = {(await node.read_browse_name()).Name for node in await axis.get_children()}
            position = await axis.get_child([f"{space}:ParameterSet", f"{space}:ActualPosition"])
            return [names, await position.read_value()]

    with served:
        ran(simulation, 1.0)
        names, position = asyncio.run(browse())
    assert names == {"MotionProfile", "ParameterSet"}
    assert position == pytest.approx(with_hands("paper").guidepaths[2].length, abs=1e-3)


# the command


PAGE = (ROOT / "docs" / "guide" / "plc.md").read_text("utf-8")


def test_the_command_of_the_guide_runs(capfd: pytest.CaptureFixture[str]) -> None:
    (words,) = re.findall(r"^    factory (plant .*)$", PAGE, re.M)
    words = shlex.split(words.replace("4840", "0"))
    with started(*words, "--json", "--pace", 2, stdout=PIPE, text=True) as process:
        address = json.loads(process.stdout.readline())["address"]
        (script,) = re.findall(r"```python\n(.*?)```", PAGE, re.S)
        exec(script.replace("opc.tcp://127.0.0.1:4840/factory", address), {})
        plc = Plc(text("paper", 10))
        with PlcClient(address, plc, 0.005) as client:
            assert process.wait(120) == 0
    assert "Plant.Stations ['part3', 'part1', 'part2', 'outfeed']" in capfd.readouterr().out
    assert client.scans > 100


def test_nobody_comes_and_it_is_interrupted() -> None:
    with started("plant", PAPER, "--port", 0, "--json", stdout=PIPE, stderr=PIPE) as process:
        assert process.stdout.readline()
        process.send_signal(signal.SIGINT)
        assert process.wait(20) == 130


@pytest.mark.parametrize(
    ("words", "code", "hint"),
    [
        (["--host", "0.0.0.0"], "BadValue", "--expose"),
        (["--from", "wait sub3"], "Usage", "leave out --from"),
    ],
)
def test_what_is_wrong_is_said_first(
    run: Terminal, monkeypatch: pytest.MonkeyPatch, words: list[str], code: str, hint: str
) -> None:
    monkeypatch.setattr("factory.pipeline.read", None)
    done = run("plant", PAPER, *words, "--json")
    assert done.status == 2 and done.codes == [code]
    assert hint in done.json["errors"][0]["hint"]


def test_a_port_that_is_taken_is_named(run: Terminal) -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        done = run("plant", PAPER, "--port", port, "--json")
    assert done.status == 2 and done.codes == ["BadValue"]
    assert f":{port}" in done.json["errors"][0]["message"]


def test_what_is_missing_is_said(run: Terminal, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "asyncua", None)
    done = run("plant", PAPER, "--json")
    assert done.status == 3 and done.codes == ["Missing"]
    assert done.json["errors"][0]["hint"] == "pip install 'klavins-factory[opcua]'"


async def _read(address: str, *names: str) -> list[Any]:
    from asyncua import Client

    async with Client(address) as client:
        space = await client.get_namespace_index(SPACE)
        nodes = [client.get_node(f"ns={space};s=Plant.{name}") for name in names]
        return await client.read_values(nodes)


@pytest.mark.parametrize(
    ("items", "dropped"), [((600, 400), []), ((600, 401, 1), [2, 3]), ((1001,), [1])]
)
def test_the_newest_that_monitor_more_than_all_may_are_dropped(items, dropped) -> None:
    gone = list[int]()

    async def delete(numbers: list[int]) -> None:
        gone.extend(numbers)

    session = SimpleNamespace(session_id=7)
    subscriptions = {
        number: SimpleNamespace(
            session_id=7, monitored_item_srv=SimpleNamespace(_monitored_items=range(count))
        )
        for number, count in enumerate(items, 1)
    }
    service = SimpleNamespace(subscriptions=subscriptions, delete_subscriptions=delete)
    clients = [SimpleNamespace(processor=SimpleNamespace(session=session))]
    served = OpcuaServer.__new__(OpcuaServer)
    served.server = SimpleNamespace(
        iserver=SimpleNamespace(subscription_service=service),
        bserver=SimpleNamespace(clients=clients),
    )
    asyncio.run(served.tidy())
    assert gone == dropped
