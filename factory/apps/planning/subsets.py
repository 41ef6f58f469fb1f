"""Tables over all subsets of a few units, as bit masks: blocking, connectedness, size; and the
orientations of a product on the floor."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from factory.apps.planning.blocking import AXES, CLASHES, DEEPER, LOCKED, Blocking
from factory.support.arrays import Array

ROOT_AXIS = 1
"""The axis of the floor along which the inputs of the finished product come: y."""


@dataclass(frozen=True, slots=True)
class Stance:
    """The axes of the product that lie along x, y and z of the floor, and whether z of the floor is
    the upper side (+1) of its axis, or the lower one (-1)."""

    axes: tuple[int, int, int] = (0, 1, 2)
    up: int = +1

    @property
    def rotation(self) -> Array:
        """The rotation (3, 3) from the frame of the product to that of the floor: the one of two
        that turns by the smaller angle."""
        turned = [np.zeros((3, 3)) for _ in range(2)]
        for matrix, side in zip(turned, (+1.0, -1.0), strict=True):
            matrix[0, self.axes[0]] = side
            matrix[1, self.axes[1]] = 1.0
            matrix[2, self.axes[2]] = self.up
            if np.linalg.det(matrix) < 0:
                matrix[1, self.axes[1]] = -1.0
        return max(turned, key=lambda m: float(np.trace(m)))


def stances(up: tuple[int, int] | None = None) -> tuple[Stance, ...]:
    """The twelve stances, or those with an axis and side `up`. Of the 24 rotations, two that differ
    by half a turn about the vertical are one stance. The stance as drawn comes first, the other
    upright one second."""
    every = [Stance(axes, up) for axes in permutations(range(3)) for up in (+1, -1)]  # type: ignore[arg-type]
    if up is not None:
        every = [stance for stance in every if (stance.axes[2], stance.up) == up]
    return tuple(sorted(every, key=lambda s: (s.axes[2] != 2, -s.up, s.axes)))


Masks = NDArray[np.int64]

MOST = 16
"""The most units that have tables."""

BLOCKED, UNHELD, PASSES, LOOSE = 1e6, 5e4, 1e4, 1e2
"""The price of an operation with accepted clashes (`check` calls it blocked); with a side that no
hand can hold; with parts that were drawn into each other and pass through each other; with such
parts that get a little deeper. A relay costs less than any of these."""

LEVEL_PRICES = np.array([0.0, LOOSE, PASSES, UNHELD, BLOCKED, np.inf])
"""The prices of an operation by its level: free, as named above, and impossible."""

WAY_LEVELS = np.array([[5], [1], [2], [4]], np.uint8)
"""The level of a division of which one side is among the `Subsets.ways` of the other."""

UNHELD_LEVEL = np.uint8(3)
"""The level of a division of which no hand can hold a side."""

APART, TIPS, FALLS, UNDER = 1e5, 2e4, 10.0, 5.0
"""The price of a sub-assembly that is not connected, of one that would tip over by itself, of one
of which something would fall, and of an operation that puts a part under a pile."""


@dataclass(frozen=True)
class Subsets:
    """Tables by subset. `ways` (4, 3 axes, 2 sides, s): the units that block a subset which leaves
    along an axis to the upper or lower side: those that lock it, and those with a level of at least
    DEEPER, LOCKED and CLASHES; `hangs` (s,): whether it is connected; `low`, `high` (3, s): its box
    [m]; `size` (s,): its number of units; `tips` (s,): whether it would tip over; `stands` (s,):
    whether nothing of it would fall; `based` (s,): whether it contains the base; `unheld`: subsets
    that no hand can hold, and what they are joined to then; `below` (s,): the
    units on which a subset rests, empty if that does not matter."""

    count: int
    ways: Masks = field(repr=False)
    hangs: NDArray[np.bool_] = field(repr=False)
    low: Array = field(repr=False)
    high: Array = field(repr=False)
    size: Masks = field(repr=False)
    tips: NDArray[np.bool_] = field(repr=False)
    stands: NDArray[np.bool_] = field(repr=False)
    based: NDArray[np.bool_] = field(repr=False)
    unheld: tuple[tuple[int, int], ...] = ()
    below: Masks = field(default_factory=lambda: np.zeros(0, np.int64), repr=False)

    @cached_property
    def penalty(self) -> Array:
        """The prices (s,) of sub-assemblies in pieces, or that would tip over."""
        prices = APART * ~self.hangs + TIPS * self.tips + FALLS * ~self.stands
        prices[-1] = 0.0
        return np.asarray(prices)

    @property
    def whole(self) -> int:
        """All units."""
        return (1 << self.count) - 1

    def extent(self, axis: int) -> Array:
        """The length of each subset along an axis (s,) [m]."""
        return np.asarray(self.high[axis] - self.low[axis])

    def under(self, pile: Masks, come: Masks) -> NDArray[np.bool_]:
        """Whether what comes (k,) is put under a pile, and does not rest on it."""
        if not len(self.below):
            return np.zeros(len(pile), bool)
        put = ((self.below[pile] & come) != 0) & ((self.below[come] & pile) == 0)
        return np.asarray(put)

    def separable(self, one: Masks, other: Masks) -> NDArray[np.bool_]:
        """Whether two sides (k,) are free of each other along some axis, or their clashes are
        accepted."""
        free = np.zeros(len(one), bool)
        for axis in AXES:
            for side in (0, 1):
                free |= (self.ways[0, axis, side][one] & other) == 0
        return free

    def level(self, axis: int, side: int, going: Masks, staying: Masks) -> NDArray[np.uint8]:
        """The levels (k,) of blocking, by which LEVEL_PRICES has the prices, of subsets that leave
        along an axis to the upper (0) or lower (1) side, past those that stay."""
        met = (self.ways[:, axis, side][:, going] & staying) != 0
        levels = np.asarray((met * WAY_LEVELS).max(axis=0))
        for mine, theirs in self.unheld:
            for one, other in ((going, staying), (staying, going)):
                unheld = (one == mine) & (other & theirs == theirs)
                levels[unheld] = np.maximum(levels[unheld], UNHELD_LEVEL)
        return levels


def subsets(graphs: Blocking) -> Subsets:
    """The tables of a product of no more than MOST units."""
    count = len(graphs)
    size = 1 << count
    levels = (
        graphs.locks,
        graphs.levels >= DEEPER,
        graphs.levels >= LOCKED,
        graphs.levels >= CLASHES,
    )
    ways = _unions(np.stack([[level, level.swapaxes(1, 2)] for level in levels]).swapaxes(1, 2))
    low, high = np.full((3, size), np.inf), np.full((3, size), -np.inf)
    members = np.zeros(size, np.int64)
    for unit in range(count):
        here = slice(1 << unit, 2 << unit)
        before = slice(0, 1 << unit)
        low[:, here] = np.minimum(low[:, before], graphs.low[unit][:, None])
        high[:, here] = np.maximum(high[:, before], graphs.high[unit][:, None])
        members[here] = members[before] + 1
    tips = np.zeros(size, bool) if graphs.feet is None else graphs.feet.subsets()
    based = (np.arange(size) >> max(graphs.base, 0) & 1 == 1) & (graphs.base >= 0)
    stands = _hanging(graphs.rests, members) if len(graphs.rests) else np.ones(size, bool)
    hangs = _hanging(graphs.touch, members)
    unheld = tuple((_mask(mine), _mask(theirs)) for mine, theirs in graphs.unheld)
    below = _unions(graphs.rests) if len(graphs.rests) else np.zeros(0, np.int64)
    tables = tips, stands, based, unheld, below
    return Subsets(count, ways, hangs, low, high, members, *tables)


def _mask(units: Iterable[int]) -> int:
    return sum(1 << unit for unit in units)


def _unions(table: NDArray[np.bool_]) -> Masks:
    """The union (..., s) of the rows of relations (..., n, n) over each subset."""
    count = table.shape[-1]
    rows = table @ (1 << np.arange(count, dtype=np.int64))
    unions = np.zeros((*rows.shape[:-1], 1 << count), np.int64)
    for unit in range(count):
        step = 1 << unit
        unions[..., step : 2 * step] = unions[..., :step] | rows[..., unit, None]
    return unions


def _hanging(touch: NDArray[np.bool_], members: Masks) -> NDArray[np.bool_]:
    """Which subsets are connected (s,): those in which some unit touches the rest, and the rest is
    connected. So are those of which all units rest on one, in a relation that is not symmetric."""
    count = len(touch)
    units = 1 << np.arange(count, dtype=np.int64)
    reach = (touch & ~np.eye(count, dtype=bool)) @ units
    hangs = members <= 1
    for number in range(2, count + 1):
        of_size = np.flatnonzero(members == number)[:, None]
        rest = of_size & ~units
        hangs[of_size[:, 0]] = (hangs[rest] & (rest != of_size) & (rest & reach != 0)).any(axis=1)
    return hangs
