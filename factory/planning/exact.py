"""The optimal assembly tree of a few units: an AND/OR search over all connected subsets.

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

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from factory.geometry.meshes import Array
from factory.planning.estimate import Expected
from factory.planning.subsets import APART, TIPS, Masks, Subsets, splits

RELAY = 1.0
"""The price of a relay."""

LONG = 1e4
"""Weight of the price against the cycle time: cycles are shorter than this [s]."""

ROBOT = 100.0
"""Weight of a robot against the sizes of sub-assemblies [m]."""

STOPS = 4
"""The most inputs beyond two that a carrier takes if the cycle is bounded."""

Late = Callable[[], bool]
"""Tells whether a search must end."""

Leaf = Callable[[int, int], Any]
"""The tree of a unit whose own inputs come along an axis."""

Tree = Any
"""The number of a unit, or a tuple of trees: one that is relayed, two that are joined, or more that
one robot takes one after the other."""


class TooLate(Exception):
    """A search ran out of time before it had a proof."""


def never() -> bool:
    """A search without a time limit."""
    return False


@dataclass(frozen=True)
class TreeTask:
    """Units whose best trees are wanted: tables of their `subsets`, what stands upright (`axis`,
    and `up`, +1 or -1); `unit_prices` (2, n): the price of each unit if its own inputs come along
    either horizontal axis; `apart`: whether sub-assemblies may be in pieces, at a price."""

    subsets: Subsets
    expected: Expected
    axis: int = 2
    up: int = +1
    unit_prices: Array | None = field(default=None, repr=False)
    apart: bool = False

    @property
    def level(self) -> tuple[int, int]:
        """The horizontal axes of the product."""
        first, second = (axis for axis in range(3) if axis != self.axis)
        return first, second

    @cached_property
    def leg(self) -> Array:
        """The longer horizontal extent of each subset (s,) [m]."""
        return np.maximum(*(self.subsets.extent(axis) for axis in self.level))

    @cached_property
    def delivering(self) -> Array:
        """The time to deliver each subset (s,) [s]."""
        return self.expected.delivering(self.leg)

    def divisions(self, whole: int) -> tuple[Masks, Masks, Array]:
        """The divisions of a subset: both sides (k,), and the least prices (k, 3) along the first
        and second horizontal axis, whichever side moves, and along the vertical. The base is on the
        first side, which is then not lowered."""
        one = splits(whole)
        other = whole ^ one
        swapped = self.subsets.based[other]
        one, other = np.where(swapped, other, one), np.where(swapped, one, other)
        if not self.apart:
            hangs = self.subsets.hangs[one] & self.subsets.hangs[other]
            one, other = one[hangs], other[hangs]
        prices = np.stack(
            [
                np.minimum(*(self.subsets.price(axis, side, one, other) for side in (0, 1)))
                for axis in (*self.level, self.axis)
            ],
            axis=-1,
        )
        if self.subsets.based[whole]:
            prices[:, 2] = self.subsets.price(self.axis, 0 if self.up > 0 else 1, other, one)
        open_ = np.isfinite(prices).any(axis=1)
        return one[open_], other[open_], prices[open_]

    def strokes(self, one: Masks, other: Masks) -> Array:
        """The stroke by which the side that needs the shorter one is lowered (k,) [m]."""
        low, high = self.subsets.low[self.axis], self.subsets.high[self.axis]
        return np.asarray(np.minimum(high[other] - low[one], high[one] - low[other]))

    def subassemblies(self) -> Iterator[int]:
        """The subsets of two units or more, smaller ones first."""
        order = np.argsort(self.subsets.size, kind="stable")
        useful = self.subsets.hangs | self.apart
        useful[-1] = True
        yield from order[(self.subsets.size[order] > 1) & useful[order]].tolist()

    def penalty(self, whole: int) -> float:
        """The price of a sub-assembly in pieces, or that would tip over."""
        if whole == self.subsets.whole:
            return 0.0
        pieces, tips = not self.subsets.hangs[whole], bool(self.subsets.tips[whole])
        return APART * pieces + TIPS * tips


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
    for whole in task.subassemblies():
        if late():
            raise TooLate
        one, other, prices = task.divisions(whole)
        if not len(one):
            continue
        base = np.maximum(stop[one], stop[other]) + task.delivering[whole]
        lift = task.expected.lift(task.strokes(one, other))
        for axis in (0, 1):
            slides = prices[:, axis] <= prices[:, 2]
            cost = np.where(slides, prices[:, axis], prices[:, 2])
            cost = cost + price[1 - axis, one] + price[1 - axis, other] + task.penalty(whole)
            below = np.maximum(time[1 - axis, one], time[1 - axis, other])
            mine = np.maximum(below, base + np.where(slides, 0.0, lift))
            n = int(np.argmin(cost * LONG + mine))
            price[axis, whole], time[axis, whole] = cost[n], mine[n]
        _relayed(whole, price, time)
    return Tables(price, time)


def _relayed(whole: int, price: Array, time: Array) -> None:
    for axis in (0, 1):
        if price[1 - axis, whole] + RELAY < price[axis, whole]:
            price[axis, whole] = price[1 - axis, whole] + RELAY
            time[axis, whole] = time[1 - axis, whole]


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
        for whole in task.subassemblies():
            if late():
                raise TooLate
            self._solve(whole)

    def _solve(self, whole: int) -> None:
        divisions = self.task.divisions(whole)
        if not len(divisions[0]):
            return
        for axis in (0, 1):
            for stops in range(self.stops):
                options = self._options(whole, axis, stops, divisions)
                self.piles[stops, axis, whole] = min((o[0].min() for o in options), default=np.inf)
            self.made[axis, whole] = self.piles[:, axis, whole].min()
        for axis in (0, 1):
            turned = self.made[1 - axis, whole] + RELAY * LONG**2 + ROBOT
            self.made[axis, whole] = min(self.made[axis, whole], turned)

    def _options(
        self, whole: int, axis: int, stops: int, divisions: tuple[Masks, Masks, Array]
    ) -> list[tuple[Array, Masks, Masks, str]]:
        """All ways to form a pile: their worth (less is better), both sides (the pile first), and
        the operation."""
        one, other, prices = divisions
        fixed = self.task.penalty(whole) * LONG**2 + self.task.leg[whole]
        options = []
        if stops == 0:
            worth = self._mates(whole, axis, one, other, prices) + fixed
            options.append((worth, one, other, "mate"))
        if stops > 0 or (self.bound == np.inf and not self.mates):
            sides = ((one, other), (other, one))
            for pile, come in sides[: 1 if self.task.subsets.based[whole] else 2]:
                worth = self._inserts(whole, axis, stops, pile, come, prices) + fixed
                options.append((worth, pile, come, "insert"))
        return options

    def _mates(self, whole: int, axis: int, one: Masks, other: Masks, prices: Array) -> Array:
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
        self, whole: int, axis: int, stops: int, pile: Masks, come: Masks, prices: Array
    ) -> Array:
        side = 0 if self.task.up > 0 else 1
        lowered = self.task.subsets.price(self.task.axis, side, come, pile)
        cost = np.minimum(prices[:, axis], lowered)
        before = self.piles[max(stops - 1, 0), axis, pile]
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
        options = self._options(whole, axis, stops, self.task.divisions(whole))
        worth, one, other, how = min(options, key=lambda o: float(o[0].min()))
        n = int(worth.argmin())
        last = self.tree(int(other[n]), 1 - axis, leaf)
        if how == "mate":
            return [self.tree(int(one[n]), 1 - axis, leaf), last]
        return [*self._inputs(int(one[n]), axis, max(stops - 1, 0), leaf), last]
