"""Candidate trees for layout: for each of the cheapest stances, the best trees within some bounds
on the expected cycle time."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import Literal

import numpy as np

from factory.geometry.meshes import Array
from factory.planning.blocking import Blocking
from factory.planning.estimate import Expected
from factory.planning.exact import Best, Late, TooLate, TreeTask, tables
from factory.planning.growing import Site, bettered, divided
from factory.planning.judging import Judge, Judged
from factory.planning.stance import ROOT_AXIS, Stance, stances
from factory.planning.subsets import MOST, Subsets, subsets

Aim = Literal["cycle", "robots", "floor"]
"""The objective of planning."""

BOUNDS: dict[Aim, tuple[float, ...]] = {
    "cycle": (1.0, 1.4, 1.15, 1.8),
    "robots": (np.inf,),
    "floor": (1.0, 1.4, np.inf),
}
"""The bounds on expected cycles, as multiples of the least."""

SEVERAL = 3
"""The most stances that are tried for each bound."""

EVEN = (1.0, 0.3, 0.0)
"""How even divisions of many units are preferred to be, in order: 1 for halves, 0 for any."""

PROOF, EACH = 30.0, 0.2
"""Default search times [s]: for up to MOST units, whose trees may be proved optimal; per unit for
more."""

SURE = 12
"""The trees of up to so many units are proved optimal, however long that takes, unless the search
is stopped or has a given time limit."""

GROWN, PROVED = 0.4, 0.6
"""Shares of the time after which the local search ends, and proofs are abandoned: the rest is for
layouts."""

UnitPrices = Callable[[Stance], Array]
"""The price (2, n) of each unit in a stance if its own inputs come along x or y of the floor."""


def usual_seconds(units: int) -> float:
    """The default search time for so many units [s]."""
    return PROOF if units <= MOST else EACH * units


@dataclass(frozen=True)
class Budget:
    """A time limit [s] that starts when the value is made. `asked`: whether the user gave it, so
    that it bounds proofs too; `stopped` tells whether the search must end at once."""

    seconds: float
    asked: bool = True
    begin: float = field(default_factory=perf_counter)
    stopped: Callable[[], bool] = lambda: False

    def late(self) -> bool:
        """Whether the time is used up."""
        return self.stopped() or perf_counter() - self.begin > self.seconds

    @property
    def left(self) -> float:
        """The remaining time [s]; 0 if the search must end at once."""
        return 0.0 if self.late() else self.seconds * (1 - self.gone)

    @property
    def gone(self) -> float:
        """The share of the time that is used up."""
        return (perf_counter() - self.begin) / self.seconds

    def share(self, part: float) -> Late:
        """A function that tells whether a share of the time, from its start, is used up."""
        return replace(self, seconds=part * self.seconds).late


@dataclass(frozen=True)
class Sought:
    """A search for trees: the blocking `graphs`, the `stances` to try, the `budget`; `told` is
    called with each tree."""

    graphs: Blocking
    expected: Expected
    unit_prices: UnitPrices
    aim: Aim = "cycle"
    budget: Budget = field(default_factory=lambda: Budget(60.0))
    told: Callable[[Judged], None] = field(default=lambda _: None)
    stances: tuple[Stance, ...] = field(default_factory=stances)

    def site(self, stance: Stance) -> Site:
        """The problem in one stance."""
        return Site(self.graphs, stance, self.expected, self.unit_prices(stance))


@dataclass(frozen=True)
class Trees:
    """The trees of least price, the best by estimate first. `optimal`: whether it is proved that no
    tree has a lower price and that, within the bound of each tree, none has fewer robots or smaller
    sub-assemblies."""

    all: tuple[Judged, ...]
    optimal: bool


def trees(sought: Sought) -> Trees:
    """Candidate trees for layout, at least one."""
    kept: dict[object, Judged] = {}
    optimal = False
    few = len(sought.graphs) <= MOST
    sure = len(sought.graphs) <= SURE

    def keep(batch: Iterator[Judged]) -> None:
        for judged in batch:
            sought.told(judged)
            kept.setdefault((judged.tree, judged.stance), judged)

    if not sure:
        keep(_grown(sought, GROWN / 2 if few else GROWN))
    try:
        if few:
            endless = sure and not sought.budget.asked
            late = sought.budget.stopped if endless else sought.budget.share(PROVED)
            keep(_proved(sought, late))
            optimal = True
    except TooLate:
        if not kept:
            keep(_grown(sought, GROWN))
    by_robots = sought.aim == "robots"
    ranks = {j: (j.price, j.robots if by_robots else 0, j.seconds, j.robots) for j in kept.values()}
    least = min(judged.price for judged in ranks)
    best = [judged for judged in ranks if judged.price == least]
    return Trees(tuple(sorted(best, key=ranks.__getitem__)), optimal)


def _proved(sought: Sought, late: Late) -> Iterator[Judged]:
    """The best trees of a small product, in the best stances. Raises TooLate."""
    table = subsets(sought.graphs)
    for apart in (False, True):
        ranks = _ranks(
            sought.stances,
            lambda stance, a=apart: _task(sought, table, stance, a),  # type: ignore[misc]
            late,
        )
        if ranks:
            break
    judges = {stance: Judge(sought.graphs, stance, sought.expected) for stance, _, _ in ranks}
    for factor in BOUNDS[sought.aim]:
        for stance, _, seconds in ranks:
            task = _task(sought, table, stance, apart)
            at = task.level.index(stance.axes[ROOT_AXIS])
            best = Best(task, factor * seconds if factor < np.inf else np.inf, late)
            yield judges[stance].judged(best.tree(table.whole, at))


def _task(sought: Sought, table: Subsets, stance: Stance, apart: bool) -> TreeTask:
    level = sorted(stance.axes[:2])
    prices = sought.unit_prices(stance)[[stance.axes.index(axis) for axis in level]]
    return TreeTask(table, sought.expected, stance.axes[2], stance.up, prices, apart)


def _ranks(
    choice: Sequence[Stance], task_of: Callable[[Stance], TreeTask], late: Late
) -> list[tuple[Stance, float, float]]:
    """The cheapest stances, each with its least price and its least expected cycle [s]."""
    ranks: list[tuple[Stance, float, float]] = []
    solved: dict[bytes, tuple[Array, Array]] = {}
    for stance in choice:
        task = task_of(stance)
        key = bytes([task.axis]) + (b"" if task.unit_prices is None else task.unit_prices.tobytes())
        if key not in solved:
            solution = tables(task, late)
            solved[key] = solution.price[:, -1], solution.time[:, -1]
        at = task.level.index(stance.axes[ROOT_AXIS])
        price, time = solved[key]
        if np.isfinite(price[at]):
            ranks.append((stance, float(price[at]), float(time[at])))
    if not ranks:
        return []
    least = min(price for _, price, _ in ranks)
    good = [rank for rank in ranks if rank[1] == least]
    return good[:SEVERAL]


def _grown(sought: Sought, share: float) -> Iterator[Judged]:
    """Ever better trees of a large product, until a share of the time is used up or the search
    converges."""
    late = sought.budget.share(share)
    random = np.random.default_rng(0)
    first: list[Judged] = []
    for stance in sought.stances:
        for even in EVEN:
            site = sought.site(stance)
            tree = divided(site, random, even)
            first.append(Judge(sought.graphs, stance, sought.expected).judged(tree))
            if late() or first[-1].price == 0.0:
                break
        if late():
            break
    least = min(judged.price for judged in first)
    best = min(first, key=lambda j: (j.price > least, j.seconds))
    yield best
    factors, begin = BOUNDS[sought.aim], sought.budget.gone
    for number, factor in enumerate(factors):
        bound = factor * best.seconds
        late = sought.budget.share(begin + (share - begin) * (number + 1) / len(factors))
        site, last = sought.site(best.stance), best
        for judged in bettered(site, best.tree, bound, late, random):
            sought.told(judged)
            last = judged
        yield last
