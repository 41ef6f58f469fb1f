"""Folds: robots of a factory that come to the same place from the same side become one robot, on
one *line*. Tools of one kind that come to one line become one, too.

In a factory as Compile makes it each robot has one *tour*, from empty hands to empty hands; in that
of a mix the tours of a robot are of one kind, and are assigned together. The tours form a tree: a
*kid* of a tour is one that delivers to it. A fold assigns tours to lines: the output robot's tour
to a line of its own, kids of tours of one line to lines that deliver to it, the inputs of one
operation to different lines. One robot serves a line.

A fold has exactly one live choice of programs: each robot does its tours in the order in which the
program of the robot that it delivers to asks for them. That order is live, for below a pile that
is held only lines below are used, so the product can be made once, operation by operation, in
postorder with the pile first; in any other two deliveries and two tours in the reverse order close
a circuit without a token. `nets.train` proves the former of each net anew.

Guarantees: the net is a gear train, live, safe and reversible. What is no fold is refused
(BadLine).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise

from factory.api import NOPART, Catalogue, Diagnostic, Factory, InputError, Plan
from factory.support.errors import Position, did_you_mean
from factory.theory.compiler.assigning import with_crew

Line = tuple[int, ...]
"""The tours of a line, as the robots of the factory that is folded."""


def fold(factory: Factory, lines: Iterable[Line], catalogue: Catalogue) -> Plan:
    """The plan with one robot for each of the `lines`, and for each robot on no line. Raises
    InputError (BadLine) with every reason why the lines are not a fold."""
    shared = [line for line in lines if len(line) > 1]
    faults = [fault for line in shared for fault in line_faults(factory, line, shared, catalogue)]
    if faults:
        raise InputError(faults)
    if shared:
        shared += _tool_lines(factory, shared)
    return factory.plan.then([_turn(factory, shared)])


def folded(factory: Factory, lines: Iterable[Line], catalogue: Catalogue) -> Factory:
    """The factory with one robot for each of the `lines` of a fold, which is not checked, and for
    each robot on no line."""
    return with_crew(factory, [_turn(factory, lines)], catalogue)


def line_of(count: int, lines: Iterable[Line]) -> list[int]:
    """For each of `count` robots the first robot of its line; itself for a robot on no line."""
    on = list(range(count))
    for line in lines:
        for robot in line:
            on[robot] = min(line)
    return on


def _turn(factory: Factory, lines: Iterable[Line]) -> list[int]:
    """For each robot of the factory the one robot of its line."""
    on = line_of(len(factory.robots), lines)
    number = {head: n for n, head in enumerate(sorted({*on}))}
    return [number[head] for head in on]


def _tool_lines(factory: Factory, lines: Sequence[Line]) -> list[Line]:
    """The tools that share a robot: those of one kind that come to one line, opposite to robots
    that come from the same sides."""
    on = line_of(len(factory.robots), lines)
    groups: dict[tuple[object, ...], list[int]] = {}
    for robot in factory.robots[1:]:
        kind = factory.tour_kind(robot.index)
        if kind[0] == "tool":
            last = factory.last(robot.index)
            sides = [frozenset(last.sides(r)) for r in last.robots if r != last.carrier]
            key = on[last.carrier], kind, *sides
            groups.setdefault(key, []).append(robot.index)
    return [tuple(tools) for tools in groups.values() if len(tools) > 1]


def count_of(factory: Factory, lines: Sequence[Line]) -> int:
    """Number of robots of a factory that is folded by these lines."""
    shared = [line for line in lines if len(line) > 1]
    shared += _tool_lines(factory, shared) if shared else []
    return len(factory.robots) - sum(len(line) - 1 for line in shared)


def lines_of(plan: Plan) -> tuple[Line, ...]:
    """The lines of a plan: the tours of each robot that has several, by the first turn in which
    they are done."""
    on: dict[int, list[int]] = {}
    for tour, robots in enumerate(zip(*plan.turns, strict=True)):
        on.setdefault(next(r for r in robots if r != Plan.NOBODY), []).append(tour)
    return tuple(tuple(tours) for tours in on.values() if len(tours) > 1)


def lines_of_labels(factory: Factory, sides: Iterable[Sequence[str]]) -> tuple[Line, ...]:
    """Lines given by the labels that their robots bring. Raises InputError (BadLine) for a label
    that no robot brings, or that is on two lines."""
    brings = {
        factory.by_label[label].written: robot
        for o in factory.making
        for robot, label in zip(o.robots, o.before, strict=True)
        if label != NOPART and robot != o.carrier
    }
    faults, lines, seen = list[Diagnostic](), list[Line](), set[str]()
    for labels in sides:
        for label in labels:
            if label not in brings:
                message = f"no robot brings '{label}' to another"
                faults.append(_fault(message, hint=did_you_mean(label, list(brings), "labels")))
            elif label in seen:
                message = f"'{label}' is on two lines"
                faults.append(_fault(message, hint="name each label once"))
            seen.add(label)
        lines.append(tuple(sorted({brings[label] for label in labels if label in brings})))
    if faults:
        raise InputError(faults)
    return tuple(lines)


def line_faults(
    factory: Factory, line: Line, lines: Sequence[Line], catalogue: Catalogue
) -> Iterator[Diagnostic]:
    """The reasons why tours cannot be on one line, pair by pair with its first tour."""
    on = line_of(len(factory.robots), lines)
    first, *others = line
    for other in others:
        message = mismatch(factory, first, other, on, catalogue)
        if message:
            names = f"{_named(factory, first)} and {_named(factory, other)} cannot share a robot"
            position = factory.robots[other].position
            yield _fault(f"{names}: {message}", position=position)
    deliveries = [tour[-1] for robot in line for tour in factory.tours[robot]]
    if not set.intersection(*(factory.sides(robot) for robot in line)):
        message = f"{_named(factory, first)} and others cannot all come from one side"
        yield _fault(message, position=factory.robots[first].position)
    begun = {frozenset(on[guest] for guest in factory.begun_by(robot)) for robot in line}
    if len(begun) > 1:
        message = f"what {_named(factory, first)} and others begin with comes on different lines"
        yield _fault(message, position=factory.robots[first].position)
    if len(set(deliveries)) < len(deliveries):
        both = next(n for n in deliveries if deliveries.count(n) > 1)
        message = f"'{factory.operations[both].written}' needs two inputs of one robot at once"
        yield _fault(message, position=factory.operations[both].position)


def kept_apart(factory: Factory, lines: Sequence[Line], catalogue: Catalogue) -> Iterator[str]:
    """The reasons why lines that deliver to one robot cannot become one, for each two consecutive
    ones that are not needed at once. Lines are named by the labels of their first tours."""
    on = line_of(len(factory.robots), lines)
    heads: dict[int, list[int]] = {}
    for robot in dict.fromkeys(line for line in on if line):
        if factory.tour_kind(robot)[0] != "tool":
            heads.setdefault(on[factory.last(robot).carrier], []).append(robot)
    for one, other in (pair for group in heads.values() for pair in pairwise(group)):
        tours = [robot for robot in range(len(on)) if on[robot] in (one, other)]
        if len({factory.last(robot).index for robot in tours}) < len(tours):
            continue
        message = mismatch(factory, one, other, on, catalogue)
        if not message and not set.intersection(*(factory.sides(r) for r in tours)):
            message = "they cannot come from one side"
        if message:
            both = f"{_named(factory, one)} and {_named(factory, other)}"
            yield f"{both} cannot share a robot: {message}"


def mismatch(
    factory: Factory, one: int, other: int, on: Sequence[int], catalogue: Catalogue
) -> str:
    """The reason why two tours, given by their robots, cannot be on one line, "" if they can; `on`:
    the lines of all tours."""
    ends = factory.last(one), factory.last(other)
    if 0 in (one, other):
        return "the output robot has a line of its own"
    if on[ends[0].carrier] != on[ends[1].carrier]:
        return "they deliver to different robots"
    if catalogue.meet(factory.robots[one].type, factory.robots[other].type) is None:
        return "no robot type fits both"
    if factory.tour_kind(one) != factory.tour_kind(other):
        return "they begin or end in different ways"
    return ""


def _named(factory: Factory, robot: int) -> str:
    last = factory.last(robot)
    label = last.before[last.robots.index(robot)]
    if label == NOPART:
        return f"the tool of '{last.written}'"
    return f"'{factory.by_label[label].written}'"


def _fault(message: str, position: Position | None = None, hint: str = "") -> Diagnostic:
    hint = hint or "a line has labels that come to one carrier, from one side, by one kind of robot"
    return Diagnostic("BadLine", message, position, hint)
