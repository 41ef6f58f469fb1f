"""Tables over all subsets of a few units, as bit masks: what is in the way, what hangs together,
how large it is."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from factory.geometry.meshes import Array
from factory.planning.blocking import AXES, CLASHES, DEEPER, LOCKED, Blocking

Masks = NDArray[np.int64]

MOST = 16
"""So many units, at most, have tables."""

BLOCKED, PASSES, LOOSE = 1e6, 1e4, 1e2
"""What one operation costs in which accepted clashes are met (`check` calls it blocked), or parts
that were drawn into each other pass through each other, or get a little deeper. Below all these: a
relay."""

APART, TIPS = 1e5, 2e4
"""What a sub-assembly costs that does not hang together, or would tip over where it stands."""


@dataclass(frozen=True)
class Subsets:
    """Tables by subset. `ways` (3 levels, 3 axes, 2 sides, s): what is in the way of a subset that
    goes out along an axis to the upper or lower side, at least LOCKED and not allowed, DEEPER or
    more, or CLASHES; `passes` the same for LOCKED, allowed; `hangs` (s,): whether it hangs
    together; `low`, `high` (3, s): its box [m]; `size` (s,): of how many units; `tips` (s,):
    whether it would tip over; `based` (s,): whether it has the unit onto which all others come."""

    count: int
    ways: Masks = field(repr=False)
    hangs: NDArray[np.bool_] = field(repr=False)
    low: Array = field(repr=False)
    high: Array = field(repr=False)
    size: Masks = field(repr=False)
    tips: NDArray[np.bool_] = field(repr=False)
    based: NDArray[np.bool_] = field(repr=False)

    @property
    def whole(self) -> int:
        """All units."""
        return (1 << self.count) - 1

    def extent(self, axis: int) -> Array:
        """How long each subset is along an axis (s,) [m]."""
        return np.asarray(self.high[axis] - self.low[axis])

    def price(self, axis: int, side: int, going: Masks, staying: Masks) -> Array:
        """What it costs (k,) that subsets go out along an axis to the upper (0) or lower (1) side,
        past what stays; infinite where they cannot."""
        locked, deeper, through, clash = (
            self.ways[n, axis, side][going] & staying for n in range(4)
        )
        found = np.where(deeper != 0, LOOSE, 0.0)
        found[through != 0] = PASSES
        found[clash != 0] = BLOCKED
        found[locked != 0] = np.inf
        return found


def subsets(found: Blocking) -> Subsets:
    """The tables of a product of no more than MOST units."""
    count = len(found)
    size = 1 << count
    levels = (found.locks, found.levels >= DEEPER, found.levels >= LOCKED, found.levels >= CLASHES)
    ways = np.zeros((4, 3, 2, size), np.int64)
    for number, level in enumerate(levels):
        for axis in AXES:
            ways[number, axis, 0] = _unions(level[axis])
            ways[number, axis, 1] = _unions(level[axis].T)
    low, high = np.full((3, size), np.inf), np.full((3, size), -np.inf)
    members = np.zeros(size, np.int64)
    for unit in range(count):
        here = slice(1 << unit, 2 << unit)
        before = slice(0, 1 << unit)
        low[:, here] = np.minimum(low[:, before], found.low[unit][:, None])
        high[:, here] = np.maximum(high[:, before], found.high[unit][:, None])
        members[here] = members[before] + 1
    tips = np.zeros(size, bool) if found.feet is None else found.feet.subsets()
    based = (np.arange(size) >> max(found.base, 0) & 1 == 1) & (found.base >= 0)
    return Subsets(count, ways, _hanging(found.touch, members), low, high, members, tips, based)


def splits(whole: int) -> Masks:
    """The subsets of a mask that have its lowest unit, but for the mask itself: with the rest of it
    each is one way to divide it in two."""
    bits = [1 << n for n in range(whole.bit_length()) if whole >> n & 1]
    found = np.full(1 << (len(bits) - 1), bits[0], np.int64)
    for number, bit in enumerate(bits[1:]):
        step = 1 << number
        found[step : 2 * step] = found[:step] | bit
    return found[:-1]


def _unions(table: NDArray[np.bool_]) -> Masks:
    """The union (s,) of the rows of a relation (n, n) over each subset."""
    count = len(table)
    rows = table @ (1 << np.arange(count, dtype=np.int64))
    found = np.zeros(1 << count, np.int64)
    for unit in range(count):
        step = 1 << unit
        found[step : 2 * step] = found[:step] | rows[unit]
    return found


def _hanging(touch: NDArray[np.bool_], members: Masks) -> NDArray[np.bool_]:
    """Which subsets hang together (s,): those of which some unit can be left out so that the rest
    does, and touches it."""
    count = len(touch)
    reach = (touch & ~np.eye(count, dtype=bool)) @ (1 << np.arange(count, dtype=np.int64))
    found = members <= 1
    for number in range(2, count + 1):
        of_size = np.flatnonzero(members == number)
        for unit in range(count):
            has = of_size[(of_size >> unit & 1) == 1]
            rest = has ^ (1 << unit)
            found[has] |= found[rest] & ((rest & reach[unit]) != 0)
    return found
