"""The condition of a plant that deviates: what stands, is empty, dark or slow; and how deviations
change it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Iterable
from functools import cached_property
from heapq import heappop, heappush
from typing import TYPE_CHECKING

import numpy as np

from factory.api import Diagnostic, InputError, Limits, Operation
from factory.apps.deviations.deviation import Deviation, Vector
from factory.support.arrays import Array, Index
from factory.support.errors import did_you_mean

if TYPE_CHECKING:
    from factory.api import MujocoWorld, Simulation
    from factory.apps.deviations.interference import Interference, Measure
    from factory.apps.deviations.pushes import Pushes


class Breakable(ABC):
    """What faults do to the bodies of a factory that continues after failures. A fault that acts on
    bodies is a method here, which each world implements (`apps/recovery/`)."""

    @abstractmethod
    def lose(self, robot: int) -> bool:
        """Open a robot's hand, unnoticed by the supervisor. Returns whether it held anything."""

    @abstractmethod
    def slip(self, operation: Operation, metres: float) -> None:
        """Let the last input of an operation under way slip in its hand by `metres` [m]."""

    @abstractmethod
    def spoil(self, label: str, fault: Deviation) -> None:
        """Make the part that a feeder presents defective, or misplace it."""


class PlantCondition:
    """What deviations have made of a plant so far.

    Attributes:
        standing: by robot (index), when it moves again [s].
        empty: by label, when its feeder gives parts again [s].
        dark: when the sensors report again [s].
        slowed: by robot (index), the factor on its speed where that is not 1.
        limit: sets the limits of the axes.
        draw: draws what is random of faults.
    """

    def __init__(self, simulation: Simulation, plant: Breakable | None, seed: int) -> None:
        self._simulation, self._plant = simulation, plant
        self._limits = simulation.limits
        self.limit: Callable[[Limits], None] = simulation.limit
        self.draw, self._noise = np.random.default_rng(seed), np.random.default_rng(seed)
        self._falling: list[tuple[float, int]] = []
        self._slowing: list[tuple[float, int, float]] = []
        self.standing: dict[int, float] = {}
        self.empty: dict[str, float] = {}
        self.slowed: dict[int, float] = {}
        self.dark = -np.inf

    @property
    def plant(self) -> Breakable:
        """The bodies that faults act on, where the factory continues after failures."""
        self.require_recovery()
        assert self._plant is not None
        return self._plant

    def require_recovery(self) -> None:
        """Raises InputError (BadFault) where the factory does not continue after failures."""
        if self._plant is None:
            message = "this factory does not go on after failures"
            raise InputError(Diagnostic("BadFault", message, None, "give --spares or --faults"))

    @property
    def world(self) -> MujocoWorld:
        """The world, with its bodies."""
        return self._simulation.physical

    @cached_property
    def interference(self) -> Interference:
        """The means to disturb the engine."""
        from factory.apps.deviations.interference import Interference

        return Interference(self.world)

    @cached_property
    def pushes(self) -> Pushes:
        """The pushes that act and will act."""
        from factory.apps.deviations.pushes import Pushes

        return Pushes(self.world, self.interference)

    @property
    def _now(self) -> float:
        return float(self._simulation.world.time)

    def delay(self, operation: Operation) -> float:
        """The predicted duration of an operation [s]."""
        return float(self._simulation.delays[operation.index])

    # --- single faults

    def stand(self, robot: int, until: float) -> None:
        """Stop a robot (index) until a time [s]."""
        self.standing[robot] = max(self.standing.get(robot, 0.0), until)

    def starve(self, label: str, until: float) -> None:
        """Stop a feeder until a time [s]."""
        self.empty[label] = max(self.empty.get(label, 0.0), until)

    def supply(self, label: str) -> None:
        """Let a feeder give parts again."""
        self.empty.pop(label, None)
        self._simulation.world.supplied = True

    def darken(self, until: float) -> None:
        """Blind all sensors until a time [s]."""
        self.dark = max(self.dark, until)

    def fall(self, robot: int, time: float) -> None:
        """Let a robot (index) drop its payload at a time [s]."""
        heappush(self._falling, (time, robot))

    @property
    def is_dark(self) -> bool:
        """Whether the sensors report nothing now."""
        return self._now < self.dark

    @property
    def is_waiting(self) -> bool:
        """Whether something begins or ends at a time."""
        return bool(self._slowing or self._falling or self.empty)

    def tick(self) -> int:
        """At the end of a tick, begin what is due and end what is over; returns the number of hands
        that were empty when they were to open."""
        now, missed = self._now, 0
        while self._falling and self._falling[0][0] <= now:
            missed += not self.plant.lose(heappop(self._falling)[1])
        for over in [label for label, until in self.empty.items() if until <= now]:
            self.supply(over)
        for robot in [robot for robot, until in self.standing.items() if until <= now]:
            del self.standing[robot]
        if -np.inf < self.dark <= now:
            self.dark = -np.inf
            self._simulation.world.supplied = True
        while self._slowing and self._slowing[0][0] <= now:
            self.slow(*heappop(self._slowing))
        return missed

    # --- disturbances

    def push(self, name: str, force: Vector, start: float, end: float) -> None:
        """Push a body, by name, with a force [N] from a time to another [s]."""
        m = self.world.m
        names = [m.body(n).name for n in range(1, m.nbody)]
        if name not in names:
            message = f"'push' names '{name}', which is none of the bodies"
            hint = did_you_mean(name, sorted(names), "bodies")
            raise InputError(Diagnostic("BadFault", message, None, hint))
        self.pushes.add(int(m.body(name).id), force, start, end)

    def slow(self, start: float, robot: int, factor: float) -> None:
        """Let a robot (index) move at `factor` times its speed limit from a time [s]; 1 gives it
        back."""
        if start > self._now:
            heappush(self._slowing, (start, robot, factor))
            return
        self.slowed[robot] = factor
        if factor == 1.0:
            del self.slowed[robot]
        speed = np.array(self._limits.speed)
        for number, share in self.slowed.items():
            speed[self.axes(number)] *= share
        self.limit(Limits(speed, self._limits.acceleration))

    def drag(self, robot: int, factor: float) -> None:
        """Hold a robot (index) back, to `factor` times its speed limit at full force."""
        axes = self.axes(robot)
        self.interference.drag(axes, factor * self._simulation.limits.speed[axes])

    def mismeasure_late(self, seconds: float) -> None:
        """Let all measurements be `seconds` old, to whole timesteps."""
        late = round(seconds / self.world.model.settings.step)
        self.interference.mismeasure(_late(deque(maxlen=late + 1)))

    def mismeasure_noisily(self, metres: float, speed: float) -> None:
        """Add noise to all measurements, of standard deviation `metres` [m] in positions and
        `speed` [m/s] in speeds."""
        axes, draw = self.world.motion.axes.tray, self._noise

        def measure(q: Array, v: Array) -> tuple[Array, Array]:
            return q + metres * draw.normal(size=axes), v + speed * draw.normal(size=axes)

        self.interference.mismeasure(measure)

    def parts(self, label: str) -> Iterable[int]:
        """The bodies of all copies of a part, of all parts for ""."""
        for name, bodies in self.world.parts.holdings.body.items():
            if label in ("", name, name.partition("@")[0]):
                yield from map(int, bodies)

    def axes(self, robot: int) -> Index:
        """The axes of a robot (index), of all for -1."""
        axes = self.world.motion.axes
        if robot < 0:
            return np.arange(axes.tray)
        return np.array(sorted(axes.of_robot[robot]), np.intp)


def _late(kept: deque[tuple[Array, Array]]) -> Measure:
    """The oldest of the last measurements."""

    def measure(q: Array, v: Array) -> tuple[Array, Array]:
        kept.append((q, v))
        return kept[0]

    return measure
