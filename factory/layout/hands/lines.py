"""One hand for a line: of the places at which each of its labels could be held, those that one hand
serves.

Hands of one line are of one kind, with one tip of one size. What differs from label to label is
where on it the tip is: the robot holds each label in such a place about itself that its tip is
there (docs/decisions/hands.md, Lines).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from factory.control.mode import Index, Truth
from factory.geometry.meshes import Array
from factory.layout.hands.hand import Hand, Kind
from factory.layout.hands.holding import held
from factory.layout.hands.in_the_way import InTheWay
from factory.layout.hands.places import Places
from factory.layout.hands.surfaces import Way
from factory.layout.hands.tips import TipName

LEVEL = 5e-5
"""Places are at one height that differ by no more [m]."""

RISING = 0.075
"""A tower behind is no higher than this over the top of what its robot takes [m]: so far a feeder's
pad has risen when the tower, which is 20 mm behind, comes to where it was."""

NEAR = 1e-3
"""Places whose distances differ by no more are as near as each other [m]."""

Frames = Sequence[tuple[Way, Way]]
"""How a robot may lie: along u, to a carrier that lies along t."""


Fit = tuple[Way, Way, Kind, float]
"""A way to hold a label: u, t, the kind of hand, and the height of its tip."""


@dataclass(frozen=True, eq=False, slots=True)
class Candidates:
    """The places (n,) at which one label can be held by a tip of one size, clear of everything; if
    the hand has to be there `first` (n,), how far it `waits` (n, k) for each later operation [m],
    and how `bad` each is by suction and by a pin (2, n), inf where it is too weak."""

    found: Places
    first: Truth
    waits: Array
    bad: Array

    def among(self, chosen: Index | Truth) -> Candidates:
        """Some of them."""
        return Candidates(
            self.found.chosen(chosen), self.first[chosen], self.waits[chosen], self.bad[:, chosen]
        )


@dataclass(frozen=True, slots=True)
class LineHands:
    """Looks for one hand for several tours, each given by its robot in a factory with a robot a
    tour. `kinds`: those that are tried for one; `bad`: how bad places are, by suction and by a pin
    (2, n), given waits; `adjusted`: tours of robots with a lift that is set for each."""

    in_the_way: InTheWay
    kinds: Callable[[int], tuple[Kind, ...]]
    bad: Callable[[int, Kind, Places, Array], Array]
    adjusted: frozenset[int] = frozenset()

    def common(self, tours: Sequence[int]) -> list[Kind]:
        """The kinds that are tried for all tours, the first of them first."""
        return [k for k in self.kinds(tours[0]) if all(k in self.kinds(t) for t in tours)]

    def fits(self, tour: int) -> frozenset[Fit]:
        """In which ways a hand of a line could hold the label of a tour: how its robot lies, of
        what kind it is, and at which height, for one that a lift would take anywhere 0 [m]."""
        holding, found, label = self.in_the_way.holding, set[Fit](), self._label(tour)
        by_heading: dict[tuple[float, ...], list[tuple[Way, Way]]] = {}
        for u, t in holding.frames(tour):
            by_heading.setdefault(u if holding.is_carrier(tour) else (*u, *t), []).append((u, t))
        for frames in by_heading.values():
            for kind in self.kinds(tour):
                if self.in_the_way.possible(tour, label, kind, frames):
                    at = self.in_the_way.on_side(label, kind, frames)
                    checks, _ = self.in_the_way.checks(tour, label, kind, at, frames)
                    free = np.logical_and.reduce([*checks.values(), np.ones(len(at), bool)])
                    lifted = tour in holding.factory.strokes or kind == "behind"
                    heights = np.unique(np.round(at.at[free, 2], 4)) * (not lifted)
                    found |= {(u, t, kind, z) for u, t in frames for z in heights.tolist()}
        return frozenset(found)

    def chosen(self, tours: Sequence[int], frames: Frames) -> tuple[Hand, ...]:
        """The hand in its place on the label of each tour, the best of the first kind for which
        there is one that is not bad at all, or that is least bad; nothing where there is none."""
        best, least = tuple[Hand, ...](), np.inf
        for kind in self.common(tours):
            for cost, hands in self._of_kind(kind, tours, frames):
                if cost < least:
                    best, least = hands, cost
            if not least:
                break
        return best

    def _of_kind(
        self, kind: Kind, tours: Sequence[int], frames: Frames
    ) -> Iterator[tuple[float, tuple[Hand, ...]]]:
        """Hands of one kind and how bad they are, with the largest tips first."""
        lifted = tours[0] in self.in_the_way.holding.factory.strokes
        lifted |= kind == "behind" and tours[0] in self.adjusted
        possible = all(self._possible(kind, tour, frames) for tour in tours)
        if not possible or not (lifted or self._level(tours)):
            return
        places = [self.in_the_way.on_side(self._label(tour), kind, frames) for tour in tours]
        if not all(len(found) for found in places):
            return
        most = min(float(found.radius.max()) for found in places)
        for radius in sorted({r for p in places for r in p.radius.tolist() if r <= most})[::-1]:
            options = [self._options(kind, tour, frames, radius) for tour in tours]
            if not all(len(option.found) for option in options):
                continue
            cost, chosen = _level(options, *frames[0], lifted)
            if cost < np.inf and (kind != "behind" or self._below_pads(tours, chosen[1])):
                yield cost, self._hands(kind, tours, frames, chosen)
            if not cost:
                return

    def _below_pads(self, tours: Sequence[int], chosen: Sequence[Candidates]) -> bool:
        """Whether the pads of a feeder have risen over a tower when it comes to them."""
        high = max(float(one.found.at[0, 2] + one.found.radius[0]) for one in chosen)
        boxes = (self.in_the_way.holding.box(self._label(tour)) for tour in tours)
        return high - min(float(box[1, 2]) for box in boxes) <= RISING

    def _possible(self, kind: Kind, tour: int, frames: Frames) -> bool:
        return self.in_the_way.possible(tour, self._label(tour), kind, frames)

    def _level(self, tours: Sequence[int]) -> bool:
        """Whether what tours deliver to is always at one height: it is one thing, or no robot that
        carries it has a lift."""
        holding = self.in_the_way.holding
        carriers = {holding.on[tour] for tour in tours}
        above = set[int]()
        for carrier in carriers if len(carriers) > 1 else ():
            while carrier >= 0 and carrier not in above:
                above.add(carrier)
                carrier = holding.on[carrier]
        return above.isdisjoint(holding.factory.strokes)

    def _label(self, tour: int) -> str:
        return held(self.in_the_way.holding.factory, tour)

    def _options(self, kind: Kind, tour: int, frames: Frames, radius: float) -> Candidates:
        """The places at which a tip of some radius holds the label of a tour, and is clear."""
        label = self._label(tour)
        found = self.in_the_way.on_side(label, kind, frames, radius)
        checks, first = self.in_the_way.checks(tour, label, kind, found, frames)
        free = np.logical_and.reduce([*checks.values(), np.ones(len(found), bool)])
        clear = found.chosen(free)
        waits = self.in_the_way.waits(tour, kind, clear, frames)
        return Candidates(clear, first[free], waits, self.bad(tour, kind, clear, waits))

    def _hands(
        self,
        kind: Kind,
        tours: Sequence[int],
        frames: Frames,
        chosen: tuple[TipName, Sequence[Candidates]],
    ) -> tuple[Hand, ...]:
        """One hand, in its place on each label."""
        tip, options = chosen
        waits = [option.waits[0].tolist() for option in options]
        longest = max(map(len, waits))
        padded = [[*wait, *[0.0] * (longest - len(wait))] for wait in waits]
        most = [round(max(wait), 6) for wait in zip(*padded, strict=True)]
        while most and not most[-1]:
            most.pop()
        found = [option.found for option in options]
        points = [at.at[0].round(6).tolist() for at in found]
        stem = 0.0
        if kind == "above":
            stem = max(
                self.in_the_way.apart.beam(tour, at, frames) - z
                for tour, at, (_, _, z) in zip(tours, found, points, strict=True)
            )
        suction = tip == "suction"
        shares = [(at.share if suction else at.pinned)[0] for at in found]
        hand = Hand(
            kind,
            (),
            float(found[0].radius[0]),
            0.0,
            float(max(shares)),
            tip,
            any(bool(option.first[0]) for option in options),
            (*most,),
            tuple(float(at.covered[0]) if suction else 1.0 for at in found),
        )
        return tuple(
            replace(hand, places=((x, y, z),), beam=z + stem if stem else 0.0) for x, y, z in points
        )


def _level(
    options: Sequence[Candidates], u: Way, t: Way, lifted: bool
) -> tuple[float, tuple[TipName, list[Candidates]]]:
    """Of places that are at one height for all labels, or at any for a robot that is `lifted`, the
    least bad, and how bad they are together; inf where there is no such height."""
    best: tuple[float, tuple[TipName, list[Candidates]]] = np.inf, ("suction", [])
    heights = np.unique(np.round(options[0].found.at[:, 2], 5)).tolist()
    for height in heights[:1] if lifted else heights:
        level = [o.among((np.abs(o.found.at[:, 2] - height) <= LEVEL) | lifted) for o in options]
        if not all(len(option.found) for option in level):
            continue
        tips: tuple[TipName, ...] = "suction", "pin"
        for number, tip in enumerate(tips):
            least = [float(option.bad[number].min()) for option in level]
            if max(least) < np.inf and max(least) < best[0]:
                good = [
                    option.among(option.bad[number] <= low + 1e-3)
                    for option, low in zip(level, least, strict=True)
                ]
                best = max(least), (tip, _together(good, u, t))
    return best


def _together(options: Sequence[Candidates], u: Way, t: Way) -> list[Candidates]:
    """For each label one of its places: such that the carrier stands in one place for all of them
    if that can be, and then in the middle of the label."""
    across = [option.found.at[:, :2] @ np.array(t) for option in options]
    tried = np.unique(np.round(np.concatenate(across), 4))
    away = [np.abs(at[:, None] - tried).min(axis=0) for at in across]
    line = tried[np.argmin(np.round(np.sum(np.sqrt(away), axis=0), 4))]
    found = []
    for option, at in zip(options, across, strict=True):
        off = np.round(np.abs(at - line) / NEAR)
        along = option.found.at[:, :2] @ np.array(u)
        beside = np.abs(along - (along.min() + along.max()) / 2)
        order = np.lexsort((option.found.share, np.round(beside / NEAR), off))
        found.append(option.among(order[:1]))
    return found
