"""Which machines of a layout come near each other.

Two presences of different machines are *near* where bodies of both come closer than drives and
grips need, and both are not one and the same mode, whose field keeps its robots apart.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import shapely

from factory.floor.layout.crossings import near as near_boxes
from factory.floor.layout.presence import ACROSS, ALONG, ANY, ROUNDING, Presence
from factory.floor.mating.depth import exact, rough
from factory.support.arrays import Array, Index, Indices, Truth

BLOCK = 1 << 14
"""Boxes, and pairs of boxes, that are compared at a time, but for those of one pair of
presences."""

Lacking = tuple[float, int, int]
"""By how much nearer than they may two boxes come [m], and their numbers."""


@dataclass(frozen=True, slots=True)
class Near:
    """Two presences that come near, which `bodies` of theirs come nearest, and by how much nearer
    than they may (`lacking`) [m]."""

    one: Presence
    other: Presence
    bodies: tuple[str, str]
    lacking: float


def near(presences: Sequence[Presence], clearance: float) -> Iterator[Near]:
    """The pairs of presences of different machines without a common place that come near: nearer
    than ACROSS, or than the clearance [m] where bodies are in one layer and their machines do not
    work together. Near linear."""
    hulls = np.array([presence.hull for presence in presences]).reshape(-1, 2, 3)
    machine = np.unique([presence.machine for presence in presences], return_inverse=True)[1]
    count = np.array([len(presence.boxes) for presence in presences])
    low, high = hulls[:, 0] - clearance / 2, hulls[:, 1] + clearance / 2
    for first, second in near_boxes(shapely.box(low[:, 0], low[:, 1], high[:, 0], high[:, 1])):
        meets = (low[first] < high[second]).all(axis=1) & (low[second] < high[first]).all(axis=1)
        meets &= machine[first] != machine[second]
        pairs = zip(first[meets].tolist(), second[meets].tolist(), strict=True)
        apart = np.array([(i, j) for i, j in pairs if presences[i].is_apart(presences[j])])
        if not len(apart):
            continue
        block = np.cumsum(count[apart].sum(axis=1)) // BLOCK
        for some in np.split(apart, np.flatnonzero(np.diff(block)) + 1):
            which, numbers = np.unique(some, return_inverse=True)
            boxes = _Boxes([presences[n] for n in which.tolist()], hulls[which])
            yield from boxes.nearest(numbers.reshape(-1, 2), clearance)


class _Boxes:
    """The boxes of several presences, with their `hulls` (n, 2, 3) [m]."""

    def __init__(self, presences: Sequence[Presence], hulls: Array) -> None:
        self._presences, self._hulls = presences, hulls
        self._boxes = np.concatenate([p.boxes for p in presences])
        self._layers = np.concatenate([p.layers for p in presences])
        self._count = np.array([len(presence.boxes) for presence in presences], int)
        self._first = np.cumsum(self._count) - self._count

    def nearest(self, pairs: Indices, clearance: float) -> Iterator[Near]:
        """As `nearest`, for those of some pairs (n, 2) of presences that come too near."""
        both = [(self._presences[i], self._presences[j]) for i, j in pairs.tolist()]
        across, apart = np.array([_needed(*pair, clearance) for pair in both]).T
        first, second = pairs.T
        here = self._within(first, self._hulls[second], apart)
        there = self._within(second, self._hulls[first], apart)
        for pair, one, other in _combined(here, there, len(pairs)):
            alike = self._alike(one, other)
            lacking = _overlap(self._boxes[one], self._boxes[other])
            lacking += np.where(alike, apart[pair], across[pair])
            order = np.lexsort((other, one, lacking, pair))
            order = order[lacking[order] > ROUNDING]
            is_last = np.append(np.diff(pair[order]) > 0, True)[: len(order)]
            for n in order[is_last].tolist():
                mine, others = both[pair[n]]
                i, j = one[n] - self._first[first[pair[n]]], other[n] - self._first[second[pair[n]]]
                yield Near(mine, others, (mine.name(i), others.name(j)), float(lacking[n]))

    def _alike(self, one: Index, other: Index) -> Truth:
        """Whether boxes (n,) are in one layer with others (n,)."""
        layer, beside = self._layers[one], self._layers[other]
        return np.asarray((layer == beside) | (layer == ANY) | (beside == ANY))

    def _within(self, which: Index, hulls: Array, apart: Array) -> tuple[Index, Index]:
        """The boxes of presences (n,) that come nearer than distances (n,) to other hulls (n, 2,
        3): for each the number of the pair (m,), and its own (m,)."""
        pair, box = _spans(self._first[which], self._count[which])
        low, high = (hulls[:, 0] - apart[:, None])[pair], (hulls[:, 1] + apart[:, None])[pair]
        boxes = self._boxes[box]
        meets = ((boxes[:, 0] < high) & (boxes[:, 1] > low)).all(axis=1)
        return pair[meets], box[meets]


def _combined(
    here: tuple[Index, Index], there: tuple[Index, Index], pairs: int
) -> Iterator[tuple[Index, Index, Index]]:
    """Every box of one presence with every box of the other, for BLOCK of them at a time and pair
    by pair: the numbers of the pair and of the boxes (m,). `here`, `there`: as `_within`."""
    mine, others = (np.bincount(pair, minlength=pairs) for pair, _ in (here, there))
    first, block = np.cumsum(others) - others, np.cumsum(mine * others) // BLOCK
    ends = np.searchsorted(block[here[0]], np.arange(block[-1] + 2))
    for begin, end in pairwise(ends.tolist()):
        pair, one = here[0][begin:end], here[1][begin:end]
        span, other = _spans(first[pair], others[pair])
        yield pair[span], one[span], there[1][other]


def _spans(first: Index, count: Index) -> tuple[Index, Index]:
    """The numbers from the `first` (n,) on, so many of each (n,): the span of each number (m,), and
    the number (m,)."""
    span = np.repeat(np.arange(len(count)), count)
    return span, np.arange(len(span)) + (first - np.cumsum(count) + count)[span]


def nearest(one: Presence, other: Presence, clearance: float) -> Near | None:
    """Two presences with the bodies whose boxes come nearest, relative to the distance they need,
    if any come too near."""
    pairs = _pairs(one, other, clearance)
    lacking, i, j = max(pairs, default=(0.0, 0, 0))
    return Near(one, other, (one.name(i), other.name(j)), lacking) if pairs else None


def nearer(near: Near, clearance: float) -> Near | None:
    """The same, judged by the bodies themselves, which may be apart where their boxes are not."""
    lacking = judged(near.one, near.other, clearance)
    return lacking and _named(near, lacking)


class Nearness:
    """Judges pairs of presences as `nearer`, each only once for all that are alike: in the turns of
    a period, and in the rounds of a search."""

    def __init__(self, clearance: float) -> None:
        self._clearance, self._known = clearance, dict[Hashable, Lacking | None]()

    def nearer(self, near_pair: Near) -> Near | None:
        """The pair as `nearer` judges it."""
        if (pair := alike(near_pair.one, near_pair.other)) not in self._known:
            self._known[pair] = judged(near_pair.one, near_pair.other, self._clearance)
        lacking = self._known[pair]
        return lacking and _named(near_pair, lacking)


def alike(one: Presence, other: Presence) -> Hashable:
    """A key of two presences: pairs with equal keys come near alike."""
    apart = one.partners.isdisjoint(other.partners)
    return one.filled, other.filled, apart, one.bears or other.bears


def _named(pair: Near, by: Lacking) -> Near:
    lacking, i, j = by
    return replace(pair, bodies=(pair.one.name(i), pair.other.name(j)), lacking=lacking)


def judged(one: Presence, other: Presence, clearance: float) -> Lacking | None:
    """The bodies that come too near, and by how much; edges count only if faces do not decide."""
    for lacking, i, j in sorted(_pairs(one, other, clearance), reverse=True):
        need = lacking - float(_overlap(one.boxes[i], other.boxes[j]))
        solids = one.solid(i), other.solid(j)
        if need + float(rough(*solids).bounds.min()) <= ROUNDING:
            continue
        if (lacks := min(lacking, need + float(exact(*solids).bounds.min()))) > ROUNDING:
            return lacks, i, j
    return None


def _needed(one: Presence, other: Presence, clearance: float) -> tuple[float, float]:
    """The distances that bodies of two presences need: in different layers, and in one [m]."""
    across = 0.0 if one.bears or other.bears else ACROSS
    together = not one.partners.isdisjoint(other.partners)
    return across, across if together else clearance - 2 * (ALONG + ROUNDING)


def _pairs(one: Presence, other: Presence, clearance: float) -> list[Lacking]:
    """The pairs of boxes of two presences that come too near, and by how much."""
    across, apart = _needed(one, other, clearance)
    here = _within(one.boxes, other.hull, apart)
    there = _within(other.boxes, one.hull, apart) if len(here) else here
    if not len(there):
        return []
    a, b = one.boxes[here][:, None], other.boxes[there][None]
    layer, beside = one.layers[here][:, None], other.layers[there][None]
    alike = (layer == beside) | (layer == ANY) | (beside == ANY)
    lacking = np.where(alike, apart, across) + _overlap(a, b)
    pairs = zip(*np.nonzero(lacking > ROUNDING), strict=True)
    return [(float(lacking[i, j]), int(here[i]), int(there[j])) for i, j in pairs]


def _overlap(one: Array, other: Array) -> Array:
    """Depth of overlap of boxes (..., 2, 3); negative: their distance (...) [m]."""
    low = np.maximum(one[..., 0, :], other[..., 0, :])
    return np.asarray((np.minimum(one[..., 1, :], other[..., 1, :]) - low).min(axis=-1))


def _within(boxes: Array, hull: Array, apart: float) -> Index:
    """Which boxes (n, 2, 3) come nearer than a distance to a box (2, 3)."""
    meets = (boxes[:, 0] < hull[1] + apart) & (boxes[:, 1] > hull[0] - apart)
    return np.flatnonzero(meets.all(axis=1))
