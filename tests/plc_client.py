"""A PLC at the other end of a socket, for tests: an OPC UA client that runs an exported text."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from threading import Event, Thread
from types import TracebackType

import numpy as np

from factory.apps.plc.opcua import SPACE
from factory.apps.plc.signals import Sensed
from tests.structured_text import Plc

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
        self,
        address: str,
        plc: Plc,
        interval: float,
        leaves: Callable[[Sensed], bool],
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
