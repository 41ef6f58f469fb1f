"""A plant driven by a controller through signals, as by a PLC: axis targets, grips and jobs in;
positions and sensors out. The controller decides what the net leaves open; the plant's interlock
refuses forbidden commands."""

from __future__ import annotations

from factory.control.mode import Limits
from factory.plant.factory import Factory, Operation
from factory.record.state import Event
from factory.simulation.interlock import PlantInterlock
from factory.simulation.ordering import Ordering
from factory.simulation.signals import AxisDrives, Controller, Refusal, Sensed
from factory.simulation.supervisor import Active
from factory.support.settings import Settings


class DrivenSupervisor:
    """Lets a `controller` drive a plant through its `interlock`, asking it every `scan` [s],
    rounded to whole timesteps."""

    def __init__(
        self,
        interlock: PlantInterlock,
        limits: Limits,
        settings: Settings,
        controller: Controller,
        scan: float,
    ) -> None:
        self.interlock, self._controller = interlock, controller
        self._steps, self._period = settings.steps, max(1, round(scan / settings.step))
        self.drives = AxisDrives(interlock.commands.target, limits, self._period * settings.step)
        self._count = 0

    @property
    def factory(self) -> Factory:
        """The driven factory."""
        return self.interlock.factory

    @property
    def ordering(self) -> Ordering:
        """The order places that are enforced."""
        return self.interlock.ordering

    @property
    def events(self) -> list[Event]:
        """The record so far."""
        return self.interlock.events

    @property
    def refusals(self) -> list[Refusal]:
        """All commands that were refused."""
        return self.interlock.refusals

    @property
    def marked(self) -> bytearray:
        """1 for each place that is marked, 0 for the others."""
        return self.interlock.marked

    @property
    def active(self) -> Active:
        """The operations under way."""
        return Active(tuple(o.index for o in self.factory.operations if self.marked[o.place]))

    def awaited(self) -> list[Operation]:
        """The operations all of whose robots wait for them."""
        possible = self.interlock.threads.possible
        return [self.factory.operations[event // 2] for event in sorted(possible)]

    def limit(self, limits: Limits) -> None:
        """Set the limits of the axes."""
        self.drives.limits = limits

    def step(self, ticks: int = 1) -> None:
        """Advance the world by a tick, with a scan of the controller at each of its times."""
        world, end = self.interlock.world, self._count + self._steps
        while self._count < end:
            if self._count % self._period == 0:
                self._scan()
            steps = min(self._period - self._count % self._period, end - self._count)
            world.advance(steps)
            self._count += steps
        world.settle()

    def coast(self, ticks: int = 1) -> None:
        """Advance by a tick without scans."""
        self.interlock.world.advance(self._steps)
        self.interlock.world.settle()

    def sensed(self) -> Sensed:
        """What the controller reads now."""
        interlock, factory = self.interlock, self.factory
        held = tuple(map(interlock.held, range(len(factory.robots))))
        leaves = tuple(map(interlock.ready, factory.leaves))
        outfeed = any(map(interlock.ready, factory.dropoffs))
        return Sensed(interlock.world.time, *interlock.world.sense(), held, (*leaves, outfeed))

    def _scan(self) -> None:
        """Scan the controller, carry out its permitted commands, and move the drives; robots that
        the interlock holds stand."""
        commands = self._controller.scan(self.sensed())
        self.interlock.carry_out(commands)
        drives, back, stops = self.drives, self.interlock.held_back, self.drives.stops
        for axis, target in enumerate(commands.target.tolist()):
            stands = commands.stop or self.factory.robot_of(axis) in back
            drives.target[axis] = stops[axis] if stands else target
        drives.go(self.interlock.world)
