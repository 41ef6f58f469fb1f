"""Deputies: the robots of a factory that could take over the tours of one that dies.

A *deputy* of a robot is a sibling: it delivers to the same carrier, never in the same operation, in
the same way and from a side that both admit, as on a line of a fold (`folding`); and its type is
fit for the tours, since a robot that is there keeps its type. What delivers to the dead robot must
reach the deputy. So there are two kinds:

* A *leaf*, to which no robot delivers: its tours alone are moved.
* A robot of a branch that is there several times (`parallel`): the whole branch is moved to a
  twin, robot by robot, and one branch fewer is there.

The deputy does all its tours in the order in which its carrier asks for them (Theorem 2 of folds).
Live (Theorem 1): the *postorder* of the operations, the pile first, depends on what is made, not on
the robots that make it. So one order is the witness for every deputy: a net is live if each program
ascends in it. Without a deputy a robot needs a spare.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import islice, pairwise, permutations
from types import MappingProxyType

from factory.compiler.assigning import assigned
from factory.compiler.folding import kind_of, mismatch, sides_of
from factory.plant.factory import Factory
from factory.problem.robot_types import Catalogue
from factory.support.errors import Diagnostic, InputError

MOST = 16
"""The most deputies of one kind that are listed for a robot."""

Moved = Mapping[int, int]
"""For each removed robot the robot that gets its tours, carriers first (indices)."""


def deputies(factory: Factory, catalogue: Catalogue) -> tuple[tuple[int, ...], ...]:
    """For each robot (index) its deputies, in the order of their numbers; none for one that needs a
    spare. `MOST` leaves, and robots of as many twins of a branch, are listed.

    Each would give a live net. Near-linear.
    """
    siblings = Siblings(factory, catalogue)
    if not all(siblings.ascends(robot.operations) for robot in factory.robots):
        raise ValueError("the programs do not ascend in the postorder of the operations")
    rows = [set[int]() for _ in factory.robots]
    for dead, deputy in siblings.pairs():
        rows[dead].add(deputy)
    return tuple(tuple(sorted(row)) for row in rows)


def moved_to(factory: Factory, dead: int, deputy: int, catalogue: Catalogue) -> Moved:
    """The robots that are removed if a deputy takes over for a robot (indices), each with the robot
    that gets its tours. Raises InputError (BadLine) if it is not a deputy."""
    siblings = Siblings(factory, catalogue)
    top, twin = siblings.tops(dead, deputy)
    message = siblings.refusal(top, twin)
    moved: Moved = {top: twin}
    if not message and siblings.kids[top]:
        moved = siblings.twins(top, twin)
        if moved.get(dead) != deputy:
            message = "what delivers to it cannot reach the other"
    if not message:
        return moved
    one, other = factory.robots[dead], factory.robots[deputy]
    text = f"{other.name} cannot take over the tours of {one.name}: {message}"
    hint = "`factory check --json` lists the deputies of each robot; one without needs a spare"
    raise InputError(Diagnostic("BadLine", text, one.position, hint))


@dataclass(frozen=True)
class Siblings:
    """Relations between the robots of a factory that deliver to the same carrier."""

    factory: Factory
    catalogue: Catalogue

    @cached_property
    def kids(self) -> list[list[int]]:
        """For each robot the robots that deliver to it, and its tools."""
        kids: list[list[int]] = [[] for _ in self.factory.robots]
        for robot in self.factory.robots[1:]:
            kids[self._carrier(robot.index)].append(robot.index)
        return kids

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
        for carried in self.kids:
            yield from self._for_leaves(carried)
            for top, twin in self._branches([robot for robot in carried if self.kids[robot]]):
                yield from self.twins(top, twin).items()

    def _for_leaves(self, robots: Sequence[int]) -> Iterator[tuple[int, int]]:
        """The leaves among the robots of a carrier, each with its deputies. Robots that differ only
        in the operations that they deliver in are judged once."""
        alike: dict[tuple[object, ...], list[int]] = {}
        for robot in robots:
            key = kind_of(self.factory, robot), self.factory.robots[robot].type, self._sides[robot]
            alike.setdefault(key, []).append(robot)
        groups = list(alike.values())
        fitting = [
            [other for other in groups if not self._unlike(group[0], other[0])] for group in groups
        ]
        for group, others in zip(groups, fitting, strict=True):
            for dead in (robot for robot in group if not self.kids[robot]):
                deputies = (r for other in others for r in other if self._live(dead, r))
                yield from ((dead, deputy) for deputy in islice(deputies, MOST))

    def _branches(self, robots: Sequence[int]) -> Iterator[tuple[int, int]]:
        """Pairs of twin branches among the carrier's robots, each by the robot at its top."""
        alike: dict[object, list[int]] = {}
        for robot in robots:
            alike.setdefault(self._signature(robot), []).append(robot)
        for group in alike.values():
            for top, twin in permutations(group[: MOST + 1], 2):
                moved = self.twins(top, twin)
                apart = not self.refusal(top, twin)
                if apart and moved and all(self._live(*pair) for pair in moved.items()):
                    yield top, twin

    def _live(self, dead: int, deputy: int) -> bool:
        """Whether the two robots never deliver in the same operation, and a program with the tours
        of both ascends in the witness."""
        if dead == deputy or self._deliveries[dead] & self._deliveries[deputy]:
            return False
        tours = (*self.factory.tours[dead], *self.factory.tours[deputy])
        when = self.factory.postorder
        return self.ascends([n for tour in sorted(tours, key=lambda t: when[t[-1]]) for n in tour])

    def refusal(self, dead: int, deputy: int) -> str:
        """The reason why a robot cannot take over the deliveries of another, "" if it can."""
        factory = self.factory
        if dead == deputy:
            return "it is the same robot"
        message = self._unlike(dead, deputy)
        both = self._deliveries[dead] & self._deliveries[deputy]
        if not message and both:
            message = f"'{factory.operations[min(both)].label}' needs both at once"
        return message

    def _unlike(self, dead: int, deputy: int) -> str:
        """The reason in kind, type or sides why a robot cannot replace another, "" for none."""
        factory = self.factory
        types = factory.robots[dead].type, factory.robots[deputy].type
        message = mismatch(factory, dead, deputy, range(len(factory.robots)), self.catalogue)
        if not message and not self.catalogue.fits(types[1], types[0]):
            message = f"it is a '{types[1]}', and a '{types[0]}' is needed"
        if not message and not self._sides[dead] & self._sides[deputy]:
            message = "they cannot come from one side"
        return message

    def twins(self, top: int, twin: int) -> Moved:
        """For each robot of the branch below `top` the corresponding robot of the branch below
        `twin`; empty if that is not a twin."""
        moved, todo = dict[int, int](), [(top, twin)]
        for one, other in todo:
            pairs = [sorted(self.kids[robot], key=self._signature) for robot in (one, other)]
            if self._signature(one) != self._signature(other) or len(pairs[0]) != len(pairs[1]):
                return MappingProxyType({})
            moved[one] = other
            todo += zip(*pairs, strict=True)
        return MappingProxyType(moved)

    def tops(self, dead: int, deputy: int) -> tuple[int, int]:
        """The robots at the top of the branches of two robots, which deliver to one carrier; the
        two robots themselves if there are no such branches."""
        top, twin = dead, deputy
        while 0 not in (top, twin):
            if top == twin or self._carrier(top) == self._carrier(twin):
                return top, twin
            top, twin = self._carrier(top), self._carrier(twin)
        return dead, deputy

    def _carrier(self, robot: int) -> int:
        return self.factory.last(robot).carrier

    def _signature(self, robot: int) -> tuple[str, ...]:
        """What robots in twins have in common: their type, and what they do, but for the unit."""
        member = self.factory.robots[robot]
        return (member.type, *(self.factory.operations[n].written for n in member.operations))


Pair = tuple[int, int]
"""A robot and its deputy (indices)."""


def chosen_pairs(factory: Factory, deputies: Sequence[Sequence[int]]) -> tuple[Pair, ...]:
    """One deputy for each robot that has a deputy at the same carrier and to which no robot
    delivers: branches that a twin takes over as a whole do not stand by. If possible two robots are
    each other's deputies, so that each must be fit for few tours."""
    mate: dict[int, int] = {}
    to = [factory.last(robot.index).carrier for robot in factory.robots]
    rows = [[r for r in row if to[r] == to[robot]] for robot, row in enumerate(deputies)]
    deputies = [() if robot in to else row for robot, row in enumerate(rows)]
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
