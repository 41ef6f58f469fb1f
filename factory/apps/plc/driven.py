"""A plant driven by a controller through signals, as by a PLC: axis targets, grips and jobs in;
positions and sensors out. The controller decides what the net leaves open; the plant's interlock
refuses forbidden commands."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from factory.api import Event, Factory, Limits, Operation, Settings
from factory.apps.plc.corridors import SLACK
from factory.apps.plc.interlock import PlantInterlock
from factory.apps.plc.signals import NOBODY, AxisDrives, Commands, Controller, Refusal, Sensed
from factory.support.arrays import Array

if TYPE_CHECKING:
    from factory.api import Simulation


class DrivenSupervisor:
    """Lets a `controller` drive a plant through its `interlock`, asking it every `scan` [s],
    rounded to whole timesteps. The plant looks every tick, however seldom it is asked: no axis
    leaves its corridor, and after a contact that is not meant, or a dropped part, all axes stand
    for good: `tripped`."""

    def __init__(
        self,
        interlock: PlantInterlock,
        limits: Limits,
        settings: Settings,
        controller: Controller,
        scan: float,
    ) -> None:
        self.interlock, self._controller = interlock, controller
        self.ordering = interlock.ordering
        self.tripped, self._astray = False, set[int]()
        self._steps, self._period = settings.steps, max(1, round(scan / settings.step))
        self._look = min(self._period, settings.steps)
        self.drives = AxisDrives(interlock.commands.target, limits, self._look * settings.step)
        self._count = 0

    @property
    def factory(self) -> Factory:
        """The driven factory."""
        return self.interlock.factory

    @property
    def events(self) -> list[Event]:
        """The record so far."""
        return self.interlock.events

    @property
    def refusals(self) -> list[Refusal]:
        """The last commands that were refused."""
        return list(self.interlock.refusals.last)

    @property
    def marked(self) -> bytearray:
        """1 for each place that is marked, 0 for the others."""
        return self.interlock.marked

    @property
    def under_way(self) -> tuple[int, ...]:
        """The operations (index) under way."""
        return tuple(o.index for o in self.factory.operations if self.marked[o.place])

    def awaited(self) -> list[Operation]:
        """The operations all of whose robots wait for them."""
        possible = self.interlock.threads.possible
        return [self.factory.operation_of(event) for event in sorted(possible)]

    def limit(self, limits: Limits) -> None:
        """Set the limits of the axes."""
        self.drives.limits = limits

    def step(self, ticks: int = 1) -> None:
        """Advance the world by a tick, with a scan of the controller at each of its times, and of
        the plant at its own."""
        world, end = self.interlock.world, self._count + self._steps
        while self._count < end:
            scanned = self._count % self._period == 0
            if scanned:
                self.interlock.carry_out(self._controller.scan(self.sensed()))
            if self._count % self._look == 0:
                self._move(scanned)
            left = (every - self._count % every for every in (self._period, self._look))
            steps = min(*left, end - self._count)
            world.advance(steps)
            self._count += steps
        world.settle()

    def coast(self, ticks: int = 1) -> None:
        """Advance by a tick without scans, after a part was dropped: the plant has stopped."""
        self._trip()
        self.interlock.world.advance(self._steps)
        self.interlock.world.settle()

    def sensed(self) -> Sensed:
        """What the controller reads now."""
        interlock, factory = self.interlock, self.factory
        held = tuple(map(interlock.held, range(len(factory.robots))))
        leaves = tuple(map(interlock.ready, factory.leaves))
        outfeed = any(map(interlock.ready, factory.dropoffs))
        return Sensed(interlock.world.time, *interlock.world.sense(), held, (*leaves, outfeed))

    def corridor(self) -> tuple[Array, Array]:
        """The lowest and the highest place that each axis may go to now (n,) [m]."""
        interlock = self.interlock
        low, high = interlock.corridors.bounds(
            interlock.marked, interlock.fired, interlock.world.sense()[0], self.drives.stops
        )
        return low, np.maximum(low, high)

    def refuse(self, message: str) -> None:
        """Refuse what concerns no single robot."""
        self.interlock.refusals.add(Refusal(self.interlock.world.time, NOBODY, message))

    @property
    def scans(self) -> tuple[()]:
        """None: what the controller does is not known before."""
        return ()

    def _move(self, scanned: bool) -> None:
        """Move the drives to the commanded targets as far as they may go; robots that the interlock
        holds stand. A target is refused when it is `scanned`, if at all."""
        self._trip()
        commands = self.interlock.commands
        drives, back, stops = self.drives, self.interlock.held_back, self.drives.stops
        target, astray = self._confined(commands)
        if scanned:
            self._tell(astray)
        for axis, where in enumerate(target.tolist()):
            stands = commands.stop or self.tripped or self.factory.robot_of(axis) in back
            drives.target[axis] = stops[axis] if stands else where
        drives.go(self.interlock.world)

    def _trip(self) -> None:
        """Stop for good where bodies touch that are not meant to, or one was dropped."""
        world = self.interlock.world
        why = f"{touch} touch" if (touch := world.collision) else ""
        if world.dropped is not None:
            why = world.dropped.diagnostic.message
        if why and not self.tripped:
            self.tripped = True
            self.refuse(f"{why}: all axes stand until the plant is started anew")

    def _confined(self, commands: Commands) -> tuple[Array, dict[int, str]]:
        """The targets in their corridors, and what is said of those that are not, by axis."""
        low, high = self.corridor()
        confined, astray = np.clip(commands.target, low, high), dict[int, str]()
        for axis in np.flatnonzero(np.abs(confined - commands.target) > SLACK).tolist():
            robot = self.factory.robot_of(axis)
            name = self.factory.robots[robot].name + (" lift" if axis != robot else "")
            ends = f"between {low[axis]:.3f} m and {high[axis]:.3f} m now"
            astray[axis] = f"{name} is sent to {commands.target[axis]:.6g} m: it may go {ends}"
        return confined, astray

    def _tell(self, astray: dict[int, str]) -> None:
        """Refuse targets that are not in their corridors, once each."""
        now = self.interlock.world.time
        for axis in sorted(astray.keys() - self._astray):
            refusal = Refusal(now, self.factory.robot_of(axis), astray[axis])
            self.interlock.refusals.add(refusal)
        self._astray = {*astray}


def drive(simulation: Simulation, controller: Controller, scan: float) -> DrivenSupervisor:
    """Let a controller drive the plant of a simulation from the start, asked every `scan` [s]."""
    settings, interlock = simulation.request.settings, PlantInterlock(simulation)
    driven = DrivenSupervisor(interlock, simulation.limits, settings, controller, scan)
    simulation.supervisor = driven
    return driven
