"""The optimal assembly tree of a few units, by expected cycle times: an AND/OR search over all
connected subsets.

A state is a subset of the units and an axis of the floor, along which its inputs come; its choices
are the divisions in two that its blocking graphs permit (closed sets of one of the graphs), its
successors both sides. All states are solved, smaller ones first, so the result is optimal:

1. `tables`: the least price (accepted clashes, parts drawn into each other, relays), then the least
   cycle time. Only joins that a third robot takes are considered: a join on the robot of a pile has
   the same motions, and lengthens that robot's cycle.
2. `Best`: among the trees of least price within a bound on the cycle time, the fewest robots (a
   pile that stays on its robot saves one), then the smallest sub-assemblies.

A robot that takes over a sub-assembly from another changes its axis (`relay`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from factory.api import Array, Pace
from factory.apps.planning.divisions import Batch, Divisions, Late, TooLate, never
from factory.apps.planning.subsets import LEVEL_PRICES, UNDER, Masks, Subsets
from factory.theory.plant.approaches import MARGIN

STATION = 0.06
"""The distance between two stations on a guidepath beyond the size of a sub-assembly [m]."""


@dataclass(frozen=True, slots=True)
class Expected:
    """Times [s] at the `pace` of robots, elementwise for arrays of lengths [m]."""

    pace: Pace

    def rest(self, way: Array) -> Array:
        """From rest to rest."""
        speed, acceleration = self.pace.speed, self.pace.acceleration
        short = 2 * np.sqrt(np.maximum(way, 0.0) / acceleration)
        return np.where(way < speed**2 / acceleration, short, way / speed + speed / acceleration)

    def delivering(self, size: Array) -> Array:
        """The time of a robot to deliver something of this size and return."""
        return 2 * self.rest(size + STATION) + self.pace.lost

    def stop(self, size: Array) -> Array:
        """The time of a carrier to take something of this size."""
        return self.rest(size + STATION) + self.pace.lost

    def step(self, size: Array) -> Array:
        """The additional time to move on to the next station."""
        return (size + STATION) / self.pace.speed

    def lift(self, stroke: Array) -> Array:
        """The waiting time while a part is lowered by a stroke."""
        return self.rest(np.maximum(stroke, 0.0) + MARGIN)


RELAY = 1.0
"""The price of a relay."""

LONG = 1e4
"""Weight of the price against the cycle time: cycles are shorter than this [s]."""

ROBOT = 100.0
"""Weight of a robot against the sizes of sub-assemblies [m]."""

STOPS = 4
"""The most inputs beyond two that a carrier takes if the cycle is bounded."""

Leaf = Callable[[int, int], Any]
"""The tree of a unit whose own inputs come along an axis."""

Tree = Any
"""The number of a unit, or a tuple of trees: one that is relayed, two that are joined, or more that
one robot takes one after the other."""


@dataclass(frozen=True)
class TreeTask:
    """Units whose best trees are wanted, of some `divisions`; `unit_prices` (2, n): the price of
    each unit if its own inputs come along either horizontal axis."""

    divisions: Divisions
    expected: Expected
    unit_prices: Array | None = field(default=None, repr=False)

    @property
    def subsets(self) -> Subsets:
        """The tables of the subsets."""
        return self.divisions.subsets

    @cached_property
    def leg(self) -> Array:
        """The longer horizontal extent of each subset (s,) [m]."""
        return np.maximum(*(self.subsets.extent(axis) for axis in self.divisions.level))

    @cached_property
    def delivering(self) -> Array:
        """The time to deliver each subset (s,) [s]."""
        return self.expected.delivering(self.leg)

    def strokes(self, one: Masks, other: Masks) -> Array:
        """The stroke by which the side that needs the shorter one is lowered (k,) [m]."""
        low, high = self.subsets.low[self.divisions.axis], self.subsets.high[self.divisions.axis]
        return np.asarray(np.minimum(high[other] - low[one], high[one] - low[other]))


@dataclass(frozen=True, slots=True)
class Tables:
    """The least `price` (2, s) of each subset by the axis along which its inputs come, and of those
    the least cycle `time` (2, s) [s]."""

    price: Array
    time: Array


def tables(task: TreeTask, late: Late = never) -> Tables:
    """Solves all states for price and cycle time. Raises TooLate."""
    size = 1 << task.subsets.count
    price, time = np.full((2, size), np.inf), np.zeros((2, size))
    units = 1 << np.arange(task.subsets.count)
    price[:, units] = 0.0 if task.unit_prices is None else task.unit_prices
    time[:, units] = task.expected.pace.lost + task.delivering[units]
    stop = task.expected.stop(task.leg)
    for batch in task.divisions.batches:
        if late():
            raise TooLate
        one, other, prices, starts = batch.one, batch.other, batch.prices, batch.starts
        penalty = task.subsets.penalty[batch.whole]
        base = np.maximum(stop[one], stop[other]) + task.delivering[batch.whole]
        lift = task.expected.lift(task.strokes(one, other))
        wholes = batch.whole[starts]
        for axis in (0, 1):
            slides = prices[:, axis] <= prices[:, 2]
            cost = np.where(slides, prices[:, axis], prices[:, 2])
            cost = cost + price[1 - axis, one] + price[1 - axis, other] + penalty
            below = np.maximum(time[1 - axis, one], time[1 - axis, other])
            mine = np.maximum(below, base + np.where(slides, 0.0, lift))
            best = _first_least(cost * LONG + mine, starts)
            price[axis, wholes], time[axis, wholes] = cost[best], mine[best]
        for axis in (0, 1):
            turned = wholes[price[1 - axis, wholes] + RELAY < price[axis, wholes]]
            price[axis, turned] = price[1 - axis, turned] + RELAY
            time[axis, turned] = time[1 - axis, turned]
    return Tables(price, time)


def _first_least(values: Array, starts: Masks) -> Masks:
    """The first of the least values in each of the stretches that begin at some rows."""
    least = np.minimum.reduceat(values, starts)
    counts = np.diff(starts, append=len(values))
    equal = np.flatnonzero(values == np.repeat(least, counts))
    return np.asarray(equal[np.searchsorted(equal, starts)])


class Best:
    """The best trees of a task within a `bound` on cycles [s]: least price, then fewest robots,
    each worth ROBOT [m], and smallest sub-assemblies. If the bound is None, no robot stays with a
    pile. Raises TooLate once it is `late`.

    `piles` (stops, 2, s): the worth of a pile on a robot that has taken so many inputs beyond two;
    `made` (2, s): the worth of a sub-assembly that is delivered.
    """

    def __init__(self, task: TreeTask, bound: float | None = np.inf, late: Late = never) -> None:
        self.task, self.bound, self.mates = task, np.inf if bound is None else bound, bound is None
        size = 1 << task.subsets.count
        self.stops = 1 + (STOPS if self.bound < np.inf else 0)
        self.piles = np.full((self.stops, 2, size), np.inf)
        self.made = np.full((2, size), np.inf)
        units = 1 << np.arange(task.subsets.count)
        prices = np.zeros((2, len(units))) if task.unit_prices is None else task.unit_prices
        self.made[:, units] = prices * LONG**2 + ROBOT
        self.stop = task.expected.stop(task.leg)
        self.step = task.expected.step(task.leg)
        for batch in task.divisions.batches:
            if late():
                raise TooLate
            self._solve(batch)

    def _solve(self, batch: Batch) -> None:
        starts = batch.starts
        wholes = batch.whole[starts]
        for axis in (0, 1):
            for stops in range(self.stops):
                options = self._options(batch, axis, stops)
                least = [np.minimum.reduceat(worth, starts) for worth, *_ in options]
                if least:
                    self.piles[stops, axis, wholes] = np.minimum.reduce(least)
            self.made[axis, wholes] = self.piles[:, axis, wholes].min(axis=0)
        for axis in (0, 1):
            turned = self.made[1 - axis, wholes] + RELAY * LONG**2 + ROBOT
            self.made[axis, wholes] = np.minimum(self.made[axis, wholes], turned)

    def _options(
        self, batch: Batch, axis: int, stops: int
    ) -> list[tuple[Array, Masks, Masks, str]]:
        """All ways to form piles: their worth (less is better), both sides (the pile first), and
        the operation."""
        one, other, prices = batch.one, batch.other, batch.prices
        fixed = self.task.subsets.penalty[batch.whole] * LONG**2 + self.task.leg[batch.whole]
        options = []
        if stops == 0:
            worth = self._mates(batch.whole, axis, one, other, prices) + fixed
            options.append((worth, one, other, "mate"))
        if stops > 0 or (self.bound == np.inf and not self.mates):
            worth = self._inserts(batch.whole, axis, stops, one, other, prices) + fixed
            options.append((worth, one, other, "insert"))
            worth = self._inserts(batch.whole, axis, stops, other, one, prices) + fixed
            worth[self.task.subsets.based[batch.whole]] = np.inf
            options.append((worth, other, one, "insert"))
        return options

    def _mates(self, whole: Masks, axis: int, one: Masks, other: Masks, prices: Array) -> Array:
        slides = prices[:, axis] <= prices[:, 2]
        cost = np.where(slides, prices[:, axis], prices[:, 2])
        worth = self.made[1 - axis, one] + self.made[1 - axis, other]
        worth = worth + cost * LONG**2 + ROBOT
        if self.bound < np.inf:
            time = np.maximum(self.stop[one], self.stop[other]) + self.task.delivering[whole]
            lift = self.task.expected.lift(self.task.strokes(one, other))
            worth[time + np.where(slides, 0.0, lift) > self.bound + 1e-9] = np.inf
        return np.asarray(worth)

    def _inserts(
        self, whole: Masks, axis: int, stops: int, pile: Masks, come: Masks, prices: Array
    ) -> Array:
        side = 0 if self.task.divisions.up > 0 else 1
        level = self.task.subsets.level(self.task.divisions.axis, side, come, pile)
        cost = np.minimum(prices[:, axis], LEVEL_PRICES[level])
        before = self.piles[max(stops - 1, 0), axis, pile]
        cost = cost + UNDER * self.task.subsets.under(pile, come)
        worth = before + self.made[1 - axis, come] + cost * LONG**2
        if self.bound < np.inf:
            time = self.stop[come] + self.step[come]
            time = time * stops + self.stop[pile] + self.task.delivering[whole]
            worth[time > self.bound + 1e-9] = np.inf
        return np.asarray(worth)

    def tree(self, whole: int, axis: int, leaf: Leaf = lambda unit, _: unit) -> Tree:
        """The best tree of a subset whose inputs come along an axis; `leaf` gives that of a unit
        whose own inputs come along an axis."""
        if whole.bit_count() == 1:
            return leaf(whole.bit_length() - 1, axis)
        if self.piles[:, axis, whole].min() > self.made[axis, whole]:
            return (self.tree(whole, 1 - axis, leaf),)
        stops = int(self.piles[:, axis, whole].argmin())
        return tuple(self._inputs(whole, axis, stops, leaf))

    def _inputs(self, whole: int, axis: int, stops: int, leaf: Leaf) -> list[Tree]:
        options = self._options(self.task.divisions.of(whole), axis, stops)
        worth, one, other, how = min(options, key=lambda o: float(o[0].min()))
        n = int(worth.argmin())
        last = self.tree(int(other[n]), 1 - axis, leaf)
        if how == "mate":
            return [self.tree(int(one[n]), 1 - axis, leaf), last]
        return [*self._inputs(int(one[n]), axis, max(stops - 1, 0), leaf), last]
