"""The robots' programs, read off their gears (paper, section 6): a loop over what the robot
carries.

A step waits until the other robots of its operation show what they must bring, then runs its
component of the operation's field until the labels have changed. A robot with several tours shows
besides, while it has nothing, which one is next: the label of the tour's first operation.
"""

from __future__ import annotations

from dataclasses import dataclass

from factory.theory.plant.factory import Factory, Operation
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


def program_of(factory: Factory, robot: int) -> Program:
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
    return Program(robot, factory.robots[robot].name, tuple(steps))


def write_program(program: Program) -> str:
    """The program as the paper prints it, with robots numbered from 1."""
    me = program.robot + 1
    lines = [f"// {program.name}", "Loop:"]
    for step in program.steps:
        lines += [
            f"  If {_state(step, program.robot, step.label)}",
            f"    Run ẋ_{me} = {step.wait} Until {_condition(step)}",
            f"    Run ẋ_{me} = {_field(step)} Until {_exit(step, me)}",
            *([f"    next_{me} := {step.then}"] if step.then else []),
            "    Break",
        ]
    return "\n".join([*lines, "End Loop"])


def _state(step: ProgramStep, robot: int, label: str) -> str:
    """That a robot (index) shows a label, and where it has several tours, which one is next."""
    shown = f"state_{robot + 1} = {label}"
    if robot in step.next:
        shown = f"{shown} ∧ next_{robot + 1} = {step.operation.label}"
    return shown


def _condition(step: ProgramStep) -> str:
    """What it waits for: other robots, or where there are none, what the world must provide."""
    if step.until:
        return " ∧ ".join(_state(step, robot, label) for robot, label in step.until)
    return "a part is at the feeder" if step.label == NOPART else "the outfeed is free"


def _field(step: ProgramStep) -> str:
    """π_i ∘ F(x_1, ..., x_k)."""
    operation = step.operation
    robots = ", ".join(f"x_{robot + 1}" for robot in operation.robots)
    return f"π_{step.slot + 1} ∘ {operation.template.name}({robots})"


def _exit(step: ProgramStep, me: int) -> str:
    """Its own label where that changes; a tool watches the carrier's."""
    operation = step.operation
    after = operation.after[step.slot]
    if after != step.label:
        return f"state_{me} = {after}"
    carrier = operation.template.carrier - 1
    return f"state_{operation.carrier + 1} = {operation.after[carrier]}"
