"""Choose a hand for every robot that carries something.

Two things make hands clear of each other whatever the robots do. A robot's guidepath runs under
the line of its hand, so that its finger is straight; and a robot that delivers holds its payload on
its own side of its carrier's line, so that it never reaches into that. What else could be met are
parts (`in_the_way.py`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product as pairs

import numpy as np

from factory.control.mode import Truth
from factory.geometry.meshes import Array
from factory.geometry.solids import Product
from factory.layout.dimensions import FINGER
from factory.layout.hands.apart import BESIDE
from factory.layout.hands.hand import Hand, Kind
from factory.layout.hands.holding import Holding, held
from factory.layout.hands.in_the_way import IN_THE_WAY, InTheWay
from factory.layout.hands.places import Places, centre_of, used_on_line
from factory.layout.hands.surfaces import Way
from factory.plant.factory import Factory
from factory.problem.pag import NOPART
from factory.support.errors import Diagnostic

ENOUGH = 0.8
"""A hand holds well if no more than this share of its strength is used."""

APART = 0.03
"""Two pads under a payload are at least so far apart [m]."""

STRONG = 0.9
"""The first kind is taken of which no more than this share is used."""

WEAK = 3.0
"""A share of a hand's strength that is as bad as none at all."""

PAIRED = 8
"""Of so many places on either side of the centre of mass pairs are tried."""


class Hands:
    """The hands of a factory's robots. That of a carrier depends on its heading alone, since those
    that deliver to it depend on its line; that of another on its frame."""

    def __init__(self, factory: Factory, product: Product) -> None:
        self.holding = Holding(factory, product)
        self._in_the_way = InTheWay(self.holding, self._carrier)
        self._fed: dict[tuple[int, Way, Way], Hand] = {}
        self._carriers: dict[tuple[int, Way], Hand] = {}

    def hand(self, robot: int, u: Way, t: Way) -> Hand | None:
        """The hand of a robot that heads along u, to a carrier that heads along t; None for a
        tool."""
        label = held(self.holding.factory, robot)
        if not label:
            return None
        if self.holding.is_carrier(robot):
            return self._carrier(robot, u)
        found = self._fed.get((robot, u, t))
        if found is None:
            found = self._fed[robot, u, t] = self._chosen(robot, label, [(u, t)])
        return found

    def line(self, robot: int, u: Way) -> float:
        """Where the line of a robot's hand that heads along u is across its heading, in the frame
        of the product [m]."""
        across = 1 if u[0] else 0
        if self.holding.is_carrier(robot):
            return self._carrier(robot, u).places[0][across]
        return float(self.holding.product.middle[across])

    def _carrier(self, robot: int, u: Way) -> Hand:
        found = self._carriers.get((robot, u))
        if found is None:
            sides = ((u[1], u[0]), (-u[1], -u[0])) if robot else ((0.0, 1.0),)
            frames = [(u, (x + 0.0, y + 0.0)) for x, y in sides]
            found = self._chosen(robot, held(self.holding.factory, robot), frames)
            self._carriers[robot, u] = found
        return found

    def _served(self, robot: int, found: Places) -> Array:
        """How weakly those that deliver to a carrier would hold from below on their own side of its
        line, all together, by the place (n,) of its hand."""
        across = 1 - self.holding.axis[robot]
        line, spare = found.at[:, across], np.maximum(found.radius, FINGER / 2) + BESIDE
        total = np.zeros(len(found))
        for operation in self.holding.made(robot):
            sides = []
            for guest, label in zip(operation.robots, operation.before, strict=True):
                if guest != robot and label != NOPART:
                    under = self.holding.places(held(self.holding.factory, guest), "below", 2, -1)
                    before = _least(under.at[:, across] + under.radius, under.share, line - spare)
                    after = _least(under.radius - under.at[:, across], under.share, -line - spare)
                    sides.append((before, after))
            if len(sides) == 1:
                total += np.minimum(*sides[0])
            elif sides:
                (a, b), (c, d) = sides[:2]
                total += np.minimum(a + d, b + c)
        return total

    def _chosen(self, robot: int, label: str, frames: Sequence[tuple[Way, Way]]) -> Hand:
        """The best place that is clear in all of some frames, of the first kind that has one."""
        last = self.holding.last(robot)
        lowered = last.lowered >= 0 and last.robots[last.lowered] == robot
        kinds: tuple[Kind, ...] = ("below", "behind", "above")
        if lowered:
            kinds = ("above", "behind", "below")
        if self.holding.is_fed(robot) and self.holding.is_carrier(robot):
            kinds = ("below", "behind")  # the tower of a hand above stands beside a feeder's part
        best: Hand | None = None
        for kind in kinds:
            hand = self._best(robot, label, kind, frames)
            if hand is not None and (best is None or hand.share < best.share):
                best = hand
            if best is not None and best.share <= STRONG:
                break
        if best is not None:
            return best
        x, y, z = centre_of(self.holding.product, self.holding.factory.contents[label])[1].tolist()
        why = "; ".join(self._missed(robot, label, kind, frames) for kind in kinds)
        return Hand("none", ((float(x), float(y), float(z)),), why=why)

    def _missed(self, robot: int, label: str, kind: Kind, frames: Sequence[tuple[Way, Way]]) -> str:
        """What is in the way of most places of a kind, in words."""
        found = self._in_the_way.on_side(label, kind, frames)
        if not len(found):
            return f"{kind} there is no place for a pad"
        checks, _, _ = self._in_the_way.checks(robot, label, kind, found, frames)
        why, free = min(checks.items(), key=lambda item: int(item[1].sum()))
        return f"{kind}, {len(found) - int(free.sum())} of {len(found)} places: {IN_THE_WAY[why]}"

    def _best(
        self, robot: int, label: str, kind: Kind, frames: Sequence[tuple[Way, Way]]
    ) -> Hand | None:
        """The best hand of one kind; None where that is nowhere clear."""
        found, first, waits = self._clear(robot, label, kind, frames)
        groups = list(self._groups(robot, label, kind, found))
        if not groups:
            return None
        chosen, share, _ = min(groups, key=lambda group: self._rank(group, first, waits))
        at = sorted(chosen, key=lambda n: tuple(found.at[n]))
        x, y, z = (found.at[at, axis].round(6).tolist() for axis in range(3))
        radius = float(found.radius[at].min())
        beam = 0.0
        if kind == "above":
            beam = self._in_the_way.apart.beam(robot, found.chosen(np.array(at)), frames)
        early, late = bool(first[at].any()), round(float(waits[at].max()), 6)
        return Hand(kind, tuple(zip(x, y, z, strict=True)), radius, beam, share, early, late)

    def _groups(
        self, robot: int, label: str, kind: Kind, found: Places
    ) -> Iterator[tuple[tuple[int, ...], float, float]]:
        """Places that one hand could hold together, the share of its strength that is used, and how
        many that deliver to it could not hold from below then: each place alone, and under a
        payload two on one line."""
        carries = kind == "below" and self.holding.is_carrier(robot)
        served = self._served(robot, found) if carries else np.zeros(len(found))
        for number in range(len(found)):
            yield (number,), float(found.share[number]), float(served[number])
        if kind != "below":
            return
        along = self.holding.axis[robot]
        mass, centre = centre_of(self.holding.product, self.holding.factory.contents[label])
        lines: dict[float, list[int]] = {}
        for number, line in enumerate(np.round(found.at[:, 1 - along], 6).tolist()):
            lines.setdefault(line, []).append(number)
        for on in lines.values():
            before = [n for n in on if found.at[n, along] < centre[along]]
            after = [n for n in on if found.at[n, along] >= centre[along]]
            for pair in pairs(_spread(before), _spread(after)):
                two = list(pair)
                if found.at[two[1], along] - found.at[two[0], along] < APART:
                    continue
                share = used_on_line(found.at[two], found.radius[two], mass, centre, along)
                yield pair, share, float(served[two].max())

    @staticmethod
    def _rank(
        group: tuple[tuple[int, ...], float, float], first: Truth, waits: Array
    ) -> tuple[float, ...]:
        """How good a hand is, the less the better: strong enough, in nobody's way, never waiting,
        simple, strong."""
        chosen, share, served = group
        at = list(chosen)
        weak = max(round(share, 1), ENOUGH) + served
        return weak, float(waits[at].max()), float(first[at].any()), len(chosen), share

    def _clear(
        self, robot: int, label: str, kind: Kind, frames: Sequence[tuple[Way, Way]]
    ) -> tuple[Places, Truth, Array]:
        """The places at which a hand is clear of all parts in every frame; whether (n,) it has to
        be there before what it takes, and how far (n,) it goes back until what it has delivered
        can leave [m]."""
        found = self._in_the_way.on_side(label, kind, frames)
        checks, first, waits = self._in_the_way.checks(robot, label, kind, found, frames)
        free = np.logical_and.reduce([*checks.values(), np.ones(len(found), bool)])
        return found.chosen(free), first[free], waits[free]


def _least(reach: Array, share: Array, bound: Array) -> Array:
    """The least share, from ENOUGH to WEAK, of those that reach no further than a bound (n,)."""
    order = np.argsort(reach)
    least = np.minimum.accumulate(np.append(WEAK, share[order]))
    chosen = least[np.searchsorted(reach[order], bound, side="right")]
    return np.asarray(np.maximum(chosen, ENOUGH))


def _spread(numbers: Sequence[int]) -> list[int]:
    """Some of many, the first and others all over."""
    step = max(1, len(numbers) // (PAIRED // 2))
    return list(dict.fromkeys([*numbers[: PAIRED // 2], *numbers[::step]]))


def no_grips(factory: Factory, product: Product) -> tuple[Diagnostic, ...]:
    """A warning (NoGrip) for each sub-assembly that no hand can hold, however its robot lies."""
    hands, found = Hands(factory, product), []
    for robot in factory.robots:
        chosen = [hands.hand(robot.index, u, t) for u, t in hands.holding.frames(robot.index)]
        if chosen and all(hand is not None and hand.kind == "none" for hand in chosen):
            label, why = held(factory, robot.index), chosen[0].why if chosen[0] else ""
            message = f"no hand can hold '{label}': {why}"
            hint = "it is held without one; join it in another order, or by a relay from above"
            position = factory.by_label[label].position
            found.append(Diagnostic("NoGrip", message, position, hint))
    return tuple(found)
