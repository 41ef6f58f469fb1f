"""A client of OPC UA that means harm, for tests: whatever the protocol can carry into a variable,
and more connections and subscriptions than anybody needs."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from math import inf, nan
from random import Random
from typing import Any

from asyncua import Client, ua

from factory.apps.plc.opcua import SPACE

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
