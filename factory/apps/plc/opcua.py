"""A plant as an OPC UA server: what a controller reads and writes, its axes by the names of OPC
40010 (Robotics), and its events.

The server has a thread of its own, with which the simulation exchanges signals once in a scan, at
the pace of the clock. A controller shows that it is there by a heartbeat: without one all axes
stand, and grips and jobs stay as they are. So they do while something is written that fits no
command.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Coroutine, Sequence
from threading import Thread
from time import monotonic, sleep
from types import TracebackType
from typing import Any

from factory.api import Diagnostic, Factory, InputError, Simulation
from factory.apps.live.server import check_host
from factory.apps.plc.driven import DrivenSupervisor, drive
from factory.apps.plc.opcua_server import OpcuaServer
from factory.apps.plc.signals import Commands, Refusal, Sensed
from factory.apps.plc.written import WrittenCommands
from factory.support.version import optional

SPACE = "urn:klavins-factory:plant"
"""The namespace of its nodes."""

LOOK = 0.1
"""The axes by their names of OPC 40010 are written so often [s]."""

LATE = 0.5
"""A plant that is so far behind the clock does not catch up [s]."""

LINEAR = 3
"""OPC 40010, MotionProfile: the axis moves along a line."""


def check_plant(host: str, exposed: bool) -> Any:
    """The package that serves OPC UA. Raises InputError (BadValue) for a host other than loopback
    unless it is exposed, MissingError without the package `asyncua`."""
    check_host(host, exposed)
    return optional("asyncua", "asyncua", "an OPC UA server", "opcua")


class OpcuaPlant:
    """Lets a client of OPC UA drive a simulation that has not begun, asked every `scan` [s]; from
    when it is entered until it is left it listens at `address`. `pace`: simulated seconds in a
    second. Raises what `check_plant` does, and InputError (BadValue) where it cannot listen."""

    def __init__(
        self,
        simulation: Simulation,
        scan: float,
        host: str = "127.0.0.1",
        port: int = 0,
        exposed: bool = False,
        pace: float = 1.0,
    ) -> None:
        self._ua, self._where, self._pace = check_plant(host, exposed), (host, port), pace
        self._plant: DrivenSupervisor = drive(simulation, self, scan)
        simulation.world.hooks.busy = float("inf")
        self._written = WrittenCommands(self._ua, self._plant.interlock.commands)
        self._nodes = dict[str, Any]()
        self._begun, self._looked, self._told = float("-inf"), float("-inf"), [0, 0]
        self._stood = True
        self._loop = asyncio.new_event_loop()

    @property
    def address(self) -> str:
        """Where it listens."""
        return f"opc.tcp://{self._where[0]}:{self._where[1]}/factory"

    @property
    def refusals(self) -> Sequence[Refusal]:
        """The last commands that were refused."""
        return self._plant.refusals

    def __enter__(self) -> OpcuaPlant:
        logging.getLogger("asyncua").setLevel(logging.CRITICAL)
        Thread(target=self._serve, daemon=True).start()
        try:
            self._call(self._start())
        except OSError as error:
            message = f"cannot listen on {self.address}: {error.strerror or error}"
            hint = "choose another --port, or 0 for any that is free"
            raise InputError(Diagnostic("BadValue", message, None, hint)) from error
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._call(self._server.stop())
        self._loop.call_soon_threadsafe(self._loop.stop)

    def _serve(self) -> None:
        self._loop.run_forever()
        self._loop.close()

    def _call(self, work: Coroutine[Any, Any, Any]) -> Any:
        return asyncio.run_coroutine_threadsafe(work, self._loop).result()

    def scan(self, sensed: Sensed) -> Commands:
        """One exchange with the client, when the clock has come to it."""
        now = monotonic()
        due = self._begun + sensed.time / self._pace
        if due > now:
            sleep(due - now)
        elif now - due > LATE:
            self._begun = now - sensed.time / self._pace
        return self._call(self._exchange(sensed))  # type: ignore[no-any-return]

    # in the thread of the server

    async def _start(self) -> None:
        self._server = OpcuaServer(self._ua, self.address)
        server = self._nodes["server"] = self._server.server
        await server.init()
        space = await server.register_namespace(SPACE)
        await self._add_signals(space)
        await self._add_axes(space)
        self._nodes["event"] = await server.get_event_generator()
        await self._server.start()
        self._where = self._where[0], self._server.port

    async def _add_signals(self, space: int) -> None:
        """Inputs and outputs of the exported program, by their names there."""
        kinds, factory = self._kinds, self._plant.factory
        objects, sensed = self._nodes["server"].nodes.objects, self._plant.sensed()
        position, commands = sensed.position.tolist(), self._written.kept
        grips, jobs = [*commands.grip], [*commands.job]
        signals = {
            "Inputs": {
                "Position": (position, kinds.Double),
                "Speed": (sensed.speed.tolist(), kinds.Double),
                "Held": ([*sensed.held], kinds.Boolean),
                "Ready": ([*sensed.ready], kinds.Boolean),
            },
            "Outputs": {
                "Target": (position, kinds.Double),
                "Grip": (grips, kinds.Boolean),
                "Job": (jobs, kinds.UInt16),
                "Heartbeat": (0, kinds.UInt32),
            },
            "Plant": {
                "Time": (0.0, kinds.Double),
                "Products": (0, kinds.UInt32),
                "ProtectiveStop": (True, kinds.Boolean),
                "Refusals": (0, kinds.UInt32),
                "LastRefusal": ("", kinds.String),
                **{name: (texts, kinds.String) for name, texts in _names(factory).items()},
            },
        }
        for folder, variables in signals.items():
            parent = await objects.add_object(self._ua.ua.NodeId(folder, space), folder)
            for name, (value, kind) in variables.items():
                node = self._ua.ua.NodeId(f"{folder}.{name}", space)
                self._nodes[name] = await parent.add_variable(node, name, value, kind)
                if folder == "Outputs":
                    await self._nodes[name].set_writable()

    async def _add_axes(self, space: int) -> None:
        """A motion device for each robot, with its axes, as OPC 40010 names them."""
        objects, factory = self._nodes["server"].nodes.objects, self._plant.factory
        system = await objects.add_object(space, "MotionDeviceSystem")
        devices = await system.add_object(space, "MotionDevices")
        places = [
            await (await devices.add_object(space, robot.name)).add_object(space, "Axes")
            for robot in factory.robots
        ]
        for axis in range(len(self._written.kept.target)):
            robot = factory.robot_of(axis)
            name = f"Axis_{1 if axis == robot else 2}"
            made = await places[robot].add_object(space, name)
            await made.add_property(space, "MotionProfile", LINEAR)
            values = await made.add_object(space, "ParameterSet")
            for name in ("ActualPosition", "ActualSpeed"):
                self._nodes[f"{name} {axis}"] = await values.add_variable(space, name, 0.0)

    async def _exchange(self, sensed: Sensed) -> Commands:
        await self._write("Position", sensed.position.tolist())
        await self._write("Speed", sensed.speed.tolist())
        await self._write("Held", [*sensed.held])
        await self._write("Ready", [*sensed.ready])
        await self._write("Time", float(sensed.time))
        before, written = self._written.unfit, self._written
        commands = written.take(self._value, monotonic())
        if written.unfit not in ("", before):
            self._plant.refuse(written.unfit)
        await self._tell(sensed, commands.stop or self._plant.tripped)
        return commands

    def _value(self, name: str) -> Any:
        """What a variable holds."""
        return self._server.server.read_attribute_value(self._nodes[name].nodeid)

    @property
    def _kinds(self) -> Any:
        """The types of values."""
        return self._ua.ua.VariantType

    async def _tell(self, sensed: Sensed, stop: bool) -> None:
        """Events, refusals, and from time to time the axes."""
        plant, sent = self._plant, self._told
        refused = plant.interlock.refusals
        events, refusals = plant.events[sent[0] :], refused.since(sent[1])
        self._told = [sent[0] + len(events), refused.count]
        for message in (*(e.transition for e in events), *(r.message for r in refusals)):
            await self._server.tell(self._nodes["event"], message)
        if refusals:
            await self._write("Refusals", self._told[1], self._kinds.UInt32)
            await self._write("LastRefusal", refusals[-1].message)
        if stop != self._stood:
            self._stood = stop
            await self._write("ProtectiveStop", stop)
        if sensed.time < self._looked + LOOK:
            return
        self._looked = sensed.time
        await self._server.tidy()
        made = plant.interlock.world.delivered()
        await self._write("Products", made, self._kinds.UInt32)
        for axis, (x, v) in enumerate(zip(sensed.position, sensed.speed, strict=True)):
            await self._write(f"ActualPosition {axis}", float(x))
            await self._write(f"ActualSpeed {axis}", float(v))

    async def _write(self, name: str, value: Any, kind: Any = None) -> None:
        await self._nodes[name].write_value(value, kind)


def _names(factory: Factory) -> dict[str, Sequence[str]]:
    """What the signals are of, in their order."""
    return {
        "Axes": [axis.name for axis in factory.axes],
        "Robots": [robot.name for robot in factory.robots],
        "Stations": [*(leaf.label for leaf in factory.leaves), "outfeed"],
        "Operations": [operation.label for operation in factory.operations],
    }
