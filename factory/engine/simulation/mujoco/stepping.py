"""Stepping of the engine, one timestep a call; `fast/` does the same in fewer calls."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from time import perf_counter
from typing import Protocol

from factory.engine.simulation.mujoco.courses import Course
from factory.engine.simulation.mujoco.inspection import Inspection
from factory.engine.simulation.world import Hooks
from factory.support.arrays import Index
from factory.support.engine import mujoco
from factory.support.settings import Settings


class Stepping(Protocol):
    """Steps the engine and plans courses. Every implementation gives the same run, to the last bit.

    Attributes:
        at_once: largest number of ticks in one call.
        seconds: wall time spent in the engine's steps [s].
    """

    at_once: int
    seconds: float

    def turn(self, active: Index) -> None:
        """Let exactly these axes move."""

    def follow(self, axes: Index, course: Course) -> None:
        """Let axes follow a course."""

    def advance(self, steps: int) -> None:
        """Advance by timesteps; contacts are inspected in each."""

    def course(self, begin: Hashable, make: Callable[[], Course]) -> Course:
        """The course that `make` gives; `begin` determines it."""


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
        """Every body stays in the broad phase."""

    def follow(self, axes: Index, course: Course) -> None:
        """Every body stays in the broad phase."""

    def advance(self, steps: int) -> None:
        """Advance by timesteps, and compare the model with what it should be."""
        self.take(steps)
        self.inspection.soundness.watch(steps)

    def take(self, steps: int) -> None:
        """Take timesteps; hooks are called before each."""
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
        """The course, planned anew."""
        return make()
