"""Candidate trees for layout: for each of the cheapest stances, the best trees within some bounds
on the expected cycle time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cache
from math import inf
from typing import Literal

import numpy as np

from factory.apps.planning.blocking import Blocking
from factory.apps.planning.divisions import Divisions, KnownDivisions, Late, TooLate, divisions
from factory.apps.planning.exact import Best, Expected, Tables, TreeTask, tables
from factory.apps.planning.growing import bettered, divided
from factory.apps.planning.judging import Judged, Site
from factory.apps.planning.subsets import MOST, ROOT_AXIS, Stance, Subsets, stances, subsets
from factory.support.allowance import Allowance
from factory.support.arrays import Array

Aim = Literal["cycle", "robots", "floor"]
"""The objective of planning."""

BOUNDS: dict[Aim, tuple[float, ...]] = {
    "cycle": (1.0, 1.4, 1.15, 1.8),
    "robots": (inf,),
    "floor": (1.0, 1.4, inf),
}
"""The bounds on expected cycles, as multiples of the least."""

SEVERAL = 3
"""The most stances that are tried for each bound."""

EVEN, UNEVEN, LARGE = (1.0, 0.3), (0.0, 0.1), 64
"""How even divisions of many units are preferred to be, in order, 1 for halves; and at last, 0 for
any, 0.1 from LARGE units on: dividing by single units takes much longer."""

CANDIDATES, FEWER, MANY = 40, 5, 40
"""The search for a tree ends after so many candidates for each unit: neighbourhoods of a tree; from
MANY units on after fewer for each further one."""

PROVING, GROWING = 0.3, 0.6
"""Shares of the budget after which proofs are abandoned, and the local search ends: the rest is for
layouts."""

DIVISIONS = 1_000_000
"""The most divisions of subsets of units for which there are proofs: 13 units that all touch, and
block nothing, have 800,000."""

ABOVE = 50.0
"""Trees are first sought at prices up to so much above the lower bound: less than an operation with
any blocking costs."""

UnitPrices = Callable[[Stance], Array]
"""The price (2, n) of each unit in a stance if its own inputs come along x or y of the floor."""


def budget_of(
    units: int, seconds: float | None = None, stopped: Callable[[], bool] = lambda: False
) -> Allowance:
    """The budget of a search: candidates for each unit, or the time that the user gave [s]. A
    search that is `stopped` ends at once."""
    several = CANDIDATES * min(units, MANY) + FEWER * max(units - MANY, 0)
    effort = several if seconds is None else inf
    return Allowance(effort / GROWING, inf if seconds is None else seconds, stopped)


@dataclass(frozen=True)
class Sought:
    """A search for trees: the blocking `graphs`, the `stances` to try, the `budget`; `told` is
    called with each tree; `known`: the divisions that were computed before."""

    graphs: Blocking
    expected: Expected
    unit_prices: UnitPrices
    aim: Aim = "cycle"
    budget: Allowance = field(default_factory=lambda: budget_of(MOST))
    told: Callable[[Judged], None] = field(default=lambda _: None)
    stances: tuple[Stance, ...] = field(default_factory=stances)
    known: KnownDivisions = field(default_factory=KnownDivisions, compare=False, repr=False)

    def site(self, stance: Stance) -> Site:
        """The problem in one stance."""
        return Site(self.graphs, stance, self.expected, self.unit_prices(stance))


@dataclass(frozen=True)
class Trees:
    """The trees of least price, the best by estimate first, the others in its stance after it.
    `optimal`: whether it is proved that no tree has a lower price and that, within the bound of
    each tree, none has fewer robots or smaller sub-assemblies."""

    all: tuple[Judged, ...]
    optimal: bool


def trees(sought: Sought) -> Trees:
    """Candidate trees for layout, at least one."""
    kept: dict[object, Judged] = {}
    optimal = False

    def keep(batch: Iterator[Judged]) -> None:
        for judged in batch:
            sought.told(judged)
            kept.setdefault((judged.tree, judged.stance), judged)

    try:
        if len(sought.graphs) <= MOST:
            keep(_proved(sought))
            optimal = True
    except TooLate:
        pass
    if not kept:
        keep(_grown(sought))
    by_robots = sought.aim == "robots"
    ranks = {j: (j.price, j.robots if by_robots else 0, j.seconds, j.robots) for j in kept.values()}
    least = min(judged.price for judged in ranks)
    best = [judged for judged in ranks if judged.price == least]
    best.sort(key=ranks.__getitem__)
    of_stance = {stance: n for n, stance in enumerate(dict.fromkeys(j.stance for j in best))}
    return Trees(tuple(sorted(best, key=lambda judged: of_stance[judged.stance])), optimal)


def least(sought: Sought) -> tuple[float, float] | None:
    """The least price of a tree of a few units, and the least expected cycle at that price [s];
    None if that takes too long to know."""

    def late() -> bool:
        return sought.budget.time_used > PROVING

    try:
        table = subsets(sought.graphs)
        ranks = _ranks(sought, table, False, late) or _ranks(sought, table, True, late)
    except TooLate:
        return None
    return min(((rank.price, rank.seconds) for rank in ranks), default=(inf, inf))


@dataclass(frozen=True, slots=True)
class Rank:
    """A stance with its least price, the least expected cycle at that price [s], and the divisions
    of trees at that price."""

    stance: Stance
    price: float
    seconds: float
    divisions: Divisions


def _proved(sought: Sought) -> Iterator[Judged]:
    """The best trees of a small product, in the best stances. Raises TooLate."""
    table = subsets(sought.graphs)

    def late() -> bool:
        return sought.budget.time_used > PROVING

    for apart in (False, True):
        ranks = _ranks(sought, table, apart, late)
        if ranks:
            break
    for factor in BOUNDS[sought.aim]:
        for rank in ranks:
            task = _task(sought, rank.stance, rank.divisions)
            at = rank.divisions.level.index(rank.stance.axes[ROOT_AXIS])
            best = Best(task, factor * rank.seconds if factor < inf else inf, late)
            yield sought.site(rank.stance).judged(best.tree(table.whole, at))


def _task(sought: Sought, stance: Stance, some: Divisions) -> TreeTask:
    prices = sought.unit_prices(stance)[[stance.axes.index(axis) for axis in some.level]]
    return TreeTask(some, sought.expected, prices)


def _ranks(sought: Sought, table: Subsets, apart: bool, late: Late) -> list[Rank]:
    """The cheapest stances."""

    @cache
    def all_of(axis: int, up: int) -> Divisions:
        return divisions(table, axis, up, apart, late, DIVISIONS, sought.known)

    ranks: list[Rank] = []
    solved: dict[tuple[int, int, bytes], Tables] = {}
    for stance in sought.stances:
        every = all_of(stance.axes[2], stance.up)
        at = every.level.index(stance.axes[ROOT_AXIS])
        for some in _cheap_first(every):
            task = _task(sought, stance, some)
            assert task.unit_prices is not None
            key = every.axis, every.up * (1 if some is every else 2), task.unit_prices.tobytes()
            if key not in solved:
                solved[key] = tables(task, late)
            price, seconds = float(solved[key].price[at, -1]), float(solved[key].time[at, -1])
            if price <= some.most:
                break
        if price < inf:
            ranks.append(Rank(stance, price, seconds, every))
    least = min((rank.price for rank in ranks), default=inf)
    good = [rank for rank in ranks if rank.price == least]
    return [replace(rank, divisions=rank.divisions.within(least)) for rank in good[:SEVERAL]]


def _cheap_first(every: Divisions) -> Iterator[Divisions]:
    """The divisions at little more than the lower bound on the price, which are few, and all of
    them, in case the bound is wide of the mark."""
    if every.least[-1] < inf:
        yield every.within(float(every.least[-1]) + ABOVE)
    yield every


def _grown(sought: Sought) -> Iterator[Judged]:
    """Ever better trees of a large product, until its share of the budget is used up or the search
    converges."""

    def late_after(share: float) -> Late:
        def late() -> bool:
            sought.budget.spend()
            return sought.budget.used > share

        return late

    late = late_after(GROWING)
    random = np.random.default_rng(0)
    first: list[Judged] = []
    evenness: tuple[float, ...] = (*EVEN, UNEVEN[len(sought.graphs) >= LARGE])
    for stance in sought.stances:
        for number, even in enumerate(evenness):
            site = sought.site(stance)
            tree = divided(site, random, even)
            first.append(site.judged(tree))
            if late():
                break
            if first[-1].hard == 0.0:
                evenness = evenness[number:]
                break
        if late():
            break
    least = min(judged.price for judged in first)
    best = min(first, key=lambda j: (j.price > least, j.seconds))
    yield best
    factors, begin = BOUNDS[sought.aim], sought.budget.used
    for number, factor in enumerate(factors):
        bound = factor * best.seconds
        late = late_after(begin + (GROWING - begin) * (number + 1) / len(factors))
        site, last = sought.site(best.stance), best
        for judged in bettered(site, best.tree, bound, late, random):
            sought.told(judged)
            last = judged
        yield last
