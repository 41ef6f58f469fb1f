"""Which machines of a layout come near each other.

Two presences of different machines are *near* where bodies of both come closer than they may: to
the clearance in one layer, and to what drives and grips need in different ones, or where something
is handed over. In a place of both, which is a mode, its field keeps payloads apart, and only what
is below them can be near.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely

from factory.floor.layout.crossings import near as near_boxes
from factory.floor.layout.dimensions import PAYLOADS
from factory.floor.layout.presence import ACROSS, ALONG, ANY, ROUNDING, Presence
from factory.floor.mating.depth import rough, spanned
from factory.support.allowance import Allowance
from factory.support.arrays import Array, Index, Indices, Truth

BLOCK = 1 << 14
"""Boxes, and pairs of boxes, that are compared at a time, but for those of one pair of presences,
and those of one box."""

Meeting = tuple[Array, Index, Index]
"""Pairs of boxes (n,) of two presences: what they need [m], and the numbers of both."""

FEW = 256
"""Of more pairs of boxes than these the boxes that are near are looked for first."""

SOME = 256
"""So many presences have their hulls worked out at a time."""

Distances = tuple[float, float, float]
"""What bodies need [m]: in one layer below payloads, among payloads, and in different layers."""

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
    """The pairs of presences of different machines that come near, which keep a clearance [m]. Near
    linear."""
    hulls = _hulls(presences)
    machine = np.unique([presence.machine for presence in presences], return_inverse=True)[1]
    count = np.array([len(presence.boxes) for presence in presences])
    low, high = hulls[:, 0] - clearance / 2, hulls[:, 1] + clearance / 2
    for first, second in near_boxes(shapely.box(low[:, 0], low[:, 1], high[:, 0], high[:, 1])):
        meets = _all((low[first] < high[second]) & (low[second] < high[first]))
        meets &= machine[first] != machine[second]
        pairs = np.stack([first[meets], second[meets]], axis=1)
        if not len(pairs):
            continue
        block = np.cumsum(count[pairs].sum(axis=1)) // BLOCK
        for some in np.split(pairs, np.flatnonzero(np.diff(block)) + 1):
            which, numbers = np.unique(some, return_inverse=True)
            Allowance.heed()
            boxes = _Boxes([presences[n] for n in which.tolist()], hulls[which])
            yield from boxes.nearest(numbers.reshape(-1, 2), clearance)


def _hulls(presences: Sequence[Presence]) -> Array:
    """The hull of each presence (n, 2, 3) [m], worked out for SOME of them at a time."""
    hulls = [np.zeros((0, 2, 3))]
    for begin in range(0, len(presences), SOME):
        boxes = [presence.boxes for presence in presences[begin : begin + SOME]]
        every, first = np.concatenate(boxes), np.cumsum([0, *map(len, boxes[:-1])])
        low, high = np.minimum.reduceat(every[:, 0], first), np.maximum.reduceat(every[:, 1], first)
        hulls.append(np.stack([low, high], axis=1))
    return np.concatenate(hulls)


class _Boxes:
    """The boxes of several presences, with their `hulls` (n, 2, 3) [m]."""

    def __init__(self, presences: Sequence[Presence], hulls: Array) -> None:
        self._presences, self._hulls = presences, hulls
        self._boxes = np.concatenate([p.boxes for p in presences])
        self._ends = np.ascontiguousarray(self._boxes.transpose(2, 1, 0))
        self._layers = np.concatenate([p.layers for p in presences])
        self._count = np.array([len(presence.boxes) for presence in presences], int)
        self._first = np.cumsum(self._count) - self._count

    def nearest(self, pairs: Indices, clearance: float) -> Iterator[Near]:
        """Those of some pairs (n, 2) of presences that come too near, by their boxes."""
        both = [(self._presences[i], self._presences[j]) for i, j in pairs.tolist()]
        needed = np.array([distances(*pair, clearance) for pair in both])
        (first, second), most = pairs.T, needed.max(axis=1)
        here = self._within(first, self._hulls[second], most)
        there = self._within(second, self._hulls[first], most)
        blocks = [self._lacking(*some, needed) for some in _combined(here, there, len(pairs))]
        pair, lacking, one, other = _greatest(
            *(np.concatenate(each) for each in zip(*blocks, strict=True))
        )
        one, other = one - self._first[first[pair]], other - self._first[second[pair]]
        for n, i, j, lacks in zip(*(a.tolist() for a in (pair, one, other, lacking)), strict=True):
            mine, others = both[n]
            yield Near(mine, others, (mine.name(i), others.name(j)), lacks)

    def _lacking(
        self, pair: Index, one: Index, other: Index, needed: Array
    ) -> tuple[Index, Array, Index, Index]:
        """Those of the boxes of pairs (m,) that come nearer than they may, where pairs need
        distances (n, 3), and by how much: the nearest of each pair."""
        pair, one, other = self._close(pair, one, other, needed.max(axis=1))
        lacking = _overlap(self._boxes[one], self._boxes[other])
        lacking += needed[pair, _needed(self._layers[one], self._layers[other])]
        meets = lacking > ROUNDING
        return _greatest(pair[meets], lacking[meets], one[meets], other[meets])

    def _close(
        self, pair: Index, one: Index, other: Index, apart: Array
    ) -> tuple[Index, Index, Index]:
        """Those of the boxes of pairs (m,) that come nearer than the distance of their pair (n,)
        along each axis: few are left after the first."""
        for low, high in self._ends:
            depth = np.minimum(high[one], high[other]) - np.maximum(low[one], low[other])
            meets = depth + apart[pair] > ROUNDING
            pair, one, other = pair[meets], one[meets], other[meets]
        return pair, one, other

    def _within(self, which: Index, hulls: Array, apart: Array) -> tuple[Index, Index]:
        """The boxes of presences (n,) that come nearer than distances (n,) to other hulls (n, 2,
        3): for each the number of the pair (m,), and its own (m,)."""
        pair, box = _spans(self._first[which], self._count[which])
        low, high = (hulls[:, 0] - apart[:, None])[pair], (hulls[:, 1] + apart[:, None])[pair]
        boxes = self._boxes[box]
        meets = _all((boxes[:, 0] < high) & (boxes[:, 1] > low))
        return pair[meets], box[meets]


def _combined(
    here: tuple[Index, Index], there: tuple[Index, Index], pairs: int
) -> Iterator[tuple[Index, Index, Index]]:
    """Every box of one presence with every box of the other, for some BLOCK of them at a time and
    pair by pair: the numbers of the pair and of the boxes (m,). `here`, `there`: as `_within`."""
    others = np.bincount(there[0], minlength=pairs)
    first, count = np.cumsum(others) - others, others[here[0]]
    block = np.cumsum(count) // BLOCK
    for some in np.split(np.arange(len(count)), np.flatnonzero(np.diff(block)) + 1):
        pair, one = here[0][some], here[1][some]
        span, other = _spans(first[pair], count[some])
        yield pair[span], one[span], there[1][other]


def _greatest(
    pair: Index, lacking: Array, one: Index, other: Index
) -> tuple[Index, Array, Index, Index]:
    """What lacks most of each pair, of its boxes (m,); of equal ones the last."""
    order = np.lexsort((other, one, lacking, pair))
    last = order[np.append(np.diff(pair[order]) > 0, True)[: len(order)]]
    return pair[last], lacking[last], one[last], other[last]


def _spans(first: Index, count: Index) -> tuple[Index, Index]:
    """The numbers from the `first` (n,) on, so many of each (n,): the span of each number (m,), and
    the number (m,)."""
    span = np.repeat(np.arange(len(count)), count)
    return span, np.arange(len(span)) + (first - np.cumsum(count) + count)[span]


class Nearness:
    """Judges pairs of presences by the bodies themselves, which may be apart where their boxes are
    not; each only once for all that are alike: in the turns of a period, and in the rounds of a
    search."""

    def __init__(self, clearance: float) -> None:
        self._clearance, self._known = clearance, dict[Hashable, Lacking | None]()

    def nearer(self, near_pair: Near) -> Near | None:
        """The pair by its bodies, None if they are far enough apart."""
        if (pair := alike(near_pair.one, near_pair.other)) not in self._known:
            needed = distances(near_pair.one, near_pair.other, self._clearance)
            self._known[pair] = judged(near_pair.one, near_pair.other, needed)
        if (nearest := self._known[pair]) is None:
            return None
        lacking, i, j = nearest
        bodies = near_pair.one.name(i), near_pair.other.name(j)
        return replace(near_pair, bodies=bodies, lacking=lacking)


def alike(one: Presence, other: Presence) -> Hashable:
    """A key of two presences: pairs with equal keys come near alike."""
    return one.filled, other.filled, distances(one, other, 1.0)


def judged(one: Presence, other: Presence, needed: Distances) -> Lacking | None:
    """The bodies that come nearer than the `needed` distances, and by how much."""
    return nearest(one, other, meeting(one, other, needed))


def nearest(one: Presence, other: Presence, boxes: Meeting) -> Lacking | None:
    """Of some boxes of two presences those whose bodies come nearer than they may, and by how much;
    edges count only if faces do not decide."""
    needs, here, there = boxes
    if not len(needs):
        return None
    by_box = needs + _overlap(one.boxes[here], other.boxes[there])
    for n in np.lexsort((there, here, by_box))[::-1].tolist():
        lacking, i, j = float(by_box[n]), int(here[n]), int(there[n])
        if lacking <= ROUNDING:
            return None
        need = lacking - float(_overlap(one.boxes[i], other.boxes[j]))
        solids = one.solid(i), other.solid(j)
        lacking = min(lacking, need + float(rough(*solids).bounds.min()))
        if lacking <= ROUNDING:
            continue
        edges = spanned(*solids).bounds.min(initial=np.inf)
        if (lacks := min(lacking, need + float(edges))) > ROUNDING:
            return lacks, i, j
    return None


def distances(one: Presence, other: Presence, clearance: float) -> Distances:
    """What bodies of two presences need, of the machines that keep a clearance [m]. Who works with
    a machine comes to what that holds with an empty hand, or bears what it hands over."""
    apart = clearance - 2 * (ALONG + ROUNDING)
    if not one.is_apart(other):
        return apart, -np.inf, -np.inf
    bears, hold = one.bears or other.bears, one.label and other.label
    across = 0.0 if bears else ACROSS
    together = not one.partners.isdisjoint(other.partners)
    return apart, across if together and (bears or not hold) else apart, across


def _needed(layer: Index, beside: Index) -> Index:
    """Which of the distances bodies in some layers need to bodies in others."""
    alike = (layer == beside) | (layer == ANY) | (beside == ANY)
    return np.where(alike, np.maximum(layer, beside) == PAYLOADS, 2)


def meeting(one: Presence, other: Presence, needed: Distances) -> Meeting:
    """The boxes of two presences that come nearer than the `needed` distances."""
    here, there = np.arange(len(one.boxes)), np.arange(len(other.boxes))
    if len(here) * len(there) > FEW:
        here = _within(one.boxes, other.hull, max(needed))
        there = _within(other.boxes, one.hull, max(needed)) if len(here) else here
        if not len(there):
            return np.zeros(0), here[:0], there
    rows = max(1, BLOCK // max(1, len(there)))
    blocks = [
        _met(one, here[begin : begin + rows], other, there, needed)
        for begin in range(0, max(1, len(here)), rows)
    ]
    need, i, j = (np.concatenate(each) for each in zip(*blocks, strict=True))
    return need, i, j


def _met(one: Presence, here: Index, other: Presence, there: Index, needed: Distances) -> Meeting:
    """The same of some of their boxes."""
    need = np.array(needed)[_needed(one.layers[here][:, None], other.layers[there][None])]
    lacking = need + _overlap(one.boxes[here][:, None], other.boxes[there][None])
    i, j = np.nonzero(lacking > ROUNDING)
    return need[i, j], here[i], there[j]


def _overlap(one: Array, other: Array) -> Array:
    """Depth of overlap of boxes (..., 2, 3); negative: their distance (...) [m]."""
    low = np.maximum(one[..., 0, :], other[..., 0, :])
    x, y, z = np.moveaxis(np.minimum(one[..., 1, :], other[..., 1, :]) - low, -1, 0)
    return np.asarray(np.minimum(np.minimum(x, y), z))


def _all(meets: Truth) -> Truth:
    """Whether boxes meet (n,) that do along each axis (n, 3)."""
    return np.asarray(meets[:, 0] & meets[:, 1] & meets[:, 2])


def _within(boxes: Array, hull: Array, apart: float) -> Index:
    """Which boxes (n, 2, 3) come nearer than a distance to a box (2, 3)."""
    meets = (boxes[:, 0] < hull[1] + apart) & (boxes[:, 1] > hull[0] - apart)
    return np.flatnonzero(_all(meets))
