"""Deputies: the robots of a factory that could take over the tours of one that dies.

A *deputy* of a robot is a sibling: it delivers to the same carrier, never in the same operation, in
the same way and from a side that both admit, as on a line of a fold (`folding`); and its type is
fit for the tours, since a robot that is there keeps its type. What delivers to the dead robot would
have to reach the deputy, so only a *leaf* has deputies, to which no robot delivers.

The deputy does all its tours in the order in which its carrier asks for them (Theorem 2).
Live (Theorem 1): the *postorder* of the operations, the pile first, depends on what is made, not on
the robots that make it. So one order is the witness for every deputy: a net is live if each program
ascends in it. Without a deputy a robot needs a spare.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import islice, pairwise

from factory.compiler.assigning import assigned
from factory.compiler.folding import kind_of, mismatch, sides_of
from factory.plant.factory import Factory
from factory.problem.robot_types import Catalogue

MOST = 16
"""The most deputies that are listed for a robot."""


def deputies(factory: Factory, catalogue: Catalogue) -> tuple[tuple[int, ...], ...]:
    """For each robot (index) its deputies, in the order of their numbers, at most `MOST`; none for
    one that needs a spare. Each would give a live net. Near-linear."""
    siblings = Siblings(factory, catalogue)
    if not all(siblings.ascends(robot.operations) for robot in factory.robots):
        raise ValueError("the programs do not ascend in the postorder of the operations")
    rows = [list[int]() for _ in factory.robots]
    for dead, deputy in siblings.pairs():
        rows[dead].append(deputy)
    return tuple(tuple(sorted(row)) for row in rows)


@dataclass(frozen=True)
class Siblings:
    """Relations between the robots of a factory that deliver to the same carrier."""

    factory: Factory
    catalogue: Catalogue

    @cached_property
    def _deliveries(self) -> list[frozenset[int]]:
        """The operations that each robot delivers in."""
        return [frozenset(tour[-1] for tour in tours) for tours in self.factory.tours]

    @cached_property
    def _sides(self) -> list[frozenset[int]]:
        """For each robot the sides from which it may come on all its tours."""
        return [frozenset(sides_of(self.factory, r.index)) for r in self.factory.robots]

    def ascends(self, program: Sequence[int]) -> bool:
        """Whether a program ascends in the postorder of the operations, the witness of liveness."""
        when = self.factory.postorder
        return all(when[one] < when[other] for one, other in pairwise(program))

    def pairs(self) -> Iterator[tuple[int, int]]:
        """Robots with their deputies, each of which gives a live net."""
        kids: dict[int, list[int]] = {}
        for robot in self.factory.robots[1:]:
            kids.setdefault(self.factory.last(robot.index).carrier, []).append(robot.index)
        for carried in kids.values():
            yield from self._for_leaves(carried, kids)

    def _for_leaves(
        self, robots: Sequence[int], carriers: Collection[int]
    ) -> Iterator[tuple[int, int]]:
        """The leaves among the robots of a carrier, each with its deputies. Robots that differ only
        in the operations that they deliver in are judged once."""
        alike: dict[tuple[object, ...], list[int]] = {}
        for robot in robots:
            key = kind_of(self.factory, robot), self.factory.robots[robot].type, self._sides[robot]
            alike.setdefault(key, []).append(robot)
        groups = list(alike.values())
        fitting = [
            [other for other in groups if self._fits(group[0], other[0])] for group in groups
        ]
        for group, others in zip(groups, fitting, strict=True):
            for dead in (robot for robot in group if robot not in carriers):
                deputies = (r for other in others for r in other if self._live(dead, r))
                yield from ((dead, deputy) for deputy in islice(deputies, MOST))

    def _live(self, dead: int, deputy: int) -> bool:
        """Whether the two robots never deliver in the same operation, and a program with the tours
        of both ascends in the witness."""
        if dead == deputy or self._deliveries[dead] & self._deliveries[deputy]:
            return False
        tours = (*self.factory.tours[dead], *self.factory.tours[deputy])
        when = self.factory.postorder
        return self.ascends([n for tour in sorted(tours, key=lambda t: when[t[-1]]) for n in tour])

    def _fits(self, dead: int, deputy: int) -> bool:
        """Whether a robot can replace another by its kind, its type and its sides."""
        factory = self.factory
        types = factory.robots[dead].type, factory.robots[deputy].type
        return (
            not mismatch(factory, dead, deputy, range(len(factory.robots)), self.catalogue)
            and self.catalogue.fits(types[1], types[0])
            and not self._sides[dead].isdisjoint(self._sides[deputy])
        )


Pair = tuple[int, int]
"""A robot and its deputy (indices)."""


def chosen_pairs(deputies: Sequence[Sequence[int]]) -> tuple[Pair, ...]:
    """One deputy for each robot that has some (indices). If possible two robots are each other's
    deputies, so that each must be fit for few tours."""
    mate: dict[int, int] = {}
    for robot, row in enumerate(deputies):
        if robot not in mate:
            free = (other for other in row if other not in mate and robot in deputies[other])
            if (other := next(free, None)) is not None:
                mate |= {robot: other, other: robot}
    return tuple((robot, mate.get(robot, row[0])) for robot, row in enumerate(deputies) if row)


def rounds_of(pairs: Iterable[Pair]) -> tuple[Mapping[int, int], ...]:
    """Pairs distributed over turns, such that no deputy of a turn rests in it."""
    turns: list[dict[int, int]] = []
    for robot, deputy in pairs:
        fitting = (r for r in turns if deputy not in r and robot not in r.values())
        if (chosen := next(fitting, None)) is None:
            turns.append(chosen := {})
        chosen[robot] = deputy
    return tuple(turns)


def standing_by(factory: Factory, pairs: Iterable[Pair]) -> Factory:
    """The factory of a period in which deputies do the tours of their robots in some of the turns.
    Robots keep their numbers.

    It is a fold (`parallel`), so its net is live, safe and reversible. It is not run: its layout is
    that of the factory in which any of its deputies may have to take over, with all that a deputy
    may bring in its feeder, its hand, its regions and the certificate."""
    every, turns = range(len(factory.robots)), ({}, *rounds_of(pairs))
    return assigned(factory, factory.robots, [[m.get(r, r) for r in every] for m in turns])
