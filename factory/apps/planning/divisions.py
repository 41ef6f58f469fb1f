"""All divisions in two of the subsets of a few units, and a lower bound on the price of each."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import count
from typing import Any

import numpy as np
from numpy.typing import NDArray

from factory.apps.planning.subsets import LEVEL_PRICES, Masks, Subsets
from factory.support.arrays import Array

Late = Callable[[], bool]
"""Tells whether a search must end."""

Levels = NDArray[np.uint8]

BATCH = 1 << 20
"""The most divisions that are computed at once, if a single subset does not have more."""


class TooLate(Exception):
    """A search ran out of time before it had a proof."""


def never() -> bool:
    """A search without a time limit."""
    return False


@dataclass(frozen=True, slots=True)
class Batch:
    """Divisions (k,) of subsets of equal size, those of one subset in a row: the subset (`whole`),
    its side that has the base or else the lowest unit (`one`), the `levels` (k, 3) of blocking
    along the first and second horizontal axis, whichever side moves, and along the vertical, and
    those `onto` (k, 2) that side from above, and of that side onto the other."""

    whole: Masks
    one: Masks
    levels: Levels
    onto: Levels

    def where(self, rows: NDArray[np.bool_] | slice) -> Batch:
        """Some of the divisions."""
        return Batch(self.whole[rows], self.one[rows], self.levels[rows], self.onto[rows])

    @property
    def other(self) -> Masks:
        """The other sides (k,)."""
        return self.whole ^ self.one

    @property
    def prices(self) -> Array:
        """The prices (k, 3) by the axes of `levels`."""
        return np.asarray(LEVEL_PRICES[self.levels])

    @property
    def starts(self) -> NDArray[np.int64]:
        """The first row of each subset."""
        return np.flatnonzero(np.diff(self.whole, prepend=-1))

    def of(self, whole: int) -> Batch:
        """The divisions of one subset."""
        return self.where(slice(*np.searchsorted(self.whole, [whole, whole + 1])))


@dataclass(frozen=True)
class Divisions:
    """The possible divisions of all subsets, in `batches` of ever larger subsets, if `axis` stands
    upright (`up`, +1 or -1). Divisions that no tree of at most the price `most` has are left
    out."""

    subsets: Subsets
    axis: int
    up: int
    batches: tuple[Batch, ...] = field(repr=False)
    most: float = np.inf

    @property
    def level(self) -> tuple[int, int]:
        """The horizontal axes of the product."""
        return _level(self.axis)

    def of(self, whole: int) -> Batch:
        """The divisions of one subset."""
        size = whole.bit_count()
        batches = (b for b in self.batches if int(b.whole[0]).bit_count() == size)
        return next(b for b in batches if b.whole[-1] >= whole).of(whole)

    @cached_property
    def least(self) -> Array:
        """A lower bound (s,) on the price of a tree of each subset: along the best axes."""
        least = np.full(1 << self.subsets.count, np.inf)
        least[1 << np.arange(self.subsets.count)] = 0.0
        for batch in self.batches:
            starts = batch.starts
            least[batch.whole[starts]] = np.minimum.reduceat(self._sums(batch, least), starts)
        return least

    def _sums(self, batch: Batch, least: Array) -> Array:
        prices = batch.prices.min(axis=1) + self.subsets.penalty[batch.whole]
        return np.asarray(prices + least[batch.one] + least[batch.other])

    def within(self, price: float) -> Divisions:
        """Those divisions that a tree of at most such a price can have."""
        cheap = (batch.where(self._sums(batch, self.least) <= price) for batch in self.batches)
        return replace(self, batches=tuple(batch for batch in cheap if len(batch.one)), most=price)


def divisions(
    subsets: Subsets,
    axis: int = 2,
    up: int = +1,
    apart: bool = False,
    late: Late = never,
    limit: float = np.inf,
    store: KnownDivisions | None = None,
) -> Divisions:
    """All possible divisions. `apart`: whether sub-assemblies may be in pieces, at a price;
    `store`: those that were computed before. Raises TooLate if there are more than a limit."""
    made, total = list[Batch](), 0
    for every in (store or KnownDivisions()).of(subsets, axis, up, apart):
        if late() or total > limit:
            raise TooLate
        batch = _based(every, subsets.based)
        total += len(batch.one)
        if len(batch.one):
            made.append(batch)
    return Divisions(subsets, axis, up, tuple(made))


class KnownDivisions:
    """The divisions of the product that was last asked for, whatever its base: many searches differ
    in the base alone, or in what is preferred."""

    def __init__(self) -> None:
        self._product: tuple[Any, ...] = ()
        self._batches: dict[tuple[int, int, bool], tuple[list[Batch], Iterator[Batch]]] = {}

    def of(self, subsets: Subsets, axis: int, up: int, apart: bool) -> Iterator[Batch]:
        """The divisions of the subsets of one size after the other, computed when they are asked
        for; the side `one` of each has the lowest unit."""
        product = subsets.ways, subsets.hangs, subsets.unheld
        if not self._is_last(product):
            self._product, self._batches = product, {}
        key = axis, up, apart
        if key not in self._batches:
            wholes = _batches(subsets, apart)
            self._batches[key] = [], (_divided(subsets, w, axis, up, apart) for w in wholes)
        made, rest = self._batches[key]
        yield from _again(made, rest)

    def _is_last(self, product: tuple[Any, ...]) -> bool:
        """Whether divisions of these subsets were last asked for."""
        pairs = zip(product, self._product, strict=False)
        return bool(self._product) and all(np.array_equal(one, other) for one, other in pairs)


def _again(made: list[Batch], rest: Iterator[Batch]) -> Iterator[Batch]:
    """What is made, then the rest, which is added to it."""
    for number in count():
        if number == len(made):
            one = next(rest, None)
            if one is None:
                return
            made.append(one)
        yield made[number]


def _based(batch: Batch, based: NDArray[np.bool_]) -> Batch:
    """The divisions in which the side that has the base (s,) is the first, and the other comes onto
    it."""
    swapped = based[batch.other]
    one = np.where(swapped, batch.other, batch.one)
    onto = np.where(swapped[:, None], batch.onto[:, ::-1], batch.onto)
    levels, has_base = batch.levels.copy(), based[batch.whole]
    levels[has_base, 2] = onto[has_base, 0]
    moved = Batch(batch.whole, one, levels, onto)
    return moved.where(np.isfinite(LEVEL_PRICES[levels]).any(axis=1))


def _batches(subsets: Subsets, apart: bool) -> Iterator[Masks]:
    """The subsets of two units or more that may be sub-assemblies, those of one size together."""
    useful = subsets.hangs | apart
    useful[-1] = True
    for size in range(2, subsets.count + 1):
        wholes = np.flatnonzero(useful & (subsets.size == size))
        step = max(1, BATCH >> (size - 1))
        for first in range(0, len(wholes), step):
            yield wholes[first : first + step]


def _divided(subsets: Subsets, wholes: Masks, axis: int, up: int, apart: bool) -> Batch:
    one = splits(wholes)
    whole = np.repeat(wholes, one.shape[1])
    one = one.ravel()
    possible = subsets.separable(one, whole ^ one)
    if not apart:
        possible &= subsets.hangs[one] & subsets.hangs[whole ^ one]
    whole, one = whole[possible], one[possible]
    sides = [
        [subsets.level(along, side, one, whole ^ one) for side in (0, 1)]
        for along in (*_level(axis), axis)
    ]
    levels = np.min(sides, axis=1).T
    onto = np.transpose(sides[2][::-up])
    return Batch(whole, one, levels, onto).where(np.isfinite(LEVEL_PRICES[levels]).any(axis=1))


def splits(wholes: Masks) -> Masks:
    """The proper subsets (m, k) of masks (m,) of equal size that contain their lowest unit: each,
    with its complement, is a division in two."""
    size = int(wholes[0]).bit_count()
    rest, bits = wholes.copy(), np.zeros((size, len(wholes)))
    for number in range(size):
        bits[number] = rest & -rest
        rest &= rest - 1
    chosen = np.arange((1 << size - 1) - 1)[:, None] >> np.arange(size - 1) & 1
    return np.asarray((chosen @ bits[1:] + bits[0]).astype(np.int64).T)


def _level(axis: int) -> tuple[int, int]:
    first, second = (other for other in range(3) if other != axis)
    return first, second
