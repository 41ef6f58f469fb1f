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

from factory.theory.plant.factory import Factory
from factory.theory.plant.operation import Operation
from factory.theory.problem.pag import NOPART


def kind_of(factory: Factory, robot: int) -> tuple[object, ...]:
    """Kind of a tour, which is the same for all tours of a line: whether it begins at a feeder or
    takes inputs from two robots; whether it ends with an insertion, or with a carrier that takes
    its label; whether it lowers it. For tools, their template and their role in it."""
    first = factory.first(robot)
    last = factory.last(robot)
    slot = last.robots.index(robot)
    if last.before[slot] == NOPART:
        return "tool", last.template.name, slot
    fed, inserted = len(first.robots) == 1, last.pile != NOPART
    if not fed and len(first.inputs) < 2:
        return "alone", robot
    return "fed" if fed else "taking", "inserted" if inserted else "taken", last.lowered == slot


def begun_by(factory: Factory, robot: int) -> list[int]:
    """The robots that bring the first inputs of a tour; none for a tour that begins at a feeder."""
    first = factory.first(robot)
    return [other for other in first.robots if other != robot] if first.carrier == robot else []


def sides_of(factory: Factory, robot: int) -> set[int]:
    """Sides of the approach axis from which a robot may come to what it delivers."""
    ends = (factory.operations[tour[-1]] for tour in factory.tours[robot])
    return set.intersection(*(sides_at(o, robot) for o in ends))


def sides_at(o: Operation, robot: int) -> set[int]:
    """Sides of the approach axis from which a robot may come to an operation."""
    slot, approach = o.robots.index(robot), o.approach
    if approach is None or o.before[slot] == NOPART:
        return {-1, +1}
    turned = 1 if slot == o.last else -1
    return {turned * side for side in approach.sides}
