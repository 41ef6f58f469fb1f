"""The evaluation of a tree: the motion of each of its joins, and what they cost."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from factory.api import Array
from factory.apps.planning.blocking import CLASHES, DEEPER, LOCKED, Blocking
from factory.apps.planning.cannot import Direction, Units
from factory.apps.planning.exact import RELAY, Expected, Tree
from factory.apps.planning.subsets import APART, BLOCKED, LOOSE, PASSES, ROOT_AXIS, TIPS, Stance

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
    (`apart`), how many would tip over (`tips`) and how many are relayed; the greatest expected
    cycle of its robots [s], how many these are, and how long all sub-assemblies are [m]."""

    tree: Tree = field(repr=False)
    stance: Stance
    joins: tuple[Join, ...] = field(repr=False)
    apart: int
    relays: int
    seconds: float
    robots: int
    sizes: float
    tips: int = 0

    @cached_property
    def price(self) -> float:
        """What its joins and its sub-assemblies in pieces cost."""
        joins = sum(PRICES.get(join.level, 0.0) for join in self.joins)
        return joins + APART * self.apart + TIPS * self.tips + RELAY * self.relays

    def count(self, level: int) -> int:
        """The number of joins with this level of blocking, or more."""
        return sum(join.level >= level for join in self.joins)


@dataclass(frozen=True)
class Site:
    """A planning problem in one stance: the blocking `graphs` of a product and expected times.
    `unit_prices` (2, n): the price of each unit if its own inputs come along x or y of the
    floor."""

    graphs: Blocking
    stance: Stance
    expected: Expected
    unit_prices: Array = field(repr=False)

    def judged(self, tree: Tree) -> Judged:
        """The joins of a tree, and what they cost."""
        walk = _Walk(self)
        members, held = walk.made(tree, ROOT_AXIS)
        walk.seconds.append(held + float(self.expected.delivering(self.size(members))))
        joins, apart = tuple(walk.joins), walk.apart - (not self.graphs.hangs(members))
        tips = walk.tips - self.tips(members)
        figures = joins, apart, walk.relays, max(walk.seconds), walk.robots, walk.sizes, tips
        return Judged(tree, self.stance, *figures)

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


@dataclass
class _Walk:
    """The figures that are accumulated on a walk through a tree."""

    site: Site
    joins: list[Join] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    apart: int = 0
    tips: int = 0
    relays: int = 0
    robots: int = 0
    sizes: float = 0.0

    def made(self, tree: Tree, axis: int) -> tuple[Units, float]:
        """The units of a tree whose inputs come along an axis, and the time that the robot which
        holds it has spent [s]."""
        expected = self.site.expected
        if isinstance(tree, int):
            self.robots += 1
            return (tree,), expected.pace.lost
        if len(tree) == 1:
            members, held = self.made(tree[0], 1 - axis)
            self._delivered(members, held)
            self.relays, self.robots = self.relays + 1, self.robots + 1
            return members, float(expected.stop(self.site.size(members)))
        pile, held = self.made(tree[0], 1 - axis)
        self._delivered(pile, held)
        self.robots += 1
        time = 0.0
        for number, below in enumerate(tree[1:]):
            come, held = self.made(below, 1 - axis)
            self._delivered(come, held)
            onto = number > 0
            join = self.site.join(pile, come, axis, onto)
            sizes = self.site.size(come) if onto else max(map(self.site.size, (come, pile)))
            time += float(expected.stop(sizes) + (expected.step(sizes) if onto else 0.0))
            if join.lowered:
                time += float(expected.lift(self.site.stroke(come, pile)))
            self.joins.append(join)
            pile = tuple(sorted((*pile, *come)))
            self.apart += not self.site.graphs.hangs(pile)
            self.tips += self.site.tips(pile)
            self.sizes += float(self.site.size(pile))
        return pile, time

    def _delivered(self, members: Units, held: float) -> None:
        self.seconds.append(held + float(self.site.expected.delivering(self.site.size(members))))
