"""The robots' programs, read off their gears (paper, section 6): a loop over what the robot
carries.

A step waits until the other robots of its operation show what they must bring, then runs its
component of the operation's field until the labels have changed. A robot with several tours shows
besides, while it has nothing, which one is next: the label of the tour's first operation.
"""

from __future__ import annotations

from dataclasses import dataclass

from factory.theory.plant.factory import Factory
from factory.theory.plant.operation import Operation
from factory.theory.problem.pag import NOPART


@dataclass(frozen=True, slots=True)
class ProgramStep:
    """One `If` of a program: what the robot carries, the mode it waits in, the cells it waits for
    (robot, label), its operation and its component there, from 0.

    `next`: the robots (index) that must show that this operation is next, since they have several
    tours and one of them begins here; `then`: which one is next when this operation has ended a
    tour of this robot, "" where it has not, or there is one tour only.
    """

    label: str
    wait: str
    until: tuple[tuple[int, str], ...]
    operation: Operation
    slot: int
    next: tuple[int, ...] = ()
    then: str = ""

    @property
    def is_carrier(self) -> bool:
        """Whether this robot holds the result."""
        return self.slot == self.operation.template.carrier - 1


@dataclass(frozen=True, slots=True)
class Program:
    """What a robot repeats without end: its steps in the order of its gear."""

    robot: int
    name: str
    steps: tuple[ProgramStep, ...]

    @classmethod
    def of(cls, factory: Factory, robot: int) -> Program:
        """The program of a robot (index), read off its gear."""
        net = factory.net
        gear = net.gears[robot]
        tours = factory.tours
        begun = [factory.operations[tour[0]].label for tour in tours[robot]]
        onward = dict(zip((tour[-1] for tour in tours[robot]), begun[1:] + begun[:1], strict=True))
        steps = []
        for position, number in enumerate(factory.robots[robot].operations):
            operation = factory.operations[number]
            wait = net.threaded.places[gear.waiting(position)]
            others = tuple(
                (other, label)
                for other, label in sorted(zip(operation.robots, operation.before, strict=True))
                if other != robot
            )
            slot = operation.robots.index(robot)
            pairs = zip(operation.robots, operation.before, strict=True)
            turns = tuple(r for r, label in pairs if label == NOPART and len(tours[r]) > 1)
            then = onward.get(number, "") if len(begun) > 1 else ""
            steps.append(ProgramStep(wait.label, wait.mode, others, operation, slot, turns, then))
        return cls(robot, factory.robots[robot].name, tuple(steps))
