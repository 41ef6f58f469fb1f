"""Standing by: a factory in which each deputy does the tours of its robot in turn with it.

Units are made in *turns*. In the first each robot does its own tours; in each of the others some
robots rest, and their deputies do their tours. It is a fold of these units (`parallel`), so it is a
gear train, live, safe and reversible. It is not run: its layout is what the factory needs in which
any of its deputies is to take over. There a deputy's line has all that it may have to bring, in its
feeder, its hand, its regions and the certificate.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from factory.compiler.assigning import assigned
from factory.compiler.folding import delivery
from factory.plant.factory import Factory

Pair = tuple[int, int]
"""A robot and its deputy (indices)."""


def chosen_pairs(factory: Factory, deputies: Sequence[Sequence[int]]) -> tuple[Pair, ...]:
    """One deputy for each robot that has some which come to the same carrier, and to which no other
    delivers: a branch that a twin would take over as a whole does not stand by. Where it can be,
    two are each other's, so that no robot has to be fit for more than it must."""
    mate: dict[int, int] = {}
    to = [delivery(factory, robot.index).carrier for robot in factory.robots]
    rows = [[r for r in row if to[r] == to[robot]] for robot, row in enumerate(deputies)]
    deputies = [() if robot in to else row for robot, row in enumerate(rows)]
    for robot, row in enumerate(deputies):
        if robot not in mate:
            free = (other for other in row if other not in mate and robot in deputies[other])
            if (other := next(free, None)) is not None:
                mate |= {robot: other, other: robot}
    return tuple((robot, mate.get(robot, row[0])) for robot, row in enumerate(deputies) if row)


def rounds_of(pairs: Iterable[Pair]) -> tuple[Mapping[int, int], ...]:
    """Pairs by turns, in none of which a robot rests that is a deputy."""
    found: list[dict[int, int]] = []
    for robot, deputy in pairs:
        fitting = (r for r in found if deputy not in r and robot not in r.values())
        if (chosen := next(fitting, None)) is None:
            found.append(chosen := {})
        chosen[robot] = deputy
    return tuple(found)


def standing_by(factory: Factory, pairs: Iterable[Pair]) -> Factory:
    """The factory of one unit at a time in which deputies do the tours of their robots by turns.
    Its robots have the numbers that they have there."""
    every, turns = range(len(factory.robots)), ({}, *rounds_of(pairs))
    return assigned(factory, factory.robots, [[m.get(r, r) for r in every] for m in turns])
