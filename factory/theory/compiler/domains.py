"""The condition NotPrepared: every mode can reach its goal, and every goal set, redistributed, lies
in the domain of the next mode (paper, Definition 3.4 and section 4.3).

Points are compared symbolically, end by end in multiples of r, because stretching changes B - A
alone. A domain is W - Δ, where Δ are the configurations in which two robots touch: robots at
distances d_i and d_j from a point where their guidepaths meet, with d_i + d_j <= 1 in units of r.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations

from factory.support.errors import Diagnostic
from factory.theory.plant.operation import Operation
from factory.theory.plant.robot import Robot
from factory.theory.problem.template import Point, Template

TOUCH = 1.0
"""Two robots of width r touch when their centres are no more than this apart [r]."""


EXAMPLE = "mate, for comparison: F = navigation on W to ( A1 + 2r, A2 + 2r, B3 ) within eps"
"""A hint, where something is wrong with an F."""


def check_prepared(
    robots: Sequence[Robot], operations: Sequence[Operation]
) -> Iterator[Diagnostic]:
    """Every violation of NotPrepared, templates first."""
    used = {id(o.template): o.template for o in operations}
    faults = [fault for template in used.values() for fault in _unreachable(template)]
    yield from faults
    if faults:
        return
    left = _left_at(robots, operations)
    for operation in operations:
        yield from _unprepared(operation, left)


def _unreachable(template: Template) -> Iterator[Diagnostic]:
    """Goals off the guidepath or inside Δ, or a goal ball of no size."""
    goals = template.law.goals
    for number, goal in enumerate(goals, start=1):
        if goal.robot != number:
            yield _fault(template, f"the goal {goal} is no point of robot {number}", goal)
        elif goal.multiple * {"A": -1, "B": 1, "S": 0}[goal.end] > 0:
            yield _fault(
                template, f"the goal {goal} lies off the guidepath of robot {number}", goal
            )
    if isinstance(template.law.eps, float) and template.law.eps <= 0:
        yield _fault(template, "a goal ball of radius 0 is never reached", goals[0])
    for one, other in touching(template, goals):
        yield _fault(
            template,
            f"the goals {goals[one]} and {goals[other]} have robots {one + 1} and {other + 1}"
            " touching: they lie outside W - Δ",
            goals[other],
        )


def _unprepared(
    operation: Operation, left: Mapping[tuple[int, int], Point]
) -> Iterator[Diagnostic]:
    """Robots that touch where their last operations have left them."""
    starts = [left[operation.index, robot] for robot in operation.robots]
    for one, other in touching(operation.template, starts):
        yield Diagnostic(
            "NotPrepared",
            f"before '{operation.label}' robots r{operation.robots[one] + 1} and"
            f" r{operation.robots[other] + 1} stand at {starts[one]} and {starts[other]}, touching:"
            f" outside the domain of {operation.template.name}",
            operation.position,
            "let the operations before end further apart than r",
        )


def _left_at(
    robots: Sequence[Robot], operations: Sequence[Operation]
) -> dict[tuple[int, int], Point]:
    """For each (operation, robot of it): the goal of the operation that robot did before."""
    left: dict[tuple[int, int], Point] = {}
    for robot in robots:
        for step, number in enumerate(robot.operations):
            before = operations[robot.operations[step - 1]]
            goals = before.template.law.goals
            left[number, robot.index] = goals[before.robots.index(robot.index)]
    return left


def touching(template: Template, at: Sequence[Point]) -> Iterator[tuple[int, int]]:
    """The pairs of robots (from 0) that touch when robot i stands at the point at[i]."""
    for meeting in template.identifications:
        for one, other in combinations(meeting, 2):
            here, there = at[one.robot - 1], at[other.robot - 1]
            if here.end == one.end and there.end == other.end:
                apart = abs(here.multiple - one.multiple) + abs(there.multiple - other.multiple)
                if apart <= TOUCH:
                    yield one.robot - 1, other.robot - 1


def _fault(template: Template, message: str, point: Point) -> Diagnostic:
    return Diagnostic(
        "NotPrepared",
        f"{template.name}: {message}",
        point.position or template.position,
        EXAMPLE,
    )
