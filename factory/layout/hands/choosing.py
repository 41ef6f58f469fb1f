"""Choose a hand for every robot that carries something.

Two things make hands clear of each other whatever the robots do. A robot's guidepath runs under
the line of its hand, so that its finger is straight; and a robot that delivers holds its payload on
its own side of its carrier's line, so that it never reaches into that. What else could be met are
parts (`in_the_way.py`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product as pairs

import numpy as np

from factory.control.mode import Index, Truth
from factory.geometry.meshes import Array
from factory.geometry.solids import Product
from factory.layout.dimensions import FINGER
from factory.layout.hands.apart import BESIDE
from factory.layout.hands.hand import Hand, Kind, Point3
from factory.layout.hands.holding import Holding, held
from factory.layout.hands.in_the_way import InTheWay
from factory.layout.hands.lines import Fit, LineHands
from factory.layout.hands.places import PUSH, Places, centre_of, strain_of_two
from factory.layout.hands.reach import back, halves
from factory.layout.hands.surfaces import Way
from factory.layout.hands.tips import STRONG, TipName, tip
from factory.layout.hands.tours import Tours
from factory.plant.factory import Factory
from factory.problem.pag import NOPART

ENOUGH = 0.8
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


@dataclass(frozen=True, eq=False)
class TipPlaces:
    """Groups of places that one hand could hold together: the numbers of the two, or of one twice,
    `chosen` (g, 2), the `share` (g,) of the strength of its tips that is used by suction and if
    they are `pinned` (g,), and how badly those that deliver to it would hold from below then,
    `served` (g,)."""

    chosen: Index
    share: Array
    pinned: Array
    served: Array

    def best(self, first: Truth, waits: Array) -> int:
        """Which group is best: strong enough, in nobody's way, never waiting, simple, strong.
        `first`, `waits` (n, k) are those of the places."""
        share = np.where(self.share <= ENOUGH, self.share, self.pinned)
        wait = waits[self.chosen, 0].max(axis=1)
        cost = _bad(self.share, self.pinned) + self.served + np.minimum(WAIT * wait, LONG)
        two = self.chosen[:, 0] != self.chosen[:, 1]
        return int(np.lexsort((share, two, first[self.chosen].any(axis=1), wait, cost))[0])


class Hands:
    """The hands of a factory's robots. That of a carrier depends on its heading alone, since those
    that deliver to it depend on its line; that of another on its frame. `travels`: how far robots
    are to go at the least [m], as layouts have shown."""

    def __init__(self, factory: Factory, product: Product, push: float = PUSH) -> None:
        self.factory, self.tours = factory, Tours.apart(factory)
        self.holding = Holding(self.tours.factory, product, push, self.tours.turning)
        self.in_the_way = InTheWay(self.holding, self._carrier)
        adjusted = frozenset(tour for r in factory.adjusted for tour in self.tours.of[r])
        self.line_hands = LineHands(self.in_the_way, self.kinds, self._bad, adjusted)
        self._fed: dict[tuple[int, Way, Way], Hand] = {}
        self._carriers: dict[tuple[int, Way], Hand] = {}
        self._lines: dict[tuple[tuple[int, ...], object], tuple[Hand, ...]] = {}
        self._fits: dict[int, frozenset[Fit]] = {}
        self.travels: dict[int, float] = {}
        self._on = {tour: of for of in self.tours.of for tour in of}

    def hand(self, robot: int, u: Way, t: Way) -> Hand | None:
        """The hand of a robot that heads along u, to a carrier that heads along t; None for a
        tool. That of a robot with several tours is in its place on the label of the first."""
        tour, *others = tours = self.tours.of[robot]
        label = held(self.holding.factory, tour)
        if not label:
            return None
        if others:
            return self._on_line(tours, u, t)[0]
        if self.holding.is_carrier(tour):
            return self._carrier(tour, u)
        found = self._fed.get((tour, u, t))
        if found is None:
            found = self._fed[tour, u, t] = self._chosen(tour, label, [(u, t)])
        return found

    def shifts(self, robot: int, u: Way, t: Way | None = None) -> tuple[Point3, ...]:
        """For each tour of a robot how far the product is from where it is on the first, as seen
        from the robot [m], so that the hand stays where it is; nothing for one tour. `t` does not
        matter for a carrier."""
        tours = self.tours.of[robot]
        if len(tours) == 1 or not held(self.holding.factory, tours[0]):
            return ()
        places = [hand.places[0] for hand in self._on_line(tours, u, t)]
        found = np.round(np.array(places[:1]) - places, 6) + 0.0
        return tuple((x, y, z) for x, y, z in found.tolist())

    def together(self, robots: Sequence[int]) -> bool:
        """Whether robots with one tour each could share a hand, by estimate: in some way to lie a
        hand of one kind holds what each of them brings. It does not know of the size of tips, nor
        of the hands of others that are on lines."""
        tours = [tour for robot in robots for tour in self.tours.of[robot]]
        if any(not held(self.holding.factory, tour) for tour in tours):
            return True
        for tour in tours:
            if tour not in self._fits:
                self._fits[tour] = self.line_hands.fits(tour)
        common = frozenset.intersection(*(self._fits[tour] for tour in tours))
        if not any(map(self.holding.is_carrier, tours)):
            return bool(common)
        return any((u, back(t), kind, z) in common for u, t, kind, z in common)

    def carries(self, robot: int) -> bool:
        """Whether others come to a robot, with something or to work on what it holds."""
        return any(self.holding.is_carrier(tour) for tour in self.tours.of[robot])

    def is_fed(self, robot: int) -> bool:
        """Whether a feeder presents what a robot takes."""
        return self.holding.is_fed(self.tours.of[robot][0])

    def line(self, robot: int, u: Way) -> float:
        """Where the line of a robot's hand that heads along u is across its heading, in the frame
        of the product [m]."""
        across = 1 if u[0] else 0
        if self.carries(robot):
            return self._carrier(self.tours.of[robot][0], u).places[0][across]
        return float(self.holding.product.middle[across])

    def _on_line(self, tours: tuple[int, ...], u: Way, t: Way | None) -> tuple[Hand, ...]:
        """The hand of a line in its place on the label of each of its tours, where that can be."""
        carries = any(map(self.holding.is_carrier, tours))
        frames = self._sides(tours[0], u) if carries or t is None else ((u, t),)
        found = self._lines.get((tours, frames))
        if found is None:
            found = self.line_hands.chosen(tours, frames)
            if not found:
                none = self._nowhere(held(self.holding.factory, tours[0]))
                found = (none,) * len(tours)
            self._lines[tours, frames] = found
        return found

    def _carrier(self, robot: int, u: Way) -> Hand:
        tours = self._on[robot]
        if len(tours) > 1:
            return self._on_line(tours, u, None)[tours.index(robot)]
        found = self._carriers.get((robot, u))
        if found is None:
            frames, label = self._sides(robot, u), held(self.holding.factory, robot)
            several = len(self.holding.factory.tours[robot]) > 1
            found = self._nowhere(label) if several else self._chosen(robot, label, frames)
            self._carriers[robot, u] = found
        return found

    def _sides(self, robot: int, u: Way) -> tuple[tuple[Way, Way], ...]:
        """How a carrier that heads along u may lie."""
        delivers = self.holding.on[robot] >= 0
        sides = ((u[1], u[0]), (-u[1], -u[0])) if delivers else ((0.0, 1.0),)
        return tuple((u, (x + 0.0, y + 0.0)) for x, y in sides)

    def all_frames(self, robot: int) -> list[tuple[tuple[Way, Way], ...]]:
        """How a robot may lie on the floor: together what one hand has to be clear in."""
        found = list(self.holding.frames(robot))
        if self.holding.is_carrier(robot):
            return [self._sides(robot, u) for u in dict.fromkeys(u for u, _ in found)]
        return [(frame,) for frame in found]

    def _served(self, robot: int, found: Places) -> Array:
        """How badly those that deliver to a carrier would hold from below on their own side of its
        line, all together, by the place (n,) of its hand."""
        across = 1 - self.holding.axis[robot]
        line, spare = found.at[:, across], np.maximum(found.radius, FINGER / 2) + BESIDE
        total = np.zeros(len(found))
        for operation in self.holding.made(robot):
            sides = []
            for guest, label in zip(operation.robots, operation.before, strict=True):
                if guest != robot and label != NOPART:
                    under = self.holding.places(held(self.holding.factory, guest), "below", 2, -1)
                    at, bad = under.at[:, across], _bad(under.share, under.pinned)
                    half = halves(under.radius)
                    before = _least(at + half, bad, line - spare)
                    after = _least(half - at, bad, -line - spare)
                    sides.append((before, after))
            if len(sides) == 1:
                total += np.minimum(*sides[0])
            elif sides:
                (a, b), (c, d) = sides[:2]
                total += np.minimum(a + d, b + c)
        return total

    def _chosen(self, robot: int, label: str, frames: Sequence[tuple[Way, Way]]) -> Hand:
        """The best place that is clear in all of some frames, of the first kind that has one."""
        kinds, best = self.kinds(robot), None
        for kind in kinds:
            hand = self._best(robot, label, kind, frames)
            if hand is not None and (best is None or _cost(hand) < _cost(best)):
                best = hand
            if best is not None and not _cost(best):
                break
        return self._nowhere(label) if best is None else best

    def _nowhere(self, label: str) -> Hand:
        """No hand, at the centre of mass of what is to be held."""
        x, y, z = centre_of(self.holding.product, self.holding.factory.contents[label])[1].tolist()
        return Hand("none", ((float(x), float(y), float(z)),))

    def kinds(self, robot: int) -> tuple[Kind, ...]:
        """The kinds of hands that are tried for a robot, the first of them first."""
        if self.holding.is_fed(robot) and self.holding.is_carrier(robot):
            return "below", "behind"  # the tower of a hand above stands beside a feeder's part
        last = self.holding.last(robot)
        if last.lowered >= 0 and last.robots[last.lowered] == robot:
            return "above", "behind", "below"
        return "below", "behind", "above"

    def _best(
        self, robot: int, label: str, kind: Kind, frames: Sequence[tuple[Way, Way]]
    ) -> Hand | None:
        """The best hand of one kind; None where that is nowhere clear."""
        if not self.in_the_way.possible(robot, label, kind, frames):
            return None
        found, first, waits = self._clear(robot, label, kind, frames)
        if not len(found):
            return None
        groups = self._groups(robot, label, kind, found)
        best = groups.best(first, waits)
        holds_well = bool(groups.share[best] <= ENOUGH)
        at = sorted({*groups.chosen[best].tolist()}, key=lambda n: tuple(found.at[n]))
        x, y, z = (found.at[at, axis].round(6).tolist() for axis in range(3))
        radius = float(found.radius[at].min())
        beam = 0.0
        if kind == "above":
            beam = self.in_the_way.apart.beam(robot, found.chosen(np.array(at)), frames)
        early, late = bool(first[at].any()), waits[at].max(axis=0).round(6).tolist()
        while late and not late[-1]:
            late.pop()
        share = float((groups.share if holds_well else groups.pinned)[best])
        with_tip: TipName = "suction" if holds_well else "pin"
        return Hand(
            kind,
            tuple(zip(x, y, z, strict=True)),
            radius,
            beam,
            share,
            with_tip,
            early,
            (*late,),
            covered=(float(found.covered[at].min()) if holds_well else 1.0,),
        )

    def _bad(self, robot: int, kind: Kind, found: Places, waits: Array) -> Array:
        """How bad (2, n) places are by suction and by a pin, inf where that is too weak."""
        wait = np.minimum(WAIT * waits[:, 0], LONG)
        if kind == "below" and self.holding.is_carrier(robot):
            wait = wait + self._served(robot, found)
        suction = np.where(found.share <= ENOUGH, wait, np.inf)
        return np.stack([suction, np.where(found.pinned <= STRONG, wait + PINNED, np.inf)])

    def _groups(self, robot: int, label: str, kind: Kind, found: Places) -> TipPlaces:
        """Places that one hand could hold together: each alone, and under a payload two on one
        line."""
        carries = kind == "below" and self.holding.is_carrier(robot)
        served = self._served(robot, found) if carries else np.zeros(len(found))
        every = np.arange(len(found))
        alone = np.stack([every, every], axis=1), found.share, found.pinned, served
        if kind != "below":
            return TipPlaces(*alone)
        along = self.holding.axis[robot]
        _, centre = centre_of(self.holding.product, self.holding.factory.contents[label])
        two = np.array(list(_in_line(found.at, along, float(centre[along]))), int).reshape(-1, 2)
        at, radius = found.at[two], found.radius[two].min(axis=1)
        held = radius, at[:, 1] - at[:, 0], self.holding.loads(label).about(at.mean(axis=1))
        share = strain_of_two(tip("suction"), *held) / found.covered[two].min(axis=1)
        paired = two, share, strain_of_two(tip("pin"), *held), served[two].max(axis=1)
        return TipPlaces(*(np.concatenate(both) for both in zip(alone, paired, strict=True)))

    def _clear(
        self, robot: int, label: str, kind: Kind, frames: Sequence[tuple[Way, Way]]
    ) -> tuple[Places, Truth, Array]:
        """The places at which a hand is clear of all parts in every frame; whether (n,) it has to
        be there before what it takes, and how far (n, k) it goes back until each of the
        carrier's next operations may start [m]."""
        found = self.in_the_way.on_side(label, kind, frames)
        checks, first = self.in_the_way.checks(robot, label, kind, found, frames)
        free = np.logical_and.reduce([*checks.values(), np.ones(len(found), bool)])
        clear = found.chosen(free)
        return clear, first[free], self.in_the_way.waits(robot, kind, clear, frames)


def _cost(hand: Hand) -> float:
    """How bad a hand is."""
    wait = hand.waits[0] if hand.waits else 0.0
    return PINNED * (hand.tip == "pin") + min(WAIT * wait, LONG)


def _bad(share: Array, pinned: Array) -> Array:
    """How bad it is (n,) to hold with tips of which these shares are used."""
    return np.where(share <= ENOUGH, 0.0, np.where(pinned <= STRONG, PINNED, WEAK))


def _least(reach: Array, bad: Array, bound: Array) -> Array:
    """How bad the best is of those that reach no further than a bound (n,)."""
    order = np.argsort(reach)
    least = np.minimum.accumulate(np.append(WEAK, bad[order]))
    return np.asarray(least[np.searchsorted(reach[order], bound, side="right")])


def _in_line(at: Array, along: int, centre: float) -> Iterator[tuple[int, int]]:
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
    """Some of many, the first and others all over."""
    step = max(1, len(numbers) // (PAIRED // 2))
    return list(dict.fromkeys([*numbers[: PAIRED // 2], *numbers[::step]]))
