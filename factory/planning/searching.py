"""The trees that are worth being laid out: of each stance that costs least, for some bounds on the
expected cycle."""

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
"""What a tree is chosen for."""

BOUNDS: dict[Aim, tuple[float, ...]] = {
    "cycle": (1.0, 1.4, 1.15, 1.8),
    "robots": (np.inf,),
    "floor": (1.0, 1.4, np.inf),
}
"""The bounds on expected cycles, as multiples of the least."""

SEVERAL = 3
"""So many stances, at most, are tried for each bound."""

EVEN = (1.0, 0.3, 0.0)
"""Many units are divided in about equal halves first, then less evenly."""

PROOF, EACH = 30.0, 0.2
"""The usual times to search [s]: of up to MOST units, whose trees may be proved; for each of
more."""

SURE = 12
"""The trees of so many units are proved, however long it takes, unless the search is stopped or its
time was asked for."""

GROWN, PROVED = 0.4, 0.6
"""The shares of the time after which large products grow no more, and proofs are given up: layouts
need the rest."""

Given = Callable[[Stance], Array]
"""The price (2, n) of each unit in a stance if its own inputs come along x or y of the floor."""


def usual_seconds(units: int) -> float:
    """How long trees of so many units are sought where nothing else is asked for [s]."""
    return PROOF if units <= MOST else EACH * units


@dataclass(frozen=True)
class Budget:
    """A time to search [s], from when it is made; `asked`: whether it bounds all proofs; `stopped`:
    whether it is to end at once."""

    seconds: float
    asked: bool = True
    begin: float = field(default_factory=perf_counter)
    stopped: Callable[[], bool] = lambda: False

    def late(self) -> bool:
        """Whether all of it is gone."""
        return self.stopped() or perf_counter() - self.begin > self.seconds

    @property
    def left(self) -> float:
        """The time that is left [s], 0 where it is to end at once."""
        return 0.0 if self.late() else self.seconds * (1 - self.gone)

    @property
    def gone(self) -> float:
        """The share that is gone."""
        return (perf_counter() - self.begin) / self.seconds

    def share(self, part: float) -> Late:
        """Tells whether a part of it is gone, from its beginning on."""
        return replace(self, seconds=part * self.seconds).late


@dataclass(frozen=True)
class Sought:
    """What trees are sought for, in some of the `stances`, within a `budget`; `told` hears of each
    tree."""

    found: Blocking
    expected: Expected
    given: Given
    aim: Aim = "cycle"
    budget: Budget = field(default_factory=lambda: Budget(60.0))
    told: Callable[[Judged], None] = field(default=lambda _: None)
    stances: tuple[Stance, ...] = field(default_factory=stances)

    def site(self, stance: Stance) -> Site:
        """The same in one stance."""
        return Site(self.found, stance, self.expected, self.given(stance))


@dataclass(frozen=True)
class Trees:
    """The trees found, the best by estimate first; `optimal`: whether it is proved that none has a
    lower price, and within the bound of each none has fewer robots or smaller sub-assemblies."""

    all: tuple[Judged, ...]
    optimal: bool


def trees(sought: Sought) -> Trees:
    """Trees worth being laid out, at least one."""
    kept: dict[object, Judged] = {}
    optimal = False
    few = len(sought.found) <= MOST
    sure = len(sought.found) <= SURE

    def keep(found: Iterator[Judged]) -> None:
        for judged in found:
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
    table = subsets(sought.found)
    for apart in (False, True):
        ranks = _ranks(
            sought.stances,
            lambda stance, a=apart: _task(sought, table, stance, a),  # type: ignore[misc]
            late,
        )
        if ranks:
            break
    judges = {stance: Judge(sought.found, stance, sought.expected) for stance, _, _ in ranks}
    for factor in BOUNDS[sought.aim]:
        for stance, _, seconds in ranks:
            task = _task(sought, table, stance, apart)
            at = task.level.index(stance.axes[ROOT_AXIS])
            best = Best(task, factor * seconds if factor < np.inf else np.inf, late)
            yield judges[stance].judged(best.tree(table.whole, at))


def _task(sought: Sought, table: Subsets, stance: Stance, apart: bool) -> TreeTask:
    level = sorted(stance.axes[:2])
    given = sought.given(stance)[[stance.axes.index(axis) for axis in level]]
    return TreeTask(table, sought.expected, stance.axes[2], stance.up, given, apart)


def _ranks(
    choice: Sequence[Stance], task_of: Callable[[Stance], TreeTask], late: Late
) -> list[tuple[Stance, float, float]]:
    """The stances to be tried, each with its least price and its least expected cycle [s]."""
    found: list[tuple[Stance, float, float]] = []
    solved: dict[bytes, tuple[Array, Array]] = {}
    for stance in choice:
        task = task_of(stance)
        key = bytes([task.axis]) + (b"" if task.given is None else task.given.tobytes())
        if key not in solved:
            known = tables(task, late)
            solved[key] = known.price[:, -1], known.time[:, -1]
        at = task.level.index(stance.axes[ROOT_AXIS])
        price, time = solved[key]
        if np.isfinite(price[at]):
            found.append((stance, float(price[at]), float(time[at])))
    if not found:
        return []
    least = min(price for _, price, _ in found)
    good = [rank for rank in found if rank[1] == least]
    return good[:SEVERAL]


def _grown(sought: Sought, share: float) -> Iterator[Judged]:
    """Better and better trees of a large product, until a share of the time is gone or nothing gets
    better."""
    late = sought.budget.share(share)
    random = np.random.default_rng(0)
    first: list[Judged] = []
    for stance in sought.stances:
        for even in EVEN:
            site = sought.site(stance)
            tree = divided(site, random, even)
            first.append(Judge(sought.found, stance, sought.expected).judged(tree))
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
