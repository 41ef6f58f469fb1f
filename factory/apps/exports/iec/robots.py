"""The function block of each robot: its program, a CASE over its steps.

As in the paper, the blocks share a cell for each robot and the positions of the axes. The carrier
of an operation alone begins and ends it, where the net fires; the others follow its cell. The
cells count operations, since labels alone race (docs/decisions/distributed.md). What a supervisor
does beside the net is in the blocks as well: order places, by which robots wait for each other's
hands, and the ways on which robots go ahead while they wait.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from math import ceil

from factory.api import NOPART, Layout, Mode, Order, Timing
from factory.apps.exports.iec.declarations import OrganizationUnit, Variable, comment
from factory.theory.plant.programs import Program, ProgramStep

WAIT, RUN, GRIP, LEAVE = range(4)
"""Phases of a step: it waits for the others; moves to the goal; opens or closes the grip and waits
for its sensor; and, if it is the carrier, waits until the others have followed."""

COMPLETED = "COMPLETED"
"""The function that says how often a robot has come past one of its operations."""

INPUTS = (
    Variable("Held", "BOOL", "sensor: its grip is closed on something"),
    Variable("Ready", "READY_LIST", "feeders show a part; the outfeed is free"),
)
SHARED = (Variable("Cells", "CELL_LIST"), Variable("Axes", "AXIS_LIST"))
OUTPUTS = (
    Variable("Grip", "BOOL", "close the grip"),
    Variable("Job", "UINT", "number of the operation that it is in, 0 while it waits"),
)
LOCALS = (
    Variable("State", "INT"),
    Variable("Unit", "UDINT", "times round the loop"),
    Variable("Reached", "BOOL"),
    Variable("Dwell", "TON"),
)


@dataclass(frozen=True)
class RobotBlocks:
    """Writes the function blocks of a layout's robots. `timing`: of the layout; `stations`: the
    number of the station where an operation (index) takes a part, or drops a product off."""

    timing: Timing
    stations: Mapping[int, int]

    @property
    def layout(self) -> Layout:
        """The layout."""
        return self.timing.layout

    def block(self, robot: int) -> OrganizationUnit:
        """The function block of a robot (index)."""
        program = Program.of(self.layout.factory, robot)
        body = ["CASE State OF"]
        for number, step in enumerate(program.steps):
            body += self._step(program, number, step)
        sections = (
            ("VAR_INPUT", INPUTS),
            ("VAR_IN_OUT", SHARED),
            ("VAR_OUTPUT", OUTPUTS),
            ("VAR", LOCALS),
        )
        name = f"ROBOT_{program.name}"
        return OrganizationUnit("FUNCTION_BLOCK", name, sections, (*body, "END_CASE;"))

    def _step(self, program: Program, number: int, step: ProgramStep) -> Iterator[str]:
        base, cell = 4 * number, f"Cells[{program.robot + 1}]"
        yield f"    {base + WAIT}: (* {comment(f'{step.wait} {step.label}')} *)"
        yield from self._ahead(step, program.robot)
        yield from _if(self._entered(step))
        yield f"            {cell}.Entered := {cell}.Entered + 1;"
        yield f"            Job := {step.operation.index + 1};"
        yield f"            State := {base + RUN};"
        yield "        END_IF;"
        names = step.operation.template.name, step.operation.label
        yield f"    {base + RUN}: (* {comment(' '.join(dict.fromkeys(names)))} *)"
        yield from self._motion(step, program.robot)
        yield from self._end(step, base)
        yield f"    {base + GRIP}: (* the grip {'closes' if self._brings(step) else 'opens'} *)"
        yield f"        IF {'' if self._brings(step) else 'NOT '}Held THEN"
        yield f"            {cell}.Carries := {self._made(step.operation.after[step.slot])};"
        yield f"            {cell}.Finished := {cell}.Finished + 1;"
        yield "            Job := 0;"
        if step.is_carrier and step.until:
            yield f"            State := {base + LEAVE};"
            yield "        END_IF;"
            yield f"    {base + LEAVE}: (* the others follow *)"
            yield from _if(self._followed(step))
        yield from self._next(program, number)
        yield "        END_IF;"

    @staticmethod
    def _brings(step: ProgramStep) -> bool:
        """Whether the robot has something in its grip when the step is over."""
        return step.operation.after[step.slot] != NOPART

    def _made(self, label: str) -> str:
        """The number of the operation that makes a label, 0 for nothing."""
        if label == NOPART:
            return "0"
        return f"{self.layout.factory.by_label[label].index + 1} (* {comment(label)} *)"

    def _next(self, program: Program, number: int) -> Iterator[str]:
        is_last = number == len(program.steps) - 1
        yield f"            State := {0 if is_last else 4 * (number + 1)};"
        if is_last:
            yield "            Unit := Unit + 1;"

    # conditions

    def _turn(self, robot: int, operation: int) -> str:
        """Number of operations that a robot has finished before this one."""
        gear = self.layout.factory.robots[robot].operations
        before = gear.index(operation)
        return f"Unit * {len(gear)}{f' + {before}' if before else ''}"

    def _entered(self, step: ProgramStep) -> Iterator[str]:
        """The conditions under which a robot enters an operation: its carrier when all others show
        the labels that they bring, order places hold tokens and its station is ready; any other
        when the carrier has."""
        operation = step.operation
        if not step.is_carrier:
            carrier = operation.carrier
            yield f"Cells[{carrier + 1}].Entered > {self._turn(carrier, operation.index)}"
            return
        for robot, label in step.until:
            cell = f"Cells[{robot + 1}]"
            yield f"{cell}.Finished = {self._turn(robot, operation.index)}"
            yield f"{cell}.Carries = {self._made(label)}"
        if operation.index in self.stations:
            yield f"Ready[{self.stations[operation.index]}]"
        for order in self.timing.coordinated.orders:
            if order.start == operation.start:
                yield self._ordered(order)
        if operation.inputs and not step.until and operation.index not in self.stations:
            yield "TRUE"

    def _ordered(self, order: Order) -> str:
        """That an order place holds a token: the transition or the pass that the operation waits
        for has come for this unit."""
        count = self._completed(order.before) + (f" + {order.tokens}" if order.tokens else "")
        past = order.past
        if past is None:
            return f"{count} > Unit"
        over = f"{self._completed(order.end)} >= {self._completed(order.before)}"
        over += f" + {order.held}" if order.held else ""
        side = f"{'>=' if past.direction > 0 else '<='} {_real(past.at)}"
        there = f"{over} OR Axes[{past.axis + 1}].Position {side}"
        return f"({count} > Unit + 1 OR {count} = Unit + 1 AND ({there}))"

    def _completed(self, transition: int) -> str:
        """How often a transition of the compiled net has fired."""
        operation = self.layout.factory.operation_of(transition)
        gear = self.layout.factory.robots[operation.carrier].operations
        turn = "Entered" if transition == operation.start else "Finished"
        place = gear.index(operation.index)
        count = f"Cells[{operation.carrier + 1}].{turn}"
        return f"{COMPLETED}(Turn := {count}, Place := {place}, Length := {len(gear)})"

    def _followed(self, step: ProgramStep) -> Iterable[str]:
        for robot, _ in step.until:
            yield f"Cells[{robot + 1}].Finished > {self._turn(robot, step.operation.index)}"

    # motion

    def _ahead(self, step: ProgramStep, robot: int) -> Iterator[str]:
        """The set-points of a robot that goes ahead while it waits; it never turns back. An axis
        that follows another goes when that is there."""
        before = ""
        for stage in self.timing.stages:
            if (stage.robot, stage.operation) != (robot, step.operation.index):
                continue
            at, goal, rises = f"Axes[{stage.axis + 1}]", stage.goal, stage.goal >= stage.start
            yield f"        IF {before}{at}.Position {'<' if rises else '>'} {_real(goal)} THEN"
            yield f"            {at}.Target := {_real(goal)};"
            yield "        END_IF;"
            short = goal - stage.mode.eps if rises else goal + stage.mode.eps
            before = f"{at}.Position {'>' if rises else '<'} {_real(short)} AND "

    def _motion(self, step: ProgramStep, robot: int) -> Iterator[str]:
        """The set-points of the robot's own axes; behind a gate short of the goal."""
        factory, number = self.layout.factory, step.operation.index
        mode, axes = self.timing.modes[number], factory.moves[number]
        for slot, axis in enumerate(axes):
            if factory.robot_of(axis) != robot:
                continue
            target, goal = f"Axes[{axis + 1}].Target", float(mode.goals[slot])
            gate = int(mode.gate[slot]) if len(mode.gate) else -1
            if gate < 0:
                yield f"        {target} := {_real(goal)};"
                continue
            yield f"        IF {_at(axes[gate], float(mode.goals[gate]), mode.eps)} THEN"
            yield f"            {target} := {_real(goal)};"
            yield "        ELSE"
            yield f"            {target} := {_real(goal + float(mode.standoff[slot]))};"
            yield "        END_IF;"

    def _end(self, step: ProgramStep, base: int) -> Iterator[str]:
        """The end of the motion: the carrier tests the positions; the others read its cell."""
        operation = step.operation
        carrier, condition = operation.carrier, "Reached"
        if step.is_carrier:
            yield from self._reached(step)
            if operation.dwell:
                yield f"        Dwell(IN := Reached, PT := {_time(operation.dwell)});"
                condition = "Dwell.Q"
        else:
            condition = f"Cells[{carrier + 1}].Finished > {self._turn(carrier, operation.index)}"
        yield f"        IF {condition} THEN"
        if step.is_carrier and operation.dwell:
            yield f"            Dwell(IN := FALSE, PT := {_time(operation.dwell)});"
        yield f"            Grip := {'TRUE' if self._brings(step) else 'FALSE'};"
        yield f"            State := {base + GRIP};"
        yield "        END_IF;"

    def _reached(self, step: ProgramStep) -> Iterator[str]:
        number = step.operation.index
        mode = self.timing.modes[number]
        yield "        Reached := TRUE;"
        for slot, axis in enumerate(self.layout.factory.moves[number]):
            there = _at(axis, float(mode.goals[slot]), mode.eps)
            still = f"ABS(Axes[{axis + 1}].Speed) < {_real(Mode.STILL)}"
            yield f"        Reached := Reached AND {there} AND {still};"


def _if(conditions: Iterable[str]) -> Iterator[str]:
    """The beginning of an IF with all of these conditions."""
    first, *others = conditions
    yield f"        IF {first}" + ("" if others else " THEN")
    yield from (f"            AND {condition}" for condition in others[:-1])
    yield from (f"            AND {condition} THEN" for condition in others[-1:])


def _at(axis: int, goal: float, eps: float) -> str:
    return f"ABS(Axes[{axis + 1}].Position - {_real(goal)}) < {_real(eps)}"


def _real(value: float) -> str:
    """A literal of LREAL, to a nanometre."""
    text = f"{round(value, 9):.9f}".rstrip("0")
    return f"{text}0" if text.endswith(".") else text


def _time(seconds: float) -> str:
    """A literal of TIME, in whole milliseconds, rather longer than shorter."""
    return f"T#{ceil(round(1000 * seconds, 6))}ms"
