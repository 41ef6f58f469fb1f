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

from factory.api import Approach, Pace
from factory.apps.planning.divisions import Batch, Divisions, Late, Levels, TooLate, never
from factory.apps.planning.subsets import LEVEL_PRICES, UNDER, Masks, Subsets
from factory.support.arrays import Array

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
        return self.rest(np.maximum(stroke, 0.0) + Approach.MARGIN)


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


@dataclass(frozen=True, slots=True)
class Piling:
    """One way to form the piles of some divisions on robots that have taken so many inputs beyond
    two (`stops`): their `worth` (stops, 2, k), less is better, the `pile` (k,) and what is to
    `come` (k,), and the operation."""

    stops: tuple[int, ...]
    worth: Array
    pile: Masks
    come: Masks
    how: str


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
        for option in self._options(batch):
            least = np.minimum.reduceat(option.worth, starts, axis=-1)
            for stops, worth in zip(option.stops, least, strict=True):
                self.piles[stops, :, wholes] = np.minimum(self.piles[stops, :, wholes], worth.T)
        self.made[:, wholes] = self.piles[:, :, wholes].min(axis=0)
        for axis in (0, 1):
            turned = self.made[1 - axis, wholes] + RELAY * LONG**2 + ROBOT
            self.made[axis, wholes] = np.minimum(self.made[axis, wholes], turned)

    def _options(self, batch: Batch) -> list[Piling]:
        """All ways to form piles."""
        one, other = batch.one, batch.other
        fixed = self.task.subsets.penalty[batch.whole] * LONG**2 + self.task.leg[batch.whole]
        options = [Piling((0,), (self._mates(batch) + fixed)[None], one, other, "mate")]
        stops = () if self.mates else tuple(range(1, self.stops)) or (0,)
        if stops:
            worth = self._inserts(batch, stops, one, other, batch.onto[:, 0]) + fixed
            options.append(Piling(stops, worth, one, other, "insert"))
            worth = self._inserts(batch, stops, other, one, batch.onto[:, 1]) + fixed
            worth[:, :, self.task.subsets.based[batch.whole]] = np.inf
            options.append(Piling(stops, worth, other, one, "insert"))
        return options

    def _mates(self, batch: Batch) -> Array:
        """The worth (2, k) of what a third robot takes."""
        one, other, prices = batch.one, batch.other, batch.prices.T
        slides = prices[:2] <= prices[2]
        cost = np.where(slides, prices[:2], prices[2])
        made = self.made[::-1]
        worth = made[:, one] + made[:, other] + cost * LONG**2 + ROBOT
        if self.bound < np.inf:
            time = np.maximum(self.stop[one], self.stop[other]) + self.task.delivering[batch.whole]
            lift = self.task.expected.lift(self.task.strokes(one, other))
            worth[time + np.where(slides, 0.0, lift) > self.bound + 1e-9] = np.inf
        return np.asarray(worth)

    def _inserts(
        self, batch: Batch, stops: tuple[int, ...], pile: Masks, come: Masks, onto: Levels
    ) -> Array:
        """The worth (stops, 2, k) of what the robot of a pile takes."""
        cost = np.minimum(batch.prices.T[:2], LEVEL_PRICES[onto])
        cost = cost + UNDER * self.task.subsets.under(pile, come)
        before = self.piles[[max(number - 1, 0) for number in stops]][:, :, pile]
        worth = before + self.made[::-1, come] + cost * LONG**2
        if self.bound < np.inf:
            time = (self.stop[come] + self.step[come]) * np.array(stops)[:, None]
            time = time + self.stop[pile] + self.task.delivering[batch.whole]
            worth = np.where(time[:, None] > self.bound + 1e-9, np.inf, worth)
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
        options = [o for o in self._options(self.task.divisions.of(whole)) if stops in o.stops]
        rows = [option.worth[option.stops.index(stops), axis] for option in options]
        chosen = int(np.argmin([row.min() for row in rows]))
        n, option = int(rows[chosen].argmin()), options[chosen]
        one, other = option.pile, option.come
        last = self.tree(int(other[n]), 1 - axis, leaf)
        if option.how == "mate":
            return [self.tree(int(one[n]), 1 - axis, leaf), last]
        return [*self._inputs(int(one[n]), axis, max(stops - 1, 0), leaf), last]
