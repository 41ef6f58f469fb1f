"""IEC 61131-3 Structured Text: a function block for each robot's program, a CASE over its steps,
and a PROGRAM that calls them all in every scan.

As in the paper, the blocks share a cell for each robot and the positions of the axes. They are the
programs of `run --distributed` (each cell counts the operations its robot has finished; only the
carrier ends an operation) with set-points instead of the navigation function: gates of a mode are
kept, the motion itself is left to the drives.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from math import ceil

from factory.control.mode import REST, Mode
from factory.exporting.subject import Subject
from factory.layout.layout import Layout
from factory.modes.modes import operation_modes
from factory.plant.programs import Program, ProgramStep, program_of
from factory.problem.pag import NOPART

FORMAT, TAKES = "st", "pag"

WAIT, RUN, LEAVE = range(3)
"""Phases of a step, each a state."""


def export(subject: Subject) -> str:
    """The programs of all robots. Raises InputError where a mode cannot be entered."""
    layout = subject.project.layout
    modes = operation_modes(layout, subject.project.settings.eps)
    return write_st(layout, modes, subject.stem)


def write_st(layout: Layout, modes: tuple[Mode, ...], name: str) -> str:
    """Types, a function block a robot, and the program, as one text."""
    return "\n".join(_Writer(layout, modes, name).lines()) + "\n"


@dataclass(frozen=True)
class _Writer:
    layout: Layout
    modes: tuple[Mode, ...]
    name: str
    taken: set[str] = field(default_factory=set)

    @cached_property
    def labels(self) -> Mapping[str, str]:
        """Identifier of each label that is carried; first that of `nopart`, the default."""
        operations = self.layout.factory.operations
        found = {label: None for o in operations for label in (*o.before, *o.after)}
        found.pop(NOPART, None)
        return {NOPART: "NOPART", **{label: self._identifier("L_", label) for label in found}}

    @property
    def axes(self) -> int:
        """Number of axes: the carriages, then the lifts."""
        return len(self.layout.guidepaths) + len(self.layout.strokes)

    def _identifier(self, prefix: str, text: str) -> str:
        """A new identifier, distinct whatever the case: letters, digits, single underscores."""
        plain = re.sub("[^A-Za-z0-9]+", "_", text).strip("_") or "X"
        name, number = f"{prefix}{plain}", 2
        while name.upper() in self.taken:
            name, number = f"{prefix}{plain}_N{number}", number + 1
        self.taken.add(name.upper())
        return name

    def lines(self) -> Iterator[str]:
        """The text."""
        factory = self.layout.factory
        yield f"(* {_comment(self.name)}: the programs of {len(factory.robots)} robots *)"
        yield from self._types()
        for robot in factory.robots:
            yield ""
            yield from self._block(program_of(factory, robot.index))
        yield ""
        yield from self._program()

    def _types(self) -> Iterator[str]:
        yield from ("TYPE", f"    LABEL : ({', '.join(self.labels.values())});", "END_TYPE")
        yield from ("TYPE", "    CELL : STRUCT (* what a robot shows to all others *)")
        yield "        Carries : LABEL;"
        yield "        Finished : UDINT; (* operations *)"
        yield from ("    END_STRUCT;", "END_TYPE", "TYPE", "    AXIS : STRUCT")
        yield "        Position : LREAL; (* arc length of a carriage from A, height of a lift; m *)"
        yield "        Speed : LREAL; (* m/s *)"
        yield "        Target : LREAL; (* where the drive is to go and stay; m *)"
        yield from ("    END_STRUCT;", "END_TYPE")

    # a robot

    def _block(self, program: Program) -> Iterator[str]:
        yield f"FUNCTION_BLOCK ROBOT_{program.name}"
        yield "VAR_INPUT"
        yield "    Ready : BOOL; (* a part is at its feeder; the outfeed is free *)"
        yield "END_VAR"
        yield "VAR_IN_OUT"
        yield from self._shared()
        yield "END_VAR"
        yield "VAR"
        yield "    State : INT;"
        yield "    Unit : UDINT; (* times round the loop *)"
        yield "    Reached : BOOL;"
        yield "    Dwell : TON;"
        yield "END_VAR"
        yield "CASE State OF"
        for number, step in enumerate(program.steps):
            yield from self._step(program, number, step)
        yield "END_CASE;"
        yield "END_FUNCTION_BLOCK"

    def _shared(self) -> Iterator[str]:
        yield f"    Cells : ARRAY [1..{len(self.layout.guidepaths)}] OF CELL;"
        yield f"    Axes : ARRAY [1..{self.axes}] OF AXIS;"

    def _step(self, program: Program, number: int, step: ProgramStep) -> Iterator[str]:
        """Wait for the others, run until the label changes; the carrier waits till they follow."""
        base = 3 * number
        yield f"    {base + WAIT}: (* {_comment(f'{step.wait} {step.label}')} *)"
        yield f"        IF {self._entered(step)} THEN"
        yield f"            State := {base + RUN};"
        yield "        END_IF;"
        yield f"    {base + RUN}: (* {_comment(self._title(step))} *)"
        yield from self._motion(step, program.robot)
        yield from self._end(program, number, step)
        if step.is_carrier and step.until:
            yield f"    {base + LEAVE}: (* the others follow *)"
            yield f"        IF {' AND '.join(self._followed(step))} THEN"
            yield from self._next(program, number)
            yield "        END_IF;"

    def _title(self, step: ProgramStep) -> str:
        names = step.operation.template.name, step.operation.label
        return " ".join(dict.fromkeys(names))

    def _entered(self, step: ProgramStep) -> str:
        """The condition that every other robot shows the label that it brings, or has gone on."""
        found = []
        for robot, label in step.until:
            cell, turn = f"Cells[{robot + 1}]", self._turn(robot, step.operation.index)
            shown = f"{cell}.Finished = {turn} AND {cell}.Carries = {self.labels[label]}"
            found.append(f"({cell}.Finished > {turn} OR ({shown}))")
        return " AND ".join(found) or "Ready"

    def _turn(self, robot: int, operation: int) -> str:
        """Number of operations that a robot has finished before this one."""
        gear = self.layout.factory.robots[robot].operations
        before = gear.index(operation)
        return f"Unit * {len(gear)}{f' + {before}' if before else ''}"

    def _followed(self, step: ProgramStep) -> Iterable[str]:
        for robot, _ in step.until:
            yield f"Cells[{robot + 1}].Finished > {self._turn(robot, step.operation.index)}"

    def _motion(self, step: ProgramStep, robot: int) -> Iterator[str]:
        """The set-points of the robot's own axes; behind a gate short of the goal."""
        mode, axes = self.modes[step.operation.index], self._axes(step)
        for slot, axis in enumerate(axes):
            if self.layout.factory.robot_of(axis) != robot:
                continue
            target, goal = f"Axes[{axis + 1}].Target", float(mode.goals[slot])
            gate = int(mode.gate[slot]) if len(mode.gate) else -1
            if gate < 0:
                yield f"        {target} := {_real(goal)};"
                continue
            yield f"        IF {self._at(axes[gate], float(mode.goals[gate]), mode.eps)} THEN"
            yield f"            {target} := {_real(goal)};"
            yield "        ELSE"
            yield f"            {target} := {_real(goal + float(mode.standoff[slot]))};"
            yield "        END_IF;"

    def _axes(self, step: ProgramStep) -> tuple[int, ...]:
        return self.layout.factory.axes[step.operation.index]

    def _at(self, axis: int, goal: float, eps: float) -> str:
        return f"ABS(Axes[{axis + 1}].Position - {_real(goal)}) < {_real(eps)}"

    def _end(self, program: Program, number: int, step: ProgramStep) -> Iterator[str]:
        """The end of a step: the carrier tests the positions; the others read its cell."""
        carrier, condition = step.operation.carrier, "Reached"
        if step.is_carrier:
            yield from self._judge(step)
            if step.operation.dwell:
                yield f"        Dwell(IN := Reached, PT := {_time(step.operation.dwell)});"
                condition = "Dwell.Q"
        else:
            turn = self._turn(carrier, step.operation.index)
            condition = f"Cells[{carrier + 1}].Finished > {turn}"
        after = self.labels[step.operation.after[step.slot]]
        cell = f"Cells[{program.robot + 1}]"
        yield f"        IF {condition} THEN"
        if step.is_carrier and step.operation.dwell:
            yield f"            Dwell(IN := FALSE, PT := {_time(step.operation.dwell)});"
        yield f"            {cell}.Carries := {after};"
        yield f"            {cell}.Finished := {cell}.Finished + 1;"
        if step.is_carrier and step.until:
            yield f"            State := {3 * number + LEAVE};"
        else:
            yield from self._next(program, number)
        yield "        END_IF;"

    def _judge(self, step: ProgramStep) -> Iterator[str]:
        mode = self.modes[step.operation.index]
        yield "        Reached := TRUE;"
        for slot, axis in enumerate(self._axes(step)):
            there = self._at(axis, float(mode.goals[slot]), mode.eps)
            still = f"ABS(Axes[{axis + 1}].Speed) < {_real(REST)}"
            yield f"        Reached := Reached AND {there} AND {still};"

    def _next(self, program: Program, number: int) -> Iterator[str]:
        last = number == len(program.steps) - 1
        yield f"            State := {0 if last else 3 * (number + 1)};"
        if last:
            yield "            Unit := Unit + 1;"

    # all of them

    def _program(self) -> Iterator[str]:
        robots = self.layout.factory.robots
        yield "PROGRAM FACTORY"
        yield "VAR_INPUT"
        yield f"    Position : ARRAY [1..{self.axes}] OF LREAL; (* m *)"
        yield f"    Speed : ARRAY [1..{self.axes}] OF LREAL; (* m/s *)"
        yield f"    Ready : ARRAY [1..{len(robots)}] OF BOOL;"
        yield "END_VAR"
        yield "VAR_OUTPUT"
        yield f"    Target : ARRAY [1..{self.axes}] OF LREAL; (* m *)"
        yield f"    Carries : ARRAY [1..{len(robots)}] OF LABEL; (* what each holds *)"
        yield "END_VAR"
        yield "VAR"
        yield from self._shared()
        yield from (f"    {r.name} : ROBOT_{r.name};" for r in robots)
        yield "    Begun : BOOL;"
        yield "    Index : INT;"
        yield "END_VAR"
        yield f"FOR Index := 1 TO {self.axes} DO"
        yield "    Axes[Index].Position := Position[Index];"
        yield "    Axes[Index].Speed := Speed[Index];"
        yield "    IF NOT Begun THEN"
        yield "        Axes[Index].Target := Position[Index];"
        yield "    END_IF;"
        yield "END_FOR;"
        yield "Begun := TRUE;"
        for r in robots:
            yield f"{r.name}(Ready := Ready[{r.index + 1}], Cells := Cells, Axes := Axes);"
        yield f"FOR Index := 1 TO {self.axes} DO"
        yield "    Target[Index] := Axes[Index].Target;"
        yield "END_FOR;"
        yield f"FOR Index := 1 TO {len(robots)} DO"
        yield "    Carries[Index] := Cells[Index].Carries;"
        yield "END_FOR;"
        yield "END_PROGRAM"


def _real(value: float) -> str:
    """A literal of LREAL, to a nanometre."""
    text = f"{round(value, 9):.9f}".rstrip("0")
    return f"{text}0" if text.endswith(".") else text


def _time(seconds: float) -> str:
    """A literal of TIME, in whole milliseconds, rather longer than shorter."""
    return f"T#{ceil(round(1000 * seconds, 6))}ms"


def _comment(text: str) -> str:
    """A text that is safe in a comment."""
    return text.replace("(*", "( *").replace("*)", "* )")
