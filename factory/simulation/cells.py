"""What robots that run their own programs share: a cell each, and the state of their mode."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from factory.control.mode import Array
from factory.plant.factory import Factory, Operation
from factory.simulation.world import World


@dataclass(slots=True)
class Cell:
    """What a robot shows to all others: the label it carries and how many operations it has
    finished."""

    label: str
    turn: int = 0


class Cells:
    """The cells of all robots: of each, by number, the label that it begins with."""

    def __init__(self, factory: Factory, labels: Sequence[str]) -> None:
        self._cells = [Cell(label) for label in labels]
        self._length = [len(robot.operations) for robot in factory.robots]
        self._place = {
            (robot.index, number): place
            for robot in factory.robots
            for place, number in enumerate(robot.operations)
        }

    def __getitem__(self, robot: int) -> Cell:
        return self._cells[robot]

    def turn(self, robot: int, operation: Operation, unit: int) -> int:
        """How many operations a robot has finished when it comes to this one for that unit."""
        return unit * self._length[robot] + self._place[robot, operation.index]

    def waits(self, robot: int, label: str, operation: Operation, unit: int) -> bool:
        """Whether a robot has done all that it does before an operation, and brings its label."""
        cell, wanted = self._cells[robot], self.turn(robot, operation, unit)
        return cell.turn > wanted or (cell.turn == wanted and cell.label == label)

    def has_left(self, robot: int, operation: Operation, unit: int) -> bool:
        """Whether a robot has finished an operation for a unit."""
        return self._cells[robot].turn > self.turn(robot, operation, unit)


class Link:
    """The continuous state that the robots of one mode share; reading any other robot is an
    error."""

    def __init__(self, world: World, axes: Sequence[tuple[int, ...]]) -> None:
        self._world, self._axes = world, axes

    def read(self, operation: Operation, robot: int) -> tuple[Array, Array]:
        """Positions and speeds of an operation's axes, for one of its robots."""
        if robot not in operation.robots:
            raise AssertionError(f"robot {robot} is not in the mode of {operation.label}")
        x, v = self._world.sense()
        axes = list(self._axes[operation.index])
        return x[axes], v[axes]
