"""Standing by: a factory in which each deputy does the tours of its robot in turn with it.

Units are made in *turns*. In the first each robot does its own tours; in each of the others some
robots rest, and their deputies do their tours. It is a fold of these units (`parallel`), so it is a
gear train, live, safe and reversible. It is not run: its layout is what the factory needs in which
any of its deputies is to take over. There a deputy's line has all that it may have to bring, in its
feeder, its hand, its regions and the certificate.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from factory.compiler.compiler import gear_net
from factory.compiler.deputies import postorder, program_with
from factory.compiler.parallel import for_unit
from factory.plant.factory import Factory

Pair = tuple[int, int]
"""A robot and its deputy (indices)."""


def chosen_pairs(deputies: Sequence[Sequence[int]]) -> tuple[Pair, ...]:
    """One deputy for each robot that has some: where it can be, two that are each other's, so that
    no robot has to be fit for more than it must."""
    mate: dict[int, int] = {}
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
    turns = ({}, *rounds_of(pairs))
    period, count, when = len(turns), len(factory.making), postorder(factory)

    def number(operation: int, turn: int) -> int:
        return period * count + turn if operation == count else turn * count + operation

    operations = tuple(
        for_unit(
            o, number(o.index, turn), turn, tuple(moved.get(robot, robot) for robot in o.robots)
        )
        for part in (factory.making, factory.dropoffs)
        for turn, moved in enumerate(turns)
        for o in part
    )
    programs: list[list[int]] = [[] for _ in factory.robots]
    for turn, moved in enumerate(turns):
        own: list[list[int]] = [[] for _ in factory.robots]
        for robot in range(len(factory.robots)):
            own[moved.get(robot, robot)].append(robot)
        for robot, does in enumerate(own):
            programs[robot] += [number(o, turn) for o in program_with(factory, does, when)]
    robots = tuple(
        replace(robot, operations=tuple(program))
        for robot, program in zip(factory.robots, programs, strict=True)
    )
    parents = [number(factory.parents[o], t) for t in range(period) for o in range(count)]
    return replace(
        factory,
        robots=robots,
        operations=operations,
        net=gear_net(robots, operations),
        parents=(*parents, *[-1] * period),
        period=period,
    )
