"""The evaluation of a tree: the motion of each of its joins, and what they cost."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Union

import numpy as np

from factory.apps.planning.blocking import CLASHES, DEEPER, LOCKED, Blocking
from factory.apps.planning.cannot import Direction, Units
from factory.apps.planning.exact import RELAY, Expected, Tree
from factory.apps.planning.subsets import (
    APART,
    BLOCKED,
    FALLS,
    LOOSE,
    PASSES,
    ROOT_AXIS,
    TIPS,
    UNDER,
    UNHELD,
    Stance,
)
from factory.support.arrays import Array

PRICES = {CLASHES: BLOCKED, LOCKED: PASSES, DEEPER: LOOSE}
"""The price of a join by its level of blocking."""


@dataclass(frozen=True, slots=True)
class Join:
    """Two groups of units that are joined: `come` leaves along `direction` of the product, so it
    comes in against it. `level`: the worst level of blocking on its way (`blocking`). `lowered`:
    whether it comes along the vertical."""

    pile: Units
    come: Units
    direction: Direction
    level: int
    lowered: bool


@dataclass(frozen=True)
class Judged:
    """A tree of units in a stance, with its `joins`, how many sub-assemblies are in pieces
    (`apart`), how many would tip over (`tips`), of how many something would fall (`falls`) and how
    many are relayed; the greatest expected cycle of its robots [s], how many these are, and how
    long all sub-assemblies are [m]; how many joins have a side that no hand can hold (`unheld`),
    and how many put a part under a pile (`under`), an odd base included."""

    tree: Tree = field(repr=False)
    stance: Stance
    joins: tuple[Join, ...] = field(repr=False)
    apart: int
    relays: int
    seconds: float
    robots: int
    sizes: float
    tips: int = 0
    falls: int = 0
    unheld: int = 0
    under: int = 0

    @cached_property
    def price(self) -> float:
        """What its joins and its sub-assemblies in pieces cost."""
        joins = sum(PRICES.get(join.level, 0.0) for join in self.joins)
        loose = APART * self.apart + TIPS * self.tips + FALLS * self.falls
        return joins + loose + RELAY * self.relays + UNHELD * self.unheld + UNDER * self.under

    @property
    def hard(self) -> float:
        """The price without what falls and what is put under a pile."""
        return self.price - FALLS * self.falls - UNDER * self.under

    @property
    def senseless(self) -> int:
        """The number of sub-assemblies and operations that nobody would make so by hand, and of
        bases that nobody would choose."""
        return self.falls + self.under

    def count(self, level: int) -> int:
        """The number of joins with this level of blocking, or more."""
        return sum(join.level >= level for join in self.joins)


Joins = Union[Join, tuple["Joins", ...]]  # noqa: UP007 - a type that names itself
"""The joins of a tree, those of its sub-trees first."""

SUMS = ("apart", "tips", "falls", "under", "relays", "robots")
"""What is counted of a tree, in this order."""

KNOWN = 20_000
"""So many sub-trees are remembered."""


@dataclass(frozen=True, slots=True)
class _Made:
    """A sub-tree in its order, its `units`, how long the robot that holds it has spent, the
    greatest cycle of all that have delivered [s], its SUMS, the lengths of its sub-assemblies [m],
    and its joins."""

    tree: Tree
    units: Units
    held: float
    seconds: float
    sums: Array
    sizes: float
    joins: Joins


@dataclass(frozen=True)
class Site:
    """A planning problem in one stance: the blocking `graphs` of a product and expected times.
    `unit_prices` (2, n): the price of each unit if its own inputs come along x or y of the
    floor."""

    graphs: Blocking
    stance: Stance
    expected: Expected
    unit_prices: Array = field(repr=False)
    known: dict[tuple[Tree, int], _Made] = field(default_factory=dict, repr=False, compare=False)

    def judged(self, tree: Tree) -> Judged:
        """The joins of a tree, and what they cost. Of two sides that a third robot takes, the one
        that is more like a base comes first."""
        if len(self.known) > KNOWN:
            self.known.clear()
        whole = self._made(tree, ROOT_AXIS)
        last = whole.held + float(self.expected.delivering(self.size(whole.units)))
        sums = whole.sums - self._unsound(whole.units, np.zeros(len(SUMS)))
        joins = tuple(_flat(whole.joins))
        unheld = sum(not self.graphs.can_hold(join.pile, join.come) for join in joins)
        return Judged(
            tree=whole.tree,
            stance=self.stance,
            joins=joins,
            seconds=max(whole.seconds, last),
            sizes=whole.sizes,
            unheld=unheld,
            **{name: int(count) for name, count in zip(SUMS, sums, strict=True)},
        )

    def _made(self, tree: Tree, axis: int) -> _Made:
        """A tree whose inputs come along an axis. What is known of a sub-tree is not computed
        again."""
        if (tree, axis) not in self.known:
            self.known[tree, axis] = self._making(tree, axis)
        return self.known[tree, axis]

    def _making(self, tree: Tree, axis: int) -> _Made:
        if isinstance(tree, int):
            sums = np.array([0, 0, 0, 0, 0, 1])
            return _Made(tree, (tree,), self.expected.pace.lost, 0.0, sums, 0.0, ())
        below = [self._made(one, 1 - axis) for one in tree]
        seconds = max(
            max(one.seconds, one.held + float(self.expected.delivering(self.size(one.units))))
            for one in below
        )
        sums = np.sum([one.sums for one in below], axis=0) + np.array([0, 0, 0, 0, 0, 1])
        first, sizes = below[0], sum(one.sizes for one in below)
        if len(tree) == 1:
            held = float(self.expected.stop(self.size(first.units)))
            sums = sums + np.array([0, 0, 0, 0, 1, 0])
            return _Made((first.tree,), first.units, held, seconds, sums, sizes, first.joins)
        if len(self.graphs.worth) and self._is_pile(below[1].units, below[0].units):
            below[:2] = below[1::-1]
        pile, time, joins = below[0].units, 0.0, list[Joins]([one.joins for one in below])
        for number, one in enumerate(below[1:]):
            onto = number > 0
            join = self.join(pile, one.units, axis, onto)
            reach = self.size(one.units) if onto else max(map(self.size, (one.units, pile)))
            time += float(self.expected.stop(reach) + (self.expected.step(reach) if onto else 0.0))
            if join.lowered:
                time += float(self.expected.lift(self.stroke(one.units, pile)))
            under = onto and self.graphs.puts_under(pile, one.units)
            joins.append(join)
            pile = tuple(sorted((*pile, *one.units)))
            sums = self._unsound(pile, sums) + np.array([0, 0, 0, under, 0, 0])
            sizes += float(self.size(pile))
        made = tuple(one.tree for one in below)
        return _Made(made, pile, time, seconds, sums, sizes, tuple(joins))

    def _unsound(self, members: Units, sums: Array) -> Array:
        """Sums to which a sub-assembly is added."""
        faults = not self.graphs.hangs(members), self.tips(members), not self.graphs.stands(members)
        return np.asarray(sums + np.array([*faults, 0, 0, 0]))

    def _is_pile(self, one: Units, other: Units) -> bool:
        """Whether one side is more of a pile than the other."""
        graphs = self.graphs
        if graphs.base in (*one, *other):
            return graphs.base in one
        if graphs.puts_under(one, other) or graphs.puts_under(other, one):
            return graphs.puts_under(other, one)
        return float(graphs.worth[list(one)].max()) > float(graphs.worth[list(other)].max())

    def size(self, members: Units) -> Array:
        """The longer horizontal extent of some units [m]."""
        level = list(self.stance.axes[:2])
        rows = list(members)
        extent = self.graphs.high[rows].max(axis=0) - self.graphs.low[rows].min(axis=0)
        return np.asarray(extent[level].max())

    def stroke(self, come: Units, pile: Units) -> Array:
        """The shorter stroke by which one of two sides can be lowered [m]."""
        low, high = (
            self.graphs.low[:, self.stance.axes[2]],
            self.graphs.high[:, self.stance.axes[2]],
        )
        (a, b), (c, d) = ((low[list(side)].min(), high[list(side)].max()) for side in (come, pile))
        return np.asarray(min(d - a, b - c))

    def tips(self, members: Units) -> bool:
        """Whether some units would tip over by themselves."""
        feet = self.graphs.feet
        return feet is not None and bool(feet.joined(members).tips[0])

    def join(self, pile: Units, come: Units, axis: int, onto: bool) -> Join:
        """How two groups are joined, along an axis of the floor or from above: with the least
        blocking, and horizontally if that is equal."""
        ways = [(self.stance.axes[axis], side, False) for side in (+1, -1)]
        ways.append((self.stance.axes[2], self.stance.up, True))
        if not onto and self.graphs.base not in pile:
            ways.append((self.stance.axes[2], -self.stance.up, True))
        joins = [self._way(pile, come, way) for way in ways]
        return min(joins, key=lambda join: (join.level, join.lowered))

    def _way(self, pile: Units, come: Units, way: tuple[int, int, bool]) -> Join:
        axis, side, lowered = way
        at = np.ix_(come, pile) if side > 0 else np.ix_(pile, come)
        level = int(self.graphs.levels[axis][at].max())
        return Join(pile, come, (axis, side), level, lowered)


def _flat(joins: Joins) -> Iterator[Join]:
    """The joins of a tree, inputs first."""
    todo = [iter([joins])]
    while todo:
        one = next(todo[-1], None)
        if one is None:
            todo.pop()
        elif isinstance(one, Join):
            yield one
        else:
            todo.append(iter(one))
