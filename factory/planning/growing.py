"""Trees of many units: divided from the top, then improved by local search.

The first tree is found by division. Division always succeeds: a subset of units that can be taken
apart can be taken apart, so no choice has to be undone. Then neighbourhoods are optimised: a join
and a part of the tree below it, in which the remaining sub-assemblies count as units, is solved as
a small product is (`exact`), and replaced if the whole tree becomes better.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from factory.geometry.meshes import Array
from factory.planning.blocking import Blocking
from factory.planning.cannot import Units
from factory.planning.dividing import Divider
from factory.planning.divisions import Late, divisions, never
from factory.planning.exact import RELAY, Best, Expected, Tree, TreeTask
from factory.planning.judging import Judge, Judged
from factory.planning.subsets import ROOT_AXIS, Stance, subsets

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


@dataclass(frozen=True)
class Site:
    """A planning problem in one stance: the blocking `graphs` of a product and expected times.
    `unit_prices` (2, n): the price of each unit if its own inputs come along x or y of the
    floor."""

    graphs: Blocking
    stance: Stance
    expected: Expected
    unit_prices: Array = field(repr=False)


def solved(
    site: Site, groups: Sequence[Joined], axis: int, bound: float | None, late: Late = never
) -> Tree | None:
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
        best = Best(task, bound, late)
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
                tree = tuple(below(side, 1 - along) for side in (division.one, division.other))
                return (tree,) if turned else tree
        raise ValueError("interlocked")

    return below(tuple(range(len(site.graphs))), ROOT_AXIS)


def bettered(
    site: Site, first: Tree, bound: float, late: Late, random: np.random.Generator
) -> Iterator[Judged]:
    """Ever better trees, from a first one on, within a bound on expected cycles [s], until it is
    late or ROUNDS neighbourhoods of each join brought no improvement."""
    judge = Judge(site.graphs, site.stance, site.expected)
    best = judge.judged(first)
    yield best
    idle = 0
    while not late():
        joins = [place for place in _places(best.tree) if place]
        joins.append(())
        if idle > ROUNDS * len(joins):
            return
        place = joins[int(random.integers(len(joins)))]
        node, axis = _at(best.tree, place), (ROOT_AXIS + len(place)) % 2
        groups = _groups(node, axis, random)
        solution = solved(site, groups, axis, bound) if len(groups) > 2 else None
        idle += 1
        if solution is None or solution == node:
            continue
        other = judge.judged(_replaced(best.tree, place, solution))
        if _worth(other, bound) < _worth(best, bound):
            best, idle = other, 0
            yield best


def _worth(judged: Judged, bound: float) -> tuple[float, ...]:
    """The rank of a tree: less is better."""
    over = max(judged.seconds - bound, 0.0)
    return judged.price, round(over, 6), judged.robots, round(judged.sizes, 6)


def _places(tree: Tree, place: tuple[int, ...] = ()) -> Iterator[tuple[int, ...]]:
    """The ways from the root to all joins of a tree."""
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


def _groups(node: Tree, axis: int, random: np.random.Generator) -> list[Joined]:
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
    return [
        Joined(units_of(tree), tree, -1 if isinstance(tree, int) else along)
        for tree, along in open_
    ]


def units_of(tree: Tree) -> Units:
    """The units of a tree, ascending."""
    if isinstance(tree, int):
        return (tree,)
    return tuple(sorted(unit for below in tree for unit in units_of(below)))
