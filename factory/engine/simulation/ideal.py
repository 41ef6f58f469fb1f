"""The ideal world: the paper's DotFactory (section 6). Robots obey ẋ = F_p(x) exactly, parts move
with the robots that carry them, transfers are instantaneous."""

from __future__ import annotations

from collections.abc import Collection, Container, Mapping, Sequence

import numpy as np

from factory.engine.record.figures import PhysicsFigures
from factory.engine.record.state import Observation
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.world import Hooks, Job
from factory.engine.timing.demand import Word
from factory.floor.layout.layout import Layout
from factory.support.arrays import Array, Index
from factory.theory.control.navigation import Bundle
from factory.theory.nets.coordinated import Past
from factory.theory.plant.operation import Operation


class IdealWorld:
    """A DotFactory. Asserts that no configuration in Δ occurs: no two robots coupled by a mode
    touch."""

    lacking: Container[str] = ()
    collision = ""
    instant = True
    _nothing = np.empty(0), np.empty((0, 3), np.intp)

    def __init__(
        self, layout: Layout, request: RunRequest, start: Array, counts: Mapping[int, int]
    ) -> None:
        self.time, self.supplied, self.physics_time, self.hooks = 0.0, True, 0.0, Hooks()
        self.x = np.array(start, float)
        self.v = np.zeros_like(self.x)
        self._factory, self._request = layout.factory, request
        before = layout.factory.units(counts)
        asked = request.demand, before + request.units, request.wip
        self.word = Word(self._factory.sequence, *asked, made=before)
        self._plan = np.zeros((len(self.x), 4))
        self._plan[:, 1] = self.x
        self.dropoffs: list[float] = []

    def sense(self) -> tuple[Array, Array]:
        """Positions; speeds count as zero, since ẋ = F has no inertia."""
        return self.hooks.sensed(self.x, self.v)

    def observe(self, at_end: bool = False) -> Observation:
        """Positions and speeds of all axes."""
        return Observation(self.time, self.x, self.v, *self._nothing, at_end)

    def prepared(self, operation: Operation, unit: int) -> bool:
        """A feeder gives a part for every unit asked for, and that may be let in."""
        if not self.hooks.admit(operation, unit):
            return False
        wanted = self.word.demand is not None or unit < self.word.most
        return bool(operation.inputs) or (wanted and self.word.lets_in(unit))

    def arrive(self, operations: Sequence[Operation]) -> None:
        """Nothing takes hold of parts."""

    def apply(self, started: Sequence[Job], ended: Sequence[Job]) -> None:
        """Parts follow labels; only finished products are counted."""
        for operation, _ in ended:
            if self._factory.drops(operation.index):
                self.supplied = True
                self.word.made += 1
                self.dropoffs.append(self.time)

    def step(
        self, bundle: Bundle | None, axes: Index, ticks: int = 1, until: Collection[Past] = ()
    ) -> bool:
        """ẋ = F_p(x) for one tick. Whether any mode has come to its goal."""
        self._before_step()
        near = False
        if bundle is not None:
            x = self.x[axes]
            x = x + bundle.field(x, self._request.settings.tick) * self._request.settings.tick
            if not bundle.in_domain(x).all():
                raise AssertionError("a configuration in Δ: two robots touch")
            self.x[axes] = x
            near = bundle.near_goal(x, 0.0)
        self.time += self._request.settings.tick
        return near

    def move(self, axes: Index, x: Array, v: Array, a: Array) -> None:
        """From now on `axes` run from x [m] at speed v under acceleration a [m/s²]."""
        self._plan[axes, 0] = self.time
        self._plan[axes, 1], self._plan[axes, 2], self._plan[axes, 3] = x, v, a

    def advance(self, steps: int) -> None:
        """Timesteps of robots that move on their own (a distributed run)."""
        self._before_step()
        self.time += steps * self._request.settings.step
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
        return self.word.made

    def unstable(self) -> str:
        """It is always stable."""
        return ""

    @property
    def dropped(self) -> None:
        """Nothing is ever dropped."""

    def figures(self) -> PhysicsFigures | None:
        """There are no bodies."""
        return None
