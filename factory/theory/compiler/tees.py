"""Tees: two robots that deliver at one place, in turns, from one side.

Where the guidepath of a carrier begins, it has one station, and a station has room for one robot on
each side. Two robots that deliver there from the same side share the last stretch of their
guidepaths, the *stem*. So do two that could be one robot on a line, if the plan says so (`tees`).
Each has an *arm* of its own, with a branch of its own behind. In everything but who does which
tour, the two are one robot that does the tours of both: the factory *on stems*, whose layout is
that of the tee with both arms in one.

Guarantees: the net is that of the factory without tees, or of a branch that is there twice, live,
safe and reversible (`parallel`). Both robots are never at the end of the stem at once: what they
deliver there is in operations of one carrier, whose gear has one token.
"""

from __future__ import annotations

from dataclasses import replace

from factory.theory.compiler.assigning import assigned
from factory.theory.plant.factory import Factory
from factory.theory.plant.operation import Operation
from factory.theory.problem.ids import RobotId
from factory.theory.problem.pag import NOPART


def heads(factory: Factory) -> tuple[int, ...]:
    """For each robot the first of those that bring, or help to bring, the same over one stem as it
    does; itself for all that share none. Linear."""
    head, alike = [*range(len(factory.robots))], dict[str, list[Operation]]()
    for one, other in factory.plan.tees:
        head[max(one, other)] = min(one, other)
    for o in factory.making:
        alike.setdefault(o.written, []).append(o)
    for same in alike.values():  # carriers come before those that deliver to them
        begins = len(same[0].robots) > 1 and same[0].pile == NOPART
        firsts = dict[int, Operation]()
        for o in same:
            first = firsts.setdefault(head[o.carrier], o)
            if begins or o.carrier != first.carrier:
                for robot, other in zip(first.robots, o.robots, strict=True):
                    head[other] = head[robot]
    return tuple(head)


def on_stems(factory: Factory) -> tuple[Factory, tuple[int, ...]]:
    """The factory in which the robots of each tee are one, and those of their branches too; and for
    each robot the one there that does its tours. The same factory where there is no tee."""
    head = heads(factory)
    if head == (every := tuple(range(len(head)))):
        return factory, every
    kept = sorted({*head})
    number = {robot: n for n, robot in enumerate(kept)}
    place = tuple(number[robot] for robot in head)
    robots = [
        replace(factory.robots[robot], index=RobotId(n), name=f"r{n + 1}")
        for robot, n in number.items()
    ]
    turns = tuple(tuple(place[robot] for robot in turn) for turn in factory.plan.turns)
    plan = replace(factory.plan, turns=turns, names=(), tees=())
    adjusted = frozenset(place[robot] for robot in factory.adjusted)
    return replace(assigned(factory, robots, [place]), plan=plan, adjusted=adjusted), place
