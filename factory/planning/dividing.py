"""Divisions of many units in two: connected closed sets of the blocking graphs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from factory.geometry.meshes import Array
from factory.planning.blocking import CLASHES, DEEPER, LOCKED, Blocking
from factory.planning.cannot import Units
from factory.planning.subsets import APART, BLOCKED, LOOSE, PASSES, TIPS

Sets = NDArray[np.bool_]

SEEDS = 6
"""The number of units from which sets are grown along each direction."""

TRIED = 40
"""The number of most promising divisions whose sides are tested for connectedness."""


@dataclass(frozen=True, slots=True)
class Division:
    """Two sides of some units, the one with the base first, and the price of dividing them."""

    one: Units
    other: Units
    price: float


@dataclass(frozen=True, slots=True)
class Divider:
    """Divides units by the blocking graphs of a product."""

    graphs: Blocking

    def best(
        self, members: Units, axes: tuple[int, ...], random: np.random.Generator, even: float = 1.0
    ) -> Division | None:
        """The division of least price along one of some axes; among equals, the more `even` one is
        preferred (0: no preference). None if the units interlock along all these axes."""
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
        if self.graphs.base in other:
            one, other = other, one
        return Division(one, other, float(best))

    def _unsound(self, members: list[int]) -> float:
        """The price of a side that is in pieces, or would tip over."""
        feet = self.graphs.feet
        tips = feet is not None and len(members) > 1 and bool(feet.joined(members).tips[0])
        return APART * (not self.graphs.hangs(members)) + TIPS * tips

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
                needs = _reached(locks)
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


def _reached(locks: NDArray[np.bool_]) -> Sets:
    """The units that must leave with each unit (n, n): itself, those that lock it, those that lock
    these."""
    reach = (locks | np.eye(len(locks), dtype=bool)).astype(np.float32)
    while True:
        further = (reach @ reach > 0).astype(np.float32)
        if np.array_equal(further, reach):
            return np.asarray(reach > 0)
        reach = further


def _prices(levels: NDArray[np.int8], sets: Sets) -> Array:
    """The prices (k,) of removing each of some sets."""
    prices = np.zeros(len(sets))
    for level, price in ((DEEPER, LOOSE), (LOCKED, PASSES), (CLASHES, BLOCKED)):
        meets = sets.astype(np.float32) @ (levels >= level).astype(np.float32)
        prices[((meets > 0) & ~sets).any(axis=1)] = price
    return prices
