"""The programs of robots as the paper prints them."""

from __future__ import annotations

from factory.api import NOPART
from factory.theory.plant.programs import Program, ProgramStep


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
