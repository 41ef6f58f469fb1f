"""How the engine is stepped: one timestep a call here; `fast/` does the same in fewer calls."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from time import perf_counter
from typing import Protocol

from factory.control.mode import Index
from factory.simulation.mujoco.courses import Course
from factory.simulation.mujoco.inspection import Inspection
from factory.simulation.world import Hooks
from factory.support.engine import mujoco
from factory.support.settings import Settings


class Stepping(Protocol):
    """Steps the engine and plans courses. Whoever does it, a run is the same, to the last bit.

    `at_once`: how many ticks go to the engine in one call, at most. `seconds`: spent in the
    engine's steps.
    """

    at_once: int
    seconds: float

    def turn(self, active: Index) -> None:
        """These axes move from now on, and no others."""

    def follow(self, axes: Index, course: Course) -> None:
        """Axes follow a course from now on."""

    def advance(self, steps: int) -> None:
        """Some timesteps; what touches in any of them is inspected."""

    def course(self, begin: Hashable, make: Callable[[], Course]) -> Course:
        """The course that `make` gives; `begin` is all that it depends on."""


class SingleSteps:
    """One timestep a call, one tick at a time, every course planned anew."""

    at_once = 1

    def __init__(
        self,
        m: mujoco.MjModel,
        d: mujoco.MjData,
        inspection: Inspection,
        hooks: Hooks,
        settings: Settings,
    ) -> None:
        self.m, self.d, self.seconds = m, d, 0.0
        self.hooks, self.inspection, self._substeps = hooks, inspection, settings.steps

    def turn(self, active: Index) -> None:
        """All bodies are looked at, whatever moves."""

    def follow(self, axes: Index, course: Course) -> None:
        """All bodies are looked at, wherever it leads."""

    def advance(self, steps: int) -> None:
        """Some timesteps; hooks are called before each."""
        for number in range(steps):
            if number and number % self._substeps == 0:
                self.inspection.tick()
            for act in tuple(self.hooks.before_step):
                act()
            self.step(1)
            if self.d.ncon:
                self.inspection.contacts()

    def step(self, steps: int) -> None:
        """A call of the engine."""
        begin = perf_counter()
        mujoco.mj_step(self.m, self.d, steps)
        self.seconds += perf_counter() - begin

    def course(self, begin: Hashable, make: Callable[[], Course]) -> Course:
        """It is planned anew."""
        return make()
