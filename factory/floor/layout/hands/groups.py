"""Groups of places by which one hand could hold a sub-assembly: each alone, and under a payload two
on one line."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import product as pairs

import numpy as np

from factory.floor.layout.hands.hand import Point3
from factory.floor.layout.hands.places import Places
from factory.floor.layout.hands.tips import STRONG, TipName
from factory.support.arrays import Array, Index, Truth

ENOUGH = 0.85
"""A hand holds well if no more than this share of its strength is used."""

APART = 0.03
"""Two pads under a payload are at least so far apart [m]."""

PINNED, WEAK = 1.0, 3.0
"""How bad it is to hold by a pin, which needs a bore, and that there is no place at all. Suction
that holds well costs nothing."""

WAIT, LONG = 40.0, 1.5
"""How bad each metre is that a carrier waits for, and all of it at most: 25 mm are as bad as a
bore."""

PAIRED = 8
"""Of so many places on either side of the centre of mass pairs are tried."""


NEAR = 1e-3
"""Places whose distances differ by no more are as near as each other [m]."""


@dataclass(frozen=True, eq=False, slots=True)
class Groups:
    """Groups (g,) of clear `places`: the indices of the two, or of one twice, `chosen` (g, 2); the
    `share` (g,) of the strength of its tips used with suction, and with pins (`pinned`, g); the
    cost of the hands of robots that deliver to it from below, `served` (g,); whether the hand has
    to be there `first` (g,), and how far it goes back until its carrier may go on (`waits`, g)
    [m]."""

    places: Places
    chosen: Index
    share: Array
    pinned: Array
    served: Array
    first: Truth
    waits: Array

    def __len__(self) -> int:
        return len(self.chosen)

    def among(self, which: Index | Truth) -> Groups:
        """A selection of groups."""
        return Groups(
            self.places,
            self.chosen[which],
            self.share[which],
            self.pinned[which],
            self.served[which],
            self.first[which],
            self.waits[which],
        )

    @property
    def radius(self) -> Array:
        """Radius of their tips (g,) [m]."""
        return np.asarray(self.places.radius[self.chosen].min(axis=1))

    @property
    def covered(self) -> Array:
        """Share (g,) of a tip's face that the surface covers."""
        return np.asarray(self.places.covered[self.chosen].min(axis=1))

    @property
    def height(self) -> Array:
        """Height (g,) [m]."""
        return np.asarray(self.places.at[self.chosen[:, 0], 2])

    def across(self, way: tuple[float, float]) -> Array:
        """Position along a direction of the floor (g,) [m]."""
        return np.asarray((self.places.at[:, :2] @ np.array(way))[self.chosen].mean(axis=1))

    def cost(self, tip: TipName) -> Array:
        """Cost (g,) of holding with a tip; inf if that is too weak."""
        bad, wait = self.served + PINNED * (tip == "pin"), self.waits
        strong = self.share <= ENOUGH if tip == "suction" else self.pinned <= STRONG
        return np.where(strong, bad + np.minimum(WAIT * wait, LONG), np.inf)

    def used(self, tip: TipName) -> Array:
        """Share (g,) of the strength of such tips that is used."""
        return self.share if tip == "suction" else self.pinned

    @property
    def easy(self) -> bool:
        """Whether some group costs nothing by suction, without waiting or being in the way: none of
        two places is better than one place is then."""
        return bool(((self.cost("suction") + self.waits == 0.0) & ~self.first).any())

    def rank(self, tip: TipName, beside: Array) -> Index:
        """Rank of each group (g,): by the distance `beside` the best (g,), then as `first_by`."""
        rank = np.empty(len(self), np.intp)
        rank[np.lexsort((*self._keys(tip), beside))] = np.arange(len(self))
        return rank

    def first_by(self, tip: TipName) -> Index:
        """The best group (1,), by cost, waiting, being in the way, simplicity and strength."""
        return np.lexsort(self._keys(tip))[:1]

    def _keys(self, tip: TipName) -> tuple[Array | Truth, ...]:
        """The sort keys (g,) of all groups, the last first."""
        two = self.chosen[:, 0] != self.chosen[:, 1]
        return self.used(tip), two, self.first, self.waits, self.cost(tip)

    def keys(self, tip: TipName) -> tuple[float, ...]:
        """The sort key of the first group among groups of equal cost."""
        one, other = self.chosen[0].tolist()
        keys = self.waits[0], self.first[0], one != other, self.used(tip)[0]
        return tuple(map(float, keys))

    def spots(self) -> list[frozenset[Point3]]:
        """The places of each group, to 0.01 mm [m]."""
        at = [(x, y, z) for x, y, z in (self.places.at.round(5) + 0.0).tolist()]
        return [frozenset((at[one], at[other])) for one, other in self.chosen.tolist()]

    def points(self) -> tuple[Point3, ...]:
        """The places of the first group [m]."""
        at = self.places.at[sorted({*self.chosen[0].tolist()})]
        points = sorted((x, y, z) for x, y, z in at.round(6).tolist())
        return tuple(points)


def in_one_place(options: Sequence[Groups]) -> list[Groups]:
    """For each label the group at the place of least total cost, the strongest if several are;
    empty if the labels have no place in common."""
    numbers = [dict(zip(one.spots(), range(len(one)), strict=True)) for one in options]
    common = [spot for spot in numbers[0] if all(spot in number for number in numbers)]
    if not common:
        return [one.among(np.zeros(len(one), bool)) for one in options]
    each = [np.array([number[spot] for spot in common]) for number in numbers]
    pairs = [(one, at) for one, at in zip(options, each, strict=True)]
    costs = np.minimum(
        *(np.max([o.cost(tip)[at] for o, at in pairs], axis=0) for tip in ("suction", "pin"))
    )
    shares = np.max([o.share[at] for o, at in pairs], axis=0)
    best = np.lexsort((shares, costs))[:1]
    return [one.among(at[best]) for one, at in pairs]


def on_one_line(options: Sequence[Groups], way: tuple[float, float]) -> list[Groups]:
    """The groups of each label at one position along a direction of the floor: that of least total
    cost, the middle one if several are."""
    lines = [np.round(option.across(way), 5) for option in options]
    common, every = reduce(np.intersect1d, lines), np.concatenate(lines)
    if not len(common):
        return [option.among(np.zeros(len(option), bool)) for option in options]
    both = [*zip(options, lines, strict=True)]
    tips: tuple[TipName, ...] = "suction", "pin"
    costs = [
        min(max(float(o.cost(tip)[line == at].min()) for o, line in both) for tip in tips)
        for at in common
    ]
    off = np.abs(common - (every.min() + every.max()) / 2)
    best = common[np.lexsort((off, np.round(costs, 3)))[0]]
    return [option.among(line == best) for option, line in both]


def together(
    options: Sequence[Groups], by: TipName, u: tuple[float, float], t: tuple[float, float]
) -> list[Groups]:
    """A group for each label, the best combination: the carrier stands in one place for all of them
    if possible, and among several the middle of the label wins."""
    if len(options) == 1:
        return [options[0].among(options[0].first_by(by))]
    across = [option.across(t) for option in options]
    tried = np.unique(np.round(np.concatenate(across), 4))
    away, ranks, chosen = np.zeros(len(tried)), np.zeros(len(tried)), []
    for option, at in zip(options, across, strict=True):
        off, along = np.round(np.abs(at[:, None] - tried) / NEAR), option.across(u)
        beside = np.abs(along - (along.min() + along.max()) / 2)
        rank = option.rank(by, np.round(beside / NEAR))
        chosen.append(np.argmin(off * len(rank) + rank[:, None], axis=0))
        away += np.sqrt(off[chosen[-1], np.arange(len(tried))])
        ranks += rank[chosen[-1]]
    line = np.lexsort((ranks, np.round(away, 4)))[0]
    return [o.among(at[line : line + 1]) for o, at in zip(options, chosen, strict=True)]


def bad(share: Array, pinned: Array) -> Array:
    """Cost (n,) of tips of which these shares are used."""
    return np.where(share <= ENOUGH, 0.0, np.where(pinned <= STRONG, PINNED, WEAK))


def least(reach: Array, bad: Array, bound: Array) -> Array:
    """Cost of the best of those that reach no further than a bound (n,)."""
    order = np.argsort(reach)
    best = np.minimum.accumulate(np.append(WEAK, bad[order]))
    return np.asarray(best[np.searchsorted(reach[order], bound, side="right")])


def in_line(at: Array, along: int, centre: float) -> Iterator[tuple[int, int]]:
    """Pairs of places on one line along an axis, on either side of a centre and well apart."""
    lines: dict[float, list[int]] = {}
    for number, line in enumerate(np.round(at[:, 1 - along], 6).tolist()):
        lines.setdefault(line, []).append(number)
    for on in lines.values():
        before = [n for n in on if at[n, along] < centre]
        after = [n for n in on if at[n, along] >= centre]
        for one, other in pairs(_spread(before), _spread(after)):
            if at[other, along] - at[one, along] >= APART:
                yield one, other


def _spread(numbers: Sequence[int]) -> list[int]:
    """A sample of many: the first, and others spread evenly."""
    step = max(1, len(numbers) // (PAIRED // 2))
    return list(dict.fromkeys([*numbers[: PAIRED // 2], *numbers[::step]]))
