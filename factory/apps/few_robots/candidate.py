"""A candidate: a choice of forms and lines, as a project that can be laid out and ranked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from math import inf

from factory.api import FactoryError, Project, Timing, pace
from factory.apps.few_robots.bundles import Filling
from factory.apps.few_robots.parallel import Branches
from factory.apps.few_robots.sharing import with_branches
from factory.engine.timing.cycle_time import CycleTime


@dataclass(frozen=True)
class Candidate:
    """A product with `forms` chosen, by the joins of the product as written, and with the `filling`
    of its lines, None for one robot for each label: the project `single`, without the `branches`
    that are asked for several times. `alone`: the same with a robot for each label, None for
    itself."""

    single: Project
    forms: Mapping[str, int]
    filling: Filling | None = None
    branches: Branches = ()
    alone: Project | None = None

    def __str__(self) -> str:
        if "has_layout" not in self.__dict__:
            return f"{self.robots} robots" if self.is_possible else "no factory"
        return f"{self.robots} robots, {self.seconds:.2f} s" if self.has_layout else "no layout"

    @cached_property
    def project(self) -> Project:
        """The project with all its branches. Raises InputError (Parallel) where one is
        impossible."""
        return with_branches(self.single, self.branches) if self.branches else self.single

    @cached_property
    def robots(self) -> int:
        """Number of robots of its factory, tools included."""
        project = self.project
        return len((project.factory if project.ground.relays else project.planned).robots)

    @property
    def seconds(self) -> float:
        """Predicted cycle time of its layout [s]."""
        return self.pace.seconds

    @property
    def pace(self) -> CycleTime:
        """Predicted cycle time of its layout, and the bottleneck."""
        return self._timed[0]

    @property
    def work(self) -> float:
        """Time of all its robots in operations for a unit [robot s]. Divided by the number of
        robots it is a lower bound on the cycle time of any factory with these operations."""
        factory = self.project.layout.factory
        pairs = zip(factory.operations, self._timed[1], strict=True)
        return sum(len(operation.robots) * delay for operation, delay in pairs) / factory.period

    @cached_property
    def _timed(self) -> tuple[CycleTime, tuple[float, ...]]:
        """The pace of its layout, and the duration of each operation [s]."""
        return pace(self.project.layout, self.project.settings)

    @cached_property
    def is_possible(self) -> bool:
        """Whether there is such a factory."""
        try:
            return self.robots > 0
        except FactoryError:
            return False

    @property
    def least(self) -> float:
        """Lower bound on its cycle time: that of its draft, in which no hand waits for another;
        infinite where there is no draft, or an operation cannot begin [s]."""
        try:
            timing = Timing(self.project.draft, self.project.settings)
            return CycleTime.of(timing.factory, timing.delays, timing.ways()).seconds
        except FactoryError:
            return inf

    @cached_property
    def has_layout(self) -> bool:
        """Whether it has a layout in which all its operations can begin."""
        try:
            return self.seconds > 0
        except FactoryError:
            return False

    def of_the_slowest(self) -> list[str]:
        """The labels that the slowest robot makes or brings."""
        factory, slowest = self.project.plain, self.pace.bottleneck
        slow = [robot for robot in factory.robots if robot.name == slowest]
        return [factory.operations[n].written for robot in slow for n in robot.operations]

    @property
    def blocked(self) -> int:
        """Number of blocked operations."""
        return blocked(self.single)

    @property
    def bare(self) -> int:
        """Number of labels that no hand of a robot for one label can hold."""
        return len((self.alone or self.single).no_grips)

    @property
    def troubles(self) -> int:
        """Number of operations that are blocked, or bring what no such hand can hold."""
        return self.blocked + self.bare


def blocked(project: Project) -> int:
    """Number of blocked operations of a project."""
    return len(project.matings.of_kind("blocked")) if project.matings else 0
