"""The ideal world: the paper's DotFactory (section 6). Robots obey ẋ = F_p(x) exactly, parts move
with the robots that carry them, transfers are instantaneous."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from factory.control.mode import Array, Index
from factory.control.navigation import Bundle
from factory.plant.factory import Operation


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
        self.time, self.supplied = 0.0, True
        self.x = np.array(start, float)
        self.v = np.zeros_like(self.x)
        self.dropoff, self.units, self.tick = dropoff, units, tick
        self.count, self.wip, self.timestep = delivered, wip, timestep
        self._plan = np.zeros((len(self.x), 4))
        self._plan[:, 1] = self.x
        self.dropoffs: list[float] = []

    def sense(self) -> tuple[Array, Array]:
        """Positions; speeds count as zero, since ẋ = F has no inertia."""
        return self.x, self.v

    def prepared(self, operation: Operation, unit: int) -> bool:
        """A feeder gives a part for every unit asked for, and that may be let in."""
        if operation.inputs:
            return True
        return unit < self.units and (self.wip is None or unit < self.count + self.wip)

    def apply(
        self, started: Sequence[tuple[Operation, int]], ended: Sequence[tuple[Operation, int]]
    ) -> None:
        """Parts follow labels; only finished products are counted."""
        for operation, _ in ended:
            if operation.index == self.dropoff:
                self.supplied = True
                self.count += 1
                self.dropoffs.append(self.time)

    def step(self, bundle: Bundle | None, axes: Index, ticks: int = 1) -> bool:
        """ẋ = F_p(x) for one tick. Whether any mode has come to its goal."""
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

    def advance(self, substeps: int) -> None:
        """Timesteps of robots that move on their own (a distributed run)."""
        self.time += substeps * self.timestep
        begun, x, v, a = self._plan.T
        tau = self.time - begun
        self.x = x + tau * (v + 0.5 * tau * a)

    def settle(self) -> None:
        """Nothing settles in an ideal world."""

    def delivered(self) -> int:
        """Products dropped off."""
        return self.count
