"""The state that the marking implies: which operation each robot is in, and which label it
holds."""

from __future__ import annotations

from collections.abc import Sequence

from factory.api import NOPART, Factory, Marking, Operation
from factory.engine.simulation.supervisor import Supervisor


class RunState:
    """Reads the state of a factory from a supervisor's marking, or from another marking."""

    def __init__(self, factory: Factory, supervisor: Supervisor) -> None:
        self.factory, self.supervisor = factory, supervisor

    @property
    def marking(self) -> Marking:
        """The marked places."""
        return frozenset(place for place, is_so in enumerate(self.supervisor.marked) if is_so)

    def step_of(self, robot: int, marking: Marking | None = None) -> tuple[int, bool]:
        """Which operation of its program, counted from 0, a robot waits for or is in; whether it is
        in it."""
        return self.factory.net.gears[robot].step_in(self.marking if marking is None else marking)

    def operation_of(self, robot: int, marking: Marking | None = None) -> Operation:
        """The operation that a robot (index) takes part in or waits for."""
        step, _ = self.step_of(robot, marking)
        return self.factory.operations[self.factory.robots[robot].operations[step]]

    def holds(
        self, robot: int, marking: Marking | None = None, fired: Sequence[int] | None = None
    ) -> str:
        """The label that a robot (index) holds, NOPART for none. `fired`: firing counts of the
        transitions, for another marking."""
        operation, (_, is_in_it) = self.operation_of(robot, marking), self.step_of(robot, marking)
        counts = self.supervisor.fired if fired is None else fired
        unit = self.factory.unit(operation, counts[operation.start] - is_in_it)
        is_made = self.supervisor.word.is_made(unit)
        return operation.before[operation.robots.index(robot)] if is_made else NOPART

    def held(self, marking: Marking | None = None, fired: Sequence[int] | None = None) -> list[str]:
        """The label that each robot holds, NOPART for none."""
        marked = self.marking if marking is None else marking
        return [self.holds(robot.index, marked, fired) for robot in self.factory.robots]
