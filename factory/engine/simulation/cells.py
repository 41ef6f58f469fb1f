"""The state that robots with programs of their own share: a cell each, and the state of their
mode."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from factory.engine.simulation.world import World
from factory.support.arrays import Array
from factory.theory.plant.factory import Factory
from factory.theory.plant.operation import Operation
from factory.theory.problem.ids import operation_of


@dataclass(slots=True)
class Cell:
    """What a robot shows to the others of its mode: the label that it carries, the number of
    operations finished, and the number entered."""

    label: str
    turn: int = 0
    entered: int = 0


class Cells:
    """The cells of all robots; each begins with the label of its robot."""

    def __init__(self, factory: Factory, labels: Sequence[str]) -> None:
        self._cells = [Cell(label) for label in labels]
        self._operations = factory.operations
        self._length = [len(robot.operations) for robot in factory.robots]
        self._place: dict[tuple[int, int], int] = {
            (robot.index, number): place
            for robot in factory.robots
            for place, number in enumerate(robot.operations)
        }

    def __getitem__(self, robot: int) -> Cell:
        return self._cells[robot]

    def turn(self, robot: int, operation: Operation, unit: int) -> int:
        """The number of operations that a robot has finished when it reaches this one for a
        unit."""
        return unit * self._length[robot] + self._place[robot, operation.index]

    def fired(self, transition: int) -> int:
        """Number of times that an operation has been ended by its carrier, or entered by its first
        robot."""
        operation = self._operations[operation_of(transition)]
        if transition == operation.end:
            return self._past(operation.carrier, self[operation.carrier].turn, operation)
        return max(self._past(r, self[r].entered, operation) for r in operation.robots)

    def _past(self, robot: int, turn: int, operation: Operation) -> int:
        """Number of times that a robot with a given count has passed an operation."""
        length = self._length[robot]
        return (turn - self._place[robot, operation.index] + length - 1) // length


class Link:
    """Everything that the program of a robot (index) may read and write while it is `at` an
    operation for a unit: its cell, the cells of that operation's robots, and their continuous
    state. Reading any other robot is an error."""

    def __init__(
        self, robot: int, cells: Cells, world: World, axes: Sequence[tuple[int, ...]]
    ) -> None:
        self._robot, self._cells, self._world, self._axes = robot, cells, world, axes

    def at(self, operation: Operation, unit: int) -> None:
        """Let the robot wait for an operation, or take part in it."""
        if self._robot not in operation.robots:
            raise AssertionError(f"robot {self._robot} is not in the mode of {operation.label}")
        self._operation, self._unit = operation, unit

    def waits(self, robot: int, label: str) -> bool:
        """Whether a robot has finished everything before the operation, and brings its label."""
        cell, wanted = self._cell(robot), self._turn(robot)
        return cell.turn > wanted or (cell.turn == wanted and cell.label == label)

    def has_started(self) -> bool:
        """Whether some robot has entered the operation for the unit."""
        robots = self._operation.robots
        return any(self._cell(robot).entered > self._turn(robot) for robot in robots)

    def has_left(self, robot: int) -> bool:
        """Whether a robot has finished the operation for the unit."""
        return self._cell(robot).turn > self._turn(robot)

    def state(self) -> tuple[Array, Array]:
        """Positions [m] and speeds [m/s] of the operation's axes."""
        x, v = self._world.sense()
        axes = list(self._axes[self._operation.index])
        return x[axes], v[axes]

    def enter(self) -> None:
        """Show that the robot takes part."""
        self._cells[self._robot].entered += 1

    def finish(self, label: str) -> None:
        """Show that the robot has finished the operation, and carries a label from now on."""
        cell = self._cells[self._robot]
        cell.label, cell.turn = label, cell.turn + 1

    def _turn(self, robot: int) -> int:
        return self._cells.turn(robot, self._operation, self._unit)

    def _cell(self, robot: int) -> Cell:
        if robot not in self._operation.robots:
            label = self._operation.label
            raise AssertionError(
                f"robot {self._robot} reads robot {robot}, which is not in the mode of {label}"
            )
        return self._cells[robot]
