"""The plant as an OPC UA server: a PLC at the other end of a socket runs the cell; what it may not
is refused by name; when it is gone, the plant stands."""

from __future__ import annotations

import asyncio
import json
import re
import shlex
import signal
import sys
from subprocess import PIPE
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from factory.apps.plc.opcua import SPACE, OpcuaPlant
from factory.apps.plc.opcua_server import OpcuaServer
from factory.apps.plc.signals import Sensed
from factory.apps.runs.watched import watched
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.run import Run
from factory.engine.simulation.simulation import Simulation
from tests.apps.plc.test_plc import text
from tests.command_line import Terminal, started
from tests.examples import with_hands
from tests.paths import PAPER, ROOT
from tests.structured_text import Plc

pytest.importorskip("asyncua", reason="the extra `opcua` is not installed")

from collections.abc import Callable
from threading import Event, Thread
from types import TracebackType

READ = ("Inputs.Position", "Inputs.Speed", "Inputs.Held", "Inputs.Ready", "Plant.Time")
WRITTEN = ("Outputs.Target", "Outputs.Grip", "Outputs.Job", "Outputs.Heartbeat")


class PlcClient:
    """Scans a controller as often as its task says, from when it is entered until it is left, or
    until `leaves` says so of what it reads. Its clock is the plant's, which may be late on a busy
    machine. `scans`: how often it has."""

    def __init__(
        self,
        address: str,
        plc: Plc,
        interval: float,
        leaves: Callable[[Sensed], bool] = lambda _: False,
    ) -> None:
        self.scans, self.error = 0, list[BaseException]()
        self.gone = Event()
        self._work = address, plc, interval, leaves
        self._thread = Thread(target=self._run, daemon=True)

    def start(self) -> PlcClient:
        self._thread.start()
        return self

    def stop(self) -> None:
        self.gone.set()
        self._thread.join(10)

    def __enter__(self) -> PlcClient:
        return self.start()

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.stop()

    def _run(self) -> None:
        try:
            asyncio.run(self._scan(*self._work))
        except BaseException as error:
            self.error.append(error)
        self.gone.set()

    async def _scan(
        self, address: str, plc: Plc, interval: float, leaves: Callable[[Sensed], bool]
    ) -> None:
        from asyncua import Client, ua

        kinds = ua.VariantType.Double, ua.VariantType.Boolean, ua.VariantType.UInt16
        async with Client(address) as client:
            space = await client.get_namespace_index(SPACE)
            read = [client.get_node(f"ns={space};s={name}") for name in READ]
            written = [client.get_node(f"ns={space};s={name}") for name in WRITTEN]
            loop = asyncio.get_running_loop()
            begun = loop.time()
            while not self.gone.is_set():
                x, v, held, ready, now = await client.read_values(read)
                sensed = Sensed(now, np.array(x), np.array(v), tuple(held), tuple(ready))
                if leaves(sensed):
                    return
                made = plc.scan(sensed)
                self.scans += 1
                values = made.target.tolist(), [*made.grip], [*made.job]
                typed = [ua.Variant(v, kind) for v, kind in zip(values, kinds, strict=True)]
                typed.append(ua.Variant(self.scans, ua.VariantType.UInt32))
                await client.write_values(written, typed)
                await asyncio.sleep(max(0.0, begun + self.scans * interval - loop.time()))


SCAN = 0.01


def plant(units: int = 3, pace: float = 1.0) -> tuple[Simulation, OpcuaPlant]:
    simulation = Simulation(with_hands("paper"), RunRequest(units=units))
    return simulation, OpcuaPlant(simulation, SCAN, pace=pace)


def ran(simulation: Simulation, max_time: float = 60.0) -> Run:
    return watched(simulation, every_tick=True, max_time=max_time)


@pytest.mark.slow
@pytest.mark.parametrize("scan", [4, 20])
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


@pytest.mark.slow
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
