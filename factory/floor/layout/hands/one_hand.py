"""One hand for all that a robot brings: of the places at which each label could be held, those that
one hand serves.

It is of one kind, with tips of one size. What differs from label to label is where on it the tip
is: the robot holds each label in such a place about itself that its tip is there
(docs/decisions/hands.md, Lines). The outfeed takes all products in one place, so the output
robot's tip is in the same place on all of them. Of a robot that brings one label each place has a
tip of its own size, and under a payload there may be two.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from factory.floor.layout.dimensions import FINGER
from factory.floor.layout.hands.apart import BESIDE
from factory.floor.layout.hands.groups import (
    LONG,
    PINNED,
    WAIT,
    Groups,
    bad,
    in_line,
    in_one_place,
    least,
    on_one_line,
    together,
)
from factory.floor.layout.hands.hand import Hand
from factory.floor.layout.hands.holding import held
from factory.floor.layout.hands.in_the_way import Frames, InTheWay
from factory.floor.layout.hands.kinds import ABOVE, BEHIND, BELOW, HandKind
from factory.floor.layout.hands.places import Places, centre_of, strain_of_two
from factory.floor.layout.hands.reach import halves
from factory.floor.layout.hands.surfaces import Way
from factory.floor.layout.hands.tips import TipName, tip
from factory.support.allowance import Allowance
from factory.support.arrays import Array, Truth
from factory.theory.problem.pag import NOPART

LEVEL = 5e-5
"""Places are at one height that differ by no more [m]."""

RISING = 0.075
"""A tower behind is no higher than this over the top of what its robot takes [m]: so far a feeder's
pad has risen when the tower, which is 20 mm behind, comes to where it was."""

Fit = tuple[Way, Way, HandKind, float]
"""A way to hold a label: u, t, the kind of hand, and the height of its tip."""


@dataclass(frozen=True, slots=True)
class OneHand:
    """Finds one hand for some tours, each given by its robot in a factory with a robot for each
    tour.

    Attributes:
        in_the_way: the obstacles of hands.
        adjusted: tours of robots whose lift is adjusted for each.
    """

    in_the_way: InTheWay
    adjusted: frozenset[int] = frozenset()

    def kinds(self, tours: Sequence[int]) -> list[HandKind]:
        """The kinds of hand to try for all of some tours, in order."""
        return [k for k in self._kinds(tours[0]) if all(k in self._kinds(t) for t in tours)]

    def _kinds(self, tour: int) -> tuple[HandKind, ...]:
        holding = self.in_the_way.holding
        if self._jaws(tour):
            return (ABOVE, BELOW) if holding.factory.lowers(tour) else (BELOW, ABOVE)
        if holding.is_fed(tour) and holding.is_carrier(tour):
            return BELOW, BEHIND  # the tower of a hand above stands beside a feeder's part
        last = holding.last(tour)
        if not holding.factory.robots[tour].travels:
            return (ABOVE,)
        if last.lowered >= 0 and last.robots[last.lowered] == tour:
            return ABOVE, BEHIND, BELOW
        return BELOW, BEHIND, ABOVE

    def fits(self, tour: int) -> frozenset[Fit]:
        """The ways in which a hand of a line could hold the label of a tour: frame, kind and height
        [m], 0 with a lift."""
        holding, fits = self.in_the_way.holding, set[Fit]()
        by_heading: dict[tuple[float, ...], list[tuple[Way, Way]]] = {}
        for u, t in holding.frames(tour):
            by_heading.setdefault(u if holding.is_carrier(tour) else (*u, *t), []).append((u, t))
        for frames in by_heading.values():
            for kind in self._kinds(tour):
                if self._possible(kind, tour, frames):
                    places, free, _ = self._clear(kind, tour, frames)
                    lifted = holding.factory.goes_up(tour) or kind.level
                    heights = np.unique(np.round(places.at[free, 2], 4)) * (not lifted)
                    fits |= {(u, t, kind, z) for u, t in frames for z in heights.tolist()}
        return frozenset(fits)

    def chosen(self, tours: Sequence[int], frames: Frames) -> tuple[Hand, ...]:
        """The hand in its place on the label of each tour: the best of the first kind that costs
        nothing, or of least cost; empty if there is none."""
        best = tuple[Hand, ...]()
        for kind in self.kinds(tours):
            hands = self.of_kind(kind, tours, frames)
            if hands and (not best or _cost(hands[0]) < _cost(best[0])):
                best = hands
            if best and not _cost(best[0]):
                break
        return best

    def like(self, hand: Hand, tour: int, frames: Frames) -> tuple[Hand, ...]:
        """The hand of one tour that holds by the same places as another, by the same pads where it
        can; empty if it cannot."""
        if hand.kind not in self._kinds(tour) or not self._possible(hand.kind, tour, frames):
            return ()
        groups = self._groups(hand.kind, tour, frames, 0.0)
        if hand.kind.rises and not self._jaws(tour):
            groups = self._paired(tour, groups)
        at = groups.places.at[groups.chosen]
        ends = np.array((hand.places[0], hand.places[-1]))
        away = np.minimum(*(np.abs(at - both).max(axis=(1, 2)) for both in (ends, ends[::-1])))
        away[~np.isfinite(groups.cost(hand.tip))] = np.inf
        if not away.min(initial=np.inf) < LEVEL:
            return ()
        wider = np.abs(groups.places.radius[groups.chosen] - hand.radius).max(axis=1)
        same = groups.among(np.lexsort((wider, away.round(6)))[:1])
        if hand.kind.level and not self._below_pads([tour], [same]):
            return ()
        return self._hands(hand.kind, [tour], frames, hand.tip, [same])

    def of_kind(self, kind: HandKind, tours: Sequence[int], frames: Frames) -> tuple[Hand, ...]:
        """The best hand of one kind, with the largest tips among equals; empty if there is none.
        For one tour each place has its best tip."""
        alone = len(tours) == 1
        lifted = alone or self.in_the_way.holding.factory.goes_up(tours[0])
        lifted |= kind.level and tours[0] in self.adjusted
        possible = all(self._possible(kind, tour, frames) for tour in tours)
        if not possible or not (lifted or self._level(tours)):
            return ()
        best, lowest = tuple[Hand, ...](), np.inf
        for radius in [0.0] if alone else self._radii(kind, tours, frames):
            options = self._of_each(kind, tours, frames, radius)
            if not options:
                continue
            if not alone and self.in_the_way.holding.on[tours[0]] < 0:
                options = in_one_place(options)
            elif not alone and any(map(self._is_one_of_two, tours)):
                options = on_one_line(options, frames[0][1])
            if not all(map(len, options)):
                continue
            cost, by, chosen = _level(options, *frames[0], lifted)
            if cost < lowest and (not kind.level or self._below_pads(tours, chosen)):
                best, lowest = self._hands(kind, tours, frames, by, chosen), cost
            if not lowest:
                break
        return best

    def _of_each(
        self, kind: HandKind, tours: Sequence[int], frames: Frames, radius: float
    ) -> list[Groups]:
        """The groups of each tour; empty if a tour has none."""
        options = list[Groups]()
        for tour in tours:
            groups = self._groups(kind, tour, frames, radius)
            if kind.rises and not (radius or groups.easy or self._jaws(tour)):
                groups = self._paired(tour, groups)
            options.append(groups)
            if not len(groups):
                return []
        return options

    def _radii(self, kind: HandKind, tours: Sequence[int], frames: Frames) -> list[float]:
        """Possible radii of a tip for several tours, largest first [m]."""
        places = [self.in_the_way.on_side(tour, kind, frames) for tour in tours]
        most = min(float(of_tour.radius.max(initial=0.0)) for of_tour in places)
        return sorted({r for p in places for r in p.radius.tolist() if r <= most})[::-1]

    def _below_pads(self, tours: Sequence[int], chosen: Sequence[Groups]) -> bool:
        """Whether the pads of a feeder have risen over a tower when it comes to them."""
        high = max(float(one.height[0] + one.radius[0]) for one in chosen)
        boxes = (self.in_the_way.holding.box(self._label(tour)) for tour in tours)
        return high - min(float(box[1, 2]) for box in boxes) <= RISING

    def _possible(self, kind: HandKind, tour: int, frames: Frames) -> bool:
        return self.in_the_way.possible(tour, self._label(tour), kind, frames)

    def _level(self, tours: Sequence[int]) -> bool:
        """Whether the robots that tours deliver to are always at one height: it is one robot, or
        none has a lift."""
        holding = self.in_the_way.holding
        carriers = {holding.on[tour] for tour in tours}
        above = set[int]()
        for carrier in carriers if len(carriers) > 1 else ():
            while carrier >= 0 and carrier not in above:
                above.add(carrier)
                carrier = holding.on[carrier]
        return not any(map(holding.factory.goes_up, above))

    def _is_one_of_two(self, tour: int) -> bool:
        """Whether another robot delivers at the same junction: the carrier stands in one place for
        both."""
        last = self.in_the_way.holding.last(tour)
        guests = [r for r, x in zip(last.robots, last.before, strict=True) if x != NOPART]
        return len(guests) > 1 and last.carrier not in guests

    def _jaws(self, tour: int) -> bool:
        """Whether the robot of a tour has jaws, which close over one pad."""
        return bool(self.in_the_way.clamping.jaws(tour))

    def _label(self, tour: int) -> str:
        return held(self.in_the_way.holding.factory, tour)

    def _clear(
        self, kind: HandKind, tour: int, frames: Frames, radius: float = 0.0
    ) -> tuple[Places, Truth, Truth]:
        """The places for tips of a radius, or for the best tip at each if 0, for the label of a
        tour; whether each (n,) is clear in every frame, and whether the hand must be there
        first."""
        Allowance.heed()
        label = self._label(tour)
        places = self.in_the_way.on_side(tour, kind, frames, radius)
        checks, first = self.in_the_way.checks(tour, label, kind, places, frames)
        return places, np.logical_and.reduce([*checks.values(), np.ones(len(places), bool)]), first

    def _groups(self, kind: HandKind, tour: int, frames: Frames, radius: float) -> Groups:
        """The clear places at which a hand with such tips holds the label of a tour, each alone."""
        places, free, first = self._clear(kind, tour, frames, radius)
        clear, first = places.chosen(free), first[free]
        waits, every = self.in_the_way.waits(tour, kind, clear, frames), np.arange(len(clear))
        alone = np.stack([every, every], axis=1)
        carries = kind.rises and self.in_the_way.holding.is_carrier(tour)
        served = self._served(tour, clear) if carries else np.zeros(len(clear))
        return Groups(clear, alone, clear.share, clear.pinned, served, first, waits)

    def _paired(self, tour: int, alone: Groups) -> Groups:
        """Groups of one place, and of two on one line under what a tour brings."""
        holding, places = self.in_the_way.holding, alone.places
        along, label = holding.axis[tour], self._label(tour)
        _, centre = centre_of(holding.product, holding.factory.contents[label])
        two = np.array(list(in_line(places.at, along, float(centre[along]))), int).reshape(-1, 2)
        at, radius = places.at[two], places.radius[two].min(axis=1)
        held = radius, at[:, 1] - at[:, 0], holding.loads(label).about(at.mean(axis=1))
        share = strain_of_two(tip("suction"), *held) / places.covered[two].min(axis=1)
        pinned = strain_of_two(tip("pin"), *held)
        return Groups(
            places,
            np.concatenate([alone.chosen, two]),
            np.concatenate([alone.share, share]),
            np.concatenate([alone.pinned, pinned]),
            np.concatenate([alone.served, alone.served[two].max(axis=1)]),
            np.concatenate([alone.first, alone.first[two].any(axis=1)]),
            np.concatenate([alone.waits, alone.waits[two].max(axis=1)]),
        )

    def _served(self, tour: int, places: Places) -> Array:
        """Total cost of the hands of robots that deliver to a carrier, from below on their own side
        of its line, by the place (n,) of its hand."""
        holding = self.in_the_way.holding
        across = 1 - holding.axis[tour]
        line, spare = places.at[:, across], np.maximum(places.radius, FINGER / 2) + BESIDE
        total = np.zeros(len(places))
        for operation in holding.made(tour):
            sides = []
            for guest, label in zip(operation.robots, operation.before, strict=True):
                if guest != tour and label != NOPART:
                    anyhow = 1.0, 0.0  # the underside is the same for all headings
                    under = holding.places(self._label(guest), BELOW, anyhow)
                    at, half = under.at[:, across], halves(under.radius)
                    cost = bad(under.share, under.pinned)
                    before = least(at + half, cost, line - spare)
                    after = least(half - at, cost, -line - spare)
                    sides.append((before, after))
            if len(sides) == 1:
                total += np.minimum(*sides[0])
            elif sides:
                (a, b), (c, d) = sides[:2]
                total += np.minimum(a + d, b + c)
        return total

    def _hands(
        self,
        kind: HandKind,
        tours: Sequence[int],
        frames: Frames,
        by: TipName,
        chosen: Sequence[Groups],
    ) -> tuple[Hand, ...]:
        """One hand, in its place on each label."""
        wait = round(max(float(one.waits[0]) for one in chosen), 6)
        points, beams = [one.points() for one in chosen], [0.0] * len(chosen)
        if kind.hangs:
            apart, heights = self.in_the_way.apart, [z for ((_, _, z), *_) in points]
            over = [
                apart.beam(tour, one.places.chosen(one.chosen[0]), frames)
                for tour, one in zip(tours, chosen, strict=True)
            ]
            beams = [max(b + (z - y) for b, y in zip(over, heights, strict=True)) for z in heights]
        hand = Hand(
            kind,
            (),
            min(float(one.radius[0]) for one in chosen),
            0.0,
            max(float(one.used(by)[0]) for one in chosen),
            by,
            any(bool(one.first[0]) for one in chosen),
            wait,
            tuple(float(one.covered[0]) if by == "suction" else 1.0 for one in chosen),
            self.in_the_way.clamping.clamp(tours, kind, [p[0] for p in points], frames[0][0]),
        )
        both = zip(points, beams, strict=True)
        return tuple(replace(hand, places=places, beam=beam) for places, beam in both)


def _cost(hand: Hand) -> float:
    """The cost of a hand."""
    return PINNED * (hand.tip == "pin") + min(WAIT * hand.wait, LONG)


def _level(
    options: Sequence[Groups], u: Way, t: Way, lifted: bool
) -> tuple[float, TipName, list[Groups]]:
    """For groups at one height for all labels, or at any if the robot is `lifted`: the least total
    cost, its tip, and a group for each label; inf if there is no such height."""
    best: tuple[float, TipName, list[Groups]] = np.inf, "suction", []
    worst: tuple[float, ...] = (np.inf,)
    tips: tuple[TipName, ...] = "suction", "pin"
    heights = [np.inf] if lifted else np.unique(np.round(options[0].height, 5)).tolist()
    for height in heights:
        level = [o if lifted else o.among(np.abs(o.height - height) <= LEVEL) for o in options]
        for by in tips:
            costs = [option.cost(by) for option in level]
            low = [float(cost.min(initial=np.inf)) for cost in costs]
            if max(low) < np.inf and max(low) <= best[0]:
                good = [
                    option.among(cost <= bound + 1e-3)
                    for option, cost, bound in zip(level, costs, low, strict=True)
                ]
                chosen = together(good, by, u, t)
                keys = max(one.keys(by) for one in chosen)
                if (max(low), *keys) < worst:
                    best, worst = (max(low), by, chosen), (max(low), *keys)
    return best
