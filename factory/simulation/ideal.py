"""The ideal world: the paper's DotFactory (section 6). Robots obey ẋ = F_p(x) exactly, parts move
with the robots that carry them, transfers are instantaneous."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from factory.control.mode import Array, Index
from factory.control.navigation import Bundle
from factory.plant.factory import Operation
from factory.simulation.run import PhysicsFigures
from factory.simulation.world import Hooks, Job


class IdealWorld:
    """A DotFactory. Asserts that no configuration in Δ occurs: no two robots coupled by a mode
    touch."""

    def __init__(
        self,
        start: Array,
        dropoff: int,
        units: int,
        tick: float,
        delivered: int = 0,
        wip: int | None = None,
        timestep: float = 0.002,
    ) -> None:
        self.time, self.supplied, self.physics_time, self.hooks = 0.0, True, 0.0, Hooks()
        self.x = np.array(start, float)
        self.v = np.zeros_like(self.x)
        self.dropoff, self.units, self.tick = dropoff, units, tick
        self.count, self.wip, self.timestep = delivered, wip, timestep
        self._plan = np.zeros((len(self.x), 4))
        self._plan[:, 1] = self.x
        self.dropoffs: list[float] = []

    def sense(self) -> tuple[Array, Array]:
        """Positions; speeds count as zero, since ẋ = F has no inertia."""
        return self.hooks.sensed(self.x, self.v)

    def prepared(self, operation: Operation, unit: int) -> bool:
        """A feeder gives a part for every unit asked for, and that may be let in."""
        if not self.hooks.admit(operation, unit):
            return False
        if operation.inputs:
            return True
        return unit < self.units and (self.wip is None or unit < self.count + self.wip)

    def apply(self, started: Sequence[Job], ended: Sequence[Job]) -> None:
        """Parts follow labels; only finished products are counted."""
        for operation, _ in ended:
            if operation.index == self.dropoff:
                self.supplied = True
                self.count += 1
                self.dropoffs.append(self.time)

    def step(self, bundle: Bundle | None, axes: Index, ticks: int = 1) -> bool:
        """ẋ = F_p(x) for one tick. Whether any mode has come to its goal."""
        self._before_step()
        near = False
        if bundle is not None:
            x = self.x[axes]
            x = x + bundle.field(x, self.tick) * self.tick
            if not bundle.in_domain(x).all():
                raise AssertionError("a configuration in Δ: two robots touch")
            self.x[axes] = x
            near = bundle.near_goal(x, 0.0)
        self.time += self.tick
        return near

    def move(self, axes: Index, x: Array, v: Array, a: Array) -> None:
        """From now on `axes` run from x [m] at speed v under acceleration a [m/s²]."""
        self._plan[axes, 0] = self.time
        self._plan[axes, 1], self._plan[axes, 2], self._plan[axes, 3] = x, v, a

    def advance(self, steps: int) -> None:
        """Timesteps of robots that move on their own (a distributed run)."""
        self._before_step()
        self.time += steps * self.timestep
        begun, x, v, a = self._plan.T
        tau = self.time - begun
        self.x = x + tau * (v + 0.5 * tau * a)

    def settle(self) -> None:
        """Nothing settles in an ideal world."""

    def _before_step(self) -> None:
        for act in tuple(self.hooks.before_step):
            act()

    def delivered(self) -> int:
        """Products dropped off."""
        return self.count

    def unstable(self) -> str:
        """It is always stable."""
        return ""

    def figures(self) -> PhysicsFigures | None:
        """There are no bodies."""
        return None
