"""The books: where robots are by the marking, and what they hold there."""

from __future__ import annotations

from collections.abc import Sequence

from factory.layout.layout import Layout
from factory.nets.petri import Marking
from factory.plant.factory import Factory, Operation
from factory.problem.pag import NOPART
from factory.simulation.supervisor import Supervisor


class Books:
    """Those of a supervisor, as they are now or in another marking, in the `layout` of now. A robot
    that is gone holds nothing."""

    def __init__(self, layout: Layout, supervisor: Supervisor) -> None:
        self.layout, self.supervisor = layout, supervisor

    @property
    def factory(self) -> Factory:
        """The factory of now."""
        return self.layout.factory

    @property
    def marking(self) -> Marking:
        """The places that are marked now."""
        return frozenset(place for place, is_so in enumerate(self.supervisor.marked) if is_so)

    def step_of(self, robot: int, marking: Marking | None = None) -> int:
        """The step of its gear that a robot (index) is at: twice that of its program, and one more
        where the operation is under way."""
        marked = self.marking if marking is None else marking
        places = self.factory.net.gears[robot].places
        return next(step for step, place in enumerate(places) if place in marked)

    def operation_of(self, robot: int, marking: Marking | None = None) -> Operation:
        """The operation that a robot (index) is in, or waits for."""
        step = self.step_of(robot, marking)
        return self.factory.operations[self.factory.robots[robot].operations[step // 2]]

    def holds(
        self, robot: int, marking: Marking | None = None, fired: Sequence[int] | None = None
    ) -> str:
        """The label that a robot (index) holds, NOPART for nothing; `fired`: how often each
        transition has, in another marking."""
        if not self.factory.robots[robot].operations:
            return NOPART
        operation, is_in_it = self.operation_of(robot, marking), self.step_of(robot, marking) % 2
        counts = self.supervisor.fired if fired is None else fired
        unit = self.factory.unit(operation, counts[operation.start] - is_in_it)
        is_made = self.supervisor.word.is_made(unit)
        return operation.before[operation.robots.index(robot)] if is_made else NOPART

    def place_of(self, robot: int, marking: Marking | None = None) -> tuple[int, bool]:
        """Which operation (index) a robot is in, or waits for, and whether it is in it."""
        return self.operation_of(robot, marking).index, bool(self.step_of(robot, marking) % 2)

    def held(self, marking: Marking | None = None, fired: Sequence[int] | None = None) -> list[str]:
        """The label that each robot holds, NOPART for nothing."""
        marked = self.marking if marking is None else marking
        return [self.holds(robot.index, marked, fired) for robot in self.factory.robots]
