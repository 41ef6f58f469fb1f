"""Trees of many units: divided from the top, then improved by local search.

The first tree is found by division in two connected closed sets of the blocking graphs. Division
always succeeds: a subset of units that can be taken apart can be taken apart, so no choice has to
be undone. Then neighbourhoods are optimised: a join and a part of the tree below it, in which the
remaining sub-assemblies count as units, is solved as a small product is (`exact`), and replaced if
the whole tree becomes better.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache

import numpy as np
from numpy.typing import NDArray

from factory.apps.planning.blocking import CLASHES, DEEPER, LOCKED, Blocking, closure
from factory.apps.planning.cannot import Units
from factory.apps.planning.divisions import Late, divisions
from factory.apps.planning.exact import RELAY, Best, Tree, TreeTask
from factory.apps.planning.judging import Judged, Site
from factory.apps.planning.subsets import (
    APART,
    BLOCKED,
    FALLS,
    LOOSE,
    PASSES,
    ROOT_AXIS,
    TIPS,
    subsets,
)
from factory.apps.planning.writing import leaves
from factory.support.arrays import Array

Sets = NDArray[np.bool_]

SEEDS = 6
"""The number of units from which sets are grown along each direction."""

TRIED = 40
"""The number of most promising divisions whose sides are tested for connectedness."""


@dataclass(frozen=True, slots=True)
class Divider:
    """Divides units by the blocking graphs of a product."""

    graphs: Blocking

    def best(
        self, members: Units, axes: tuple[int, ...], random: np.random.Generator, even: float = 1.0
    ) -> tuple[Units, Units] | None:
        """The two sides, that with the base first, of the division of least price along one of some
        axes; among equals, the more `even` one is preferred (0: no preference). None if the units
        interlock along all these axes."""
        units = np.array(members)
        sets, prices = self._candidates(units, axes, random)
        if not len(sets):
            return None
        share = sets.sum(axis=1) / len(units)
        worth = even * np.abs(share - 0.5) + 0.15 * random.random(len(sets))
        best, chosen = np.inf, 0
        for n in np.lexsort((worth, prices))[:TRIED].tolist():
            price = prices[n] + sum(self._unsound(units[s].tolist()) for s in (sets[n], ~sets[n]))
            if price < best:
                best, chosen = price, n
            if price <= prices[n]:
                break
        one, other = (tuple(units[s].tolist()) for s in (sets[chosen], ~sets[chosen]))
        return (other, one) if self.graphs.base in other else (one, other)

    def _unsound(self, members: list[int]) -> float:
        """The price of a side that is in pieces, would tip over, or loses something."""
        feet = self.graphs.feet
        tips = feet is not None and len(members) > 1 and bool(feet.joined(members).tips[0])
        falls = FALLS * (not self.graphs.stands(members))
        return APART * (not self.graphs.hangs(members)) + TIPS * tips + falls

    def _candidates(
        self, units: NDArray[np.int64], axes: tuple[int, ...], random: np.random.Generator
    ) -> tuple[Sets, Array]:
        """Closed sets (k, n) and the prices (k,) of removing each."""
        here = np.ix_(units, units)
        touch, cheapest = self.graphs.touch[here], dict[bytes, tuple[NDArray[np.bool_], float]]()
        for axis in axes:
            for turned in (False, True):
                locks, levels = self.graphs.locks[axis][here], self.graphs.levels[axis][here]
                if turned:
                    locks, levels = locks.T, levels.T
                needs = closure(locks)
                sets = np.unique(np.array([*needs, *self._grown(needs, touch, random)]), axis=0)
                sets = sets[~sets.all(axis=1)]
                for row, price in zip(sets, _prices(levels, sets).tolist(), strict=True):
                    key = (row if row[0] else ~row).tobytes()
                    if key not in cheapest or price < cheapest[key][1]:
                        cheapest[key] = row, price
        rows = [row for row, _ in cheapest.values()]
        return np.array(rows), np.array([price for _, price in cheapest.values()])

    def _grown(
        self, needs: Sets, touch: Sets, random: np.random.Generator
    ) -> Iterator[NDArray[np.bool_]]:
        """Closed sets that grow from some units, each time by a unit that touches the set, and by
        the units that block it."""
        count = len(needs)
        weight = needs.sum(axis=1) + random.random(count)
        for seed in random.permutation(count)[:SEEDS].tolist():
            grown = needs[seed].copy()
            while 2 * grown.sum() < count:
                beside = np.flatnonzero(touch[grown].any(axis=0) & ~grown)
                if not len(beside):
                    break
                grown = grown | needs[beside[weight[beside].argmin()]]
                if not grown.all():
                    yield grown


def _prices(levels: NDArray[np.int8], sets: Sets) -> Array:
    """The prices (k,) of removing each of some sets."""
    prices = np.zeros(len(sets))
    for level, price in ((DEEPER, LOOSE), (LOCKED, PASSES), (CLASHES, BLOCKED)):
        meets = sets.astype(np.float32) @ (levels >= level).astype(np.float32)
        met = ((meets > 0) & ~sets).any(axis=1)
        prices[met] = price
        if not met.any():
            break
    return prices


SMALL = 8
"""The number of units that are solved exactly."""

ROUNDS = 3
"""The search ends after so many neighbourhoods of each join, on average, without improvement."""


@dataclass(frozen=True, slots=True)
class Joined:
    """Units that are already joined, as a `tree` whose inputs come along an axis of the floor; -1
    if any axis will do."""

    units: Units
    tree: Tree = field(repr=False)
    axis: int = -1


def solved(site: Site, groups: Sequence[Joined], axis: int, bound: float | None) -> Tree | None:
    """The best tree of a few groups, whose inputs come along an axis of the floor; sub-assemblies
    are in pieces only where there is no other way. None where no tree has cycles below the bound.
    """
    stance, few = site.stance, site.graphs.grouped([group.units for group in groups])
    tables = subsets(few)
    horizontal = tuple(sorted(stance.axes[:2]))
    turn = [stance.axes.index(h) for h in horizontal]  # of the floor, for each horizontal axis
    prices = np.array([[_price(site, group, turn[k]) for group in groups] for k in (0, 1)])
    at = turn.index(axis)

    def leaf(unit: int, k: int) -> Tree:
        group = groups[unit]
        return group.tree if group.axis in (-1, turn[k]) else (group.tree,)

    for apart in (False, True):
        possible = divisions(tables, stance.axes[2], stance.up, apart)
        task = TreeTask(possible, site.expected, prices)
        best = Best(task, bound)
        if np.isfinite(best.made[at, tables.whole]):
            return best.tree(tables.whole, at, leaf)
    return None


def _price(site: Site, group: Joined, axis: int) -> float:
    if len(group.units) == 1:
        return float(site.unit_prices[axis, group.units[0]])
    return 0.0 if group.axis == axis else RELAY


def divided(site: Site, random: np.random.Generator, even: float) -> Tree:
    """A tree by dividing from the top, `even` as `Divider.best` says."""
    divider, stance = Divider(site.graphs), site.stance

    def below(members: Units, axis: int) -> Tree:
        if len(members) <= SMALL:
            groups = [Joined((unit,), unit) for unit in members]
            return solved(site, groups, axis, None) if len(members) > 1 else members[0]
        for turned in (False, True):
            along = 1 - axis if turned else axis
            division = divider.best(members, (stance.axes[along], stance.axes[2]), random, even)
            if division is not None:
                tree = tuple(below(side, 1 - along) for side in division)
                return (tree,) if turned else tree
        raise ValueError("interlocked")

    return below(tuple(range(len(site.graphs))), ROOT_AXIS)


def bettered(
    site: Site, first: Tree, bound: float, late: Late, random: np.random.Generator
) -> Iterator[Judged]:
    """Ever better trees, from a first one on, within a bound on expected cycles [s], until it is
    late or ROUNDS neighbourhoods of each join brought no improvement."""

    @cache
    def solution_of(groups: tuple[Joined, ...], axis: int) -> Tree | None:
        return solved(site, groups, axis, bound)

    best, idle = site.judged(first), 0
    places = _joins(best.tree)
    yield best
    while not late() and idle <= ROUNDS * len(places):
        place = places[int(random.integers(len(places)))]
        node, axis = _at(best.tree, place), (ROOT_AXIS + len(place)) % 2
        groups = _groups(node, axis, random)
        solution = solution_of(groups, axis) if len(groups) > 2 else None
        idle += 1
        if solution is None or solution == node:
            continue
        other = site.judged(_replaced(best.tree, place, solution))
        if _worth(other, bound) < _worth(best, bound):
            best, places, idle = other, _joins(other.tree), 0
            yield best


def _worth(judged: Judged, bound: float) -> tuple[float, ...]:
    """The rank of a tree: less is better."""
    over = max(judged.seconds - bound, 0.0)
    return judged.price, round(over, 6), judged.robots, round(judged.sizes, 6)


def _joins(tree: Tree) -> list[tuple[int, ...]]:
    """The ways from the root to all joins of a tree, the last of them last."""
    return [*filter(None, _places(tree)), ()]


def _places(tree: Tree, place: tuple[int, ...] = ()) -> Iterator[tuple[int, ...]]:
    if not isinstance(tree, int):
        yield place
        for number, below in enumerate(tree):
            yield from _places(below, (*place, number))


def _at(tree: Tree, place: tuple[int, ...]) -> Tree:
    for number in place:
        tree = tree[number]
    return tree


def _replaced(tree: Tree, place: tuple[int, ...], by: Tree) -> Tree:
    if not place:
        return by
    first, *rest = place
    return (*tree[:first], _replaced(tree[first], tuple(rest), by), *tree[first + 1 :])


def _groups(node: Tree, axis: int, random: np.random.Generator) -> tuple[Joined, ...]:
    """The sub-assemblies below a join, divided further until there are about SMALL groups."""
    open_ = [(node, axis)]
    while True:
        inner = [n for n, (tree, _) in enumerate(open_) if not isinstance(tree, int)]
        fits = [n for n in inner if len(open_) + len(open_[n][0]) - 1 <= SMALL]
        if not fits:
            break
        chosen = fits[int(random.integers(len(fits)))]
        tree, along = open_.pop(chosen)
        open_ += [(below, 1 - along) for below in tree]
    return tuple(
        Joined(units_of(tree), tree, -1 if isinstance(tree, int) else along)
        for tree, along in open_
    )


def units_of(tree: Tree) -> Units:
    """The units of a tree, ascending."""
    return tuple(sorted(leaves(tree)))
