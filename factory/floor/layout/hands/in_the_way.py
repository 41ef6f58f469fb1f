"""Obstacles of hands: parts, and the hands of robots that they deliver to.

Parts are boxes, swept along every way on which one passes the other.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import reduce
from hashlib import sha256

import numpy as np

from factory.floor.layout.dimensions import SLOT
from factory.floor.layout.hands.apart import BESIDE, HandsApart, Swept
from factory.floor.layout.hands.clamping import Clamping
from factory.floor.layout.hands.hand import Hand
from factory.floor.layout.hands.holding import Holding, held
from factory.floor.layout.hands.kinds import Boxes, HandKind
from factory.floor.layout.hands.lowered import Lowered
from factory.floor.layout.hands.places import SMALL, Places
from factory.floor.layout.hands.reach import back, halves
from factory.floor.layout.hands.surfaces import TOUCH, Way, hit, retreat, swept
from factory.floor.layout.hands.tips import STRONG
from factory.floor.layout.presence import ACROSS, ALONG
from factory.support.arrays import Array, Truth
from factory.theory.problem.pag import NOPART

IN_THE_WAY = {
    "weak": "not even a pin bears the load",
    "joined": "parts that it is joined to are in the way",
    "brought": "parts that are brought to it are in the way",
    "lowered": "parts that are lowered onto it are in the way",
    "own": "other surfaces of its own are in the way",
    "hands": "hands that hold beside it are in the way",
    "feeder": "there is no room beside its feeder's pad",
    "tray": "the outfeed's tray is in the way, or nothing would be left of it",
}
"""What can be in the way of a hand."""

PLAY = 1e-6
"""Places are no further than this beside the box of a sub-assembly [m]."""

Frames = Sequence[tuple[Way, Way]]
"""How a robot may lie: along u, to a carrier that lies along t."""

ROD = 0.008
"""Radius of the pad by which a feeder holds a part, at most [m]."""

ROOM = ACROSS + 2 * ALONG + TOUCH
"""A hand's face comes no nearer than this to what other robots hold [m]: two robots are off their
references."""

DIP, PUSHED = 0.02, 0.01
"""A product dips so deep into the slot of the outfeed's tray at the most, which begins so far ahead
of the hand [m]."""


@dataclass(frozen=True, eq=False, slots=True)
class Passed:
    """Contacts of a hand at each place (n,) with parts, whichever way its carrier goes: whether it
    has to be there `first`, before its payload; whether its delivery and what is `lowered` are in
    its way; whether inputs are, `early` if the hand is there first, `later` in any case."""

    first: Truth
    joined: Truth
    lowered: Truth
    early: Truth
    later: Truth


class InTheWay:
    """Obstacles of a factory's hands. `hand_of`: the hand of a carrier with a heading."""

    def __init__(self, holding: Holding, hand_of: Callable[[int, Way], Hand]) -> None:
        self.holding, self.apart = holding, HandsApart(holding, hand_of)
        self.lowered, self.clamping = Lowered(holding, self.apart), Clamping(holding)
        self._checked: dict[tuple[object, ...], tuple[dict[str, Truth], Truth]] = {}
        self._passed: dict[tuple[object, ...], Passed] = {}
        self._onward: dict[int, Array] = {}

    def possible(self, robot: int, label: str, kind: HandKind, frames: Frames) -> bool:
        """Whether any of a sub-assembly is on the side of its carrier's line on which a hand stays,
        in every frame; if not, none of its places needs to be computed."""
        box, none = self.holding.box(label) + np.array([[-PLAY], [PLAY]]), np.zeros(2)
        ends = Places(box, none, none, none, none)
        sides = (self.apart.own_side(robot, kind, ends, u, t) for u, t in frames)
        return all(bool(side.any()) for side in sides)

    def on_side(self, robot: int, kind: HandKind, frames: Frames, radius: float = 0.0) -> Places:
        """The places on the side of what a robot takes that a kind of hand holds, with the best pad
        at each or, if it fits, with one of a `radius` [m]."""
        u, _ = frames[0]
        places = self.holding.places(held(self.holding.factory, robot), kind, u, radius)
        return self.clamping.places(robot, kind, places, u)

    def checks(
        self,
        robot: int,
        label: str,
        kind: HandKind,
        places: Places,
        frames: Frames,
    ) -> tuple[dict[str, Truth], Truth]:
        """For each obstacle whether a hand at each place (n,) is clear of it in every frame; and
        whether it has to be there before its payload. Cached."""
        key = robot, kind, tuple(frames), _digest(places)
        if key not in self._checked:
            free, first = self._looked_at(robot, label, kind, places, frames)
            for column in self.clamping.columns(robot, kind, places, frames[0][0]):
                beside, before = self._looked_at(robot, label, kind, column, frames)
                free = {why: clear & beside[why] for why, clear in free.items()}
                first = first | before
            self._checked[key] = free, first
        return self._checked[key]

    def waits(self, robot: int, kind: HandKind, places: Places, frames: Frames) -> Array:
        """Distance that a hand at each place (n,) goes back, in any frame, until its carrier's next
        operation may start [m]."""
        waits = np.zeros(len(places))
        for at in (places, *self.clamping.columns(robot, kind, places, frames[0][0])):
            for u, t in frames if len(places) else ():
                going = self._going_on(robot, kind, at, u, t)
                waits = np.maximum.reduce([waits, going, self.apart.crossing(robot, at, u, t)])
        return waits

    def _looked_at(
        self,
        robot: int,
        label: str,
        kind: HandKind,
        places: Places,
        frames: Frames,
    ) -> tuple[dict[str, Truth], Truth]:
        free = {why: np.ones(len(places), bool) for why in IN_THE_WAY}
        free["weak"] &= places.pinned <= STRONG
        for u, t in frames:
            free["hands"] &= self.apart.own_side(robot, kind, places, u, t)
            free["hands"] &= ~_any(self.apart.carriers_hand(robot, kind, places, u, t), places)
            free["joined"] &= ~_any(self._raised(robot, kind, places, u, t), places)
            free["lowered"] &= ~_any(self.lowered.beams(robot, kind, places, u, t), places)
        free["hands"] &= self.apart.over_fingers(kind, places)
        headings = dict.fromkeys((u, (abs(x), abs(y))) for u, (x, y) in frames)
        passing = [self._passing(robot, label, kind, places, u, t) for u, t in headings]
        first = np.logical_or.reduce([passed.first for passed in passing])
        if self.holding.is_fed(robot) and kind.tall:
            free["own"] &= ~first
        if self.holding.is_fed(robot) and kind.hangs:
            free["feeder"] &= self._beside_rod(robot, label, places, *frames[0])
        if self.holding.factory.drops(self.holding.last(robot).index):
            free["tray"] &= (
                self._beside_slot(places, frames[0][0])
                if kind.rises
                else self.reach(kind, places, frames[0][0])[0][:, 2] >= self.holding.product.low[2]
            )
        if kind.level or (kind.hangs and not self.holding.is_fed(robot)):
            first |= True
        for passed in passing:
            free["joined"] &= ~passed.joined
            free["lowered"] &= ~passed.lowered
            free["brought"] &= ~(passed.later | (first & passed.early))
        return free, first

    def _passing(
        self, robot: int, label: str, kind: HandKind, places: Places, u: Way, t: Way
    ) -> Passed:
        """Contacts of the hand of a robot that heads along u. Cached: the sense of its carrier
        along t does not matter."""
        key = robot, kind, u, _digest(places)
        if key not in self._passed:
            self._passed[key] = self._looked_past(robot, label, kind, places, u, t)
        return self._passed[key]

    def _looked_past(
        self, robot: int, label: str, kind: HandKind, places: Places, u: Way, t: Way
    ) -> Passed:
        joined = list(self.joined(robot, kind, places, u, t))
        return Passed(
            _any(self.coming(robot, label, kind, places, u, t), places),
            _any(self._leaving(robot, kind, places, u), places),
            _any(self.lowered.onto(robot, kind, places, u), places),
            _any((ways for later, ways in joined if not later), places),
            _any((ways for later, ways in joined if later), places),
        )

    def met(
        self, robot: int, kind: HandKind, places: Places, u: Way, t: Way
    ) -> Iterator[tuple[str, Swept]]:
        """The obstacles of a hand at each place, each with its reason."""
        for ways in (
            *self._leaving(robot, kind, places, u),
            *self._raised(robot, kind, places, u, t),
        ):
            yield "joined", ways
        for ways in self.apart.carriers_hand(robot, kind, places, u, t):
            yield "hands", ways
        for ways in (
            *self.lowered.onto(robot, kind, places, u),
            *self.lowered.beams(robot, kind, places, u, t),
        ):
            yield "lowered", ways

    def reach(self, kind: HandKind, places: Places, u: Way) -> Boxes:
        """The boxes of hands of a kind at some places."""
        return kind.boxes(self.holding.product, places.at, places.radius, u)

    def _facing(self, kind: HandKind, places: Places, u: Way) -> Boxes:
        """The same among what other robots hold, with ROOM ahead of a face behind or above."""
        low, high = self.reach(kind, places, u)
        return kind.with_room(low, high, u, ROOM) if kind.tall else (low, high)

    def _beside_rod(self, robot: int, label: str, places: Places, u: Way, t: Way) -> Truth:
        """Whether a part has room for its feeder's rod: behind a hand above it, or on the side away
        from its tower, which stands against t; jaws are on both sides."""
        solid, room = self.holding.product.solids[label], np.zeros(len(places), bool)
        length = self.clamping.length(robot)
        for (x, y), far in ((u, -1.0), (t, 1.0))[: 1 if length else 2]:
            axis, way = (0, x) if x else (1, y)
            end = float((solid.high if way * far > 0 else solid.low)[axis])
            left = abs(end - places.at[:, axis]) - np.maximum(halves(places.radius), length)
            width = float((solid.high - solid.low)[:2].min())
            least = min(ROD, width / (8 if width <= SMALL else 4))
            room |= left >= least + BESIDE
        return room

    def _beside_slot(self, places: Places, u: Way) -> Truth:
        """Whether something low of the product rests on the rest of the tray: beside the slot
        through which a hand comes, or ahead of it."""
        along, ahead = (0, u[0]) if u[0] else (1, u[1])
        boxes = self.holding.boxes(held(self.holding.factory, 0, at_last=True))
        boxes = boxes[boxes[:, 0, 2] < self.holding.product.low[2] + DIP]
        half, at = halves(places.radius) + SLOT + BESIDE, places.at[:, 1 - along]
        sides = boxes[:, 0, 1 - along].min() < at - half, boxes[:, 1, 1 - along].max() > at + half
        end = (boxes[:, :, along] * ahead).max() - PUSHED
        return np.asarray(sides[0] | sides[1] | (end > places.at[:, along] * ahead + half))

    def _leaving(self, robot: int, kind: HandKind, places: Places, u: Way) -> Iterator[Swept]:
        """The sweep of a hand relative to the parts that it has delivered to, with their boxes, as
        it comes and leaves: along its heading, and downwards if it lowers its payload."""
        last, (low, high) = self.holding.last(robot), self.reach(kind, places, u)
        if self.holding.factory.drops(last.index):
            if not kind.level:
                whole = held(self.holding.factory, robot, at_last=True)
                yield (*swept(low, high, back(u)), self.holding.boxes(whole))
            return
        broad = kind.over_all(low, high, places.radius)
        for boxes in self.lowered.boxes(last, robot, (u,)):
            yield (*swept(*broad, back(u)), boxes)
        lifted = self.holding.factory.goes_up(robot)
        gone = swept(low, high) if kind.hangs and lifted else swept(low, high, back(u))
        if kind.rises:
            gone[1][:, 2] += self.holding.factory.lowering(robot)
        if not kind.level:
            yield (*gone, self.holding.boxes(last.label))
            return
        # its payload comes along the same way, or takes the bar down with it, which then rises
        gone = swept(*self._facing(kind, places, u), back(u))
        gone[1][:, 2] += 10.0 * lifted
        for other, guest in zip(last.before, last.robots, strict=True):
            if other != NOPART and (guest != robot or lifted):
                yield (*gone, self.holding.boxes(other))

    def _raised(
        self, robot: int, kind: HandKind, places: Places, u: Way, t: Way
    ) -> Iterator[Swept]:
        """The same for a hand above whose lift is up: it goes home over what it has delivered to,
        which may go on along t meanwhile, or either way if its carrier turns."""
        if kind.hangs and self.holding.factory.lowers(robot):
            low, high = self.reach(kind, places, u)
            low[:, 2] += self.holding.factory.lowering(robot)
            boxes = self.holding.boxes(self.holding.last(robot).label)
            for side in (back(t), t)[: 1 + (self.holding.on[robot] in self.holding.turning)]:
                yield (*swept(low, high, back(u), side), boxes)

    def _going_on(self, robot: int, kind: HandKind, places: Places, u: Way, t: Way) -> Array:
        """Distance that a hand has to go back (n,) [m], as its lift rises, until its carrier's next
        operation may start, which leaves along t, or either way if it turns."""
        if self.holding.factory.drops(self.holding.last(robot).index):
            return np.zeros(len(places))
        low, high = self.reach(kind, places, u)
        high[:, 2] += self.holding.factory.lowering(robot)
        onward = self._met_onward(robot)
        past = retreat(low, high, onward, (back(u), back(t)))
        if self.holding.on[robot] in self.holding.turning:
            past = np.maximum(past, retreat(low, high, onward, (back(u), t)))
        return np.asarray(past.max(axis=1, initial=0.0))

    def _met_onward(self, robot: int) -> Array:
        """The boxes (m, 2, 3) that a hand could meet in its carrier's next operation: everything
        there at its end, and what is lowered there."""
        factory, last = self.holding.factory, self.holding.last(robot)
        if last.index not in self._onward:
            made = [o for o in self.holding.made(last.carrier) if not factory.drops(o.index)]
            then = made[made.index(last) + 1 :][:1] if last in made else ()
            boxes = [self.holding.boxes(last.label)]
            for o in then:
                above = self.lowered.boxes(o, last.carrier, ())
                boxes = [self.holding.surfaces.boxes(factory.contents[o.label]), *above]
            self._onward[last.index] = np.concatenate(boxes)
        return self._onward[last.index]

    def coming(
        self, robot: int, label: str, kind: HandKind, places: Places, u: Way, t: Way
    ) -> Iterator[Swept]:
        """The sweep of a hand relative to what it takes, which is there before it comes home
        against u: a part, or inputs from either side."""
        low, high = self.reach(kind, places, u)
        part_boxes = self.holding.boxes(label)
        if not self.holding.is_fed(robot):
            for side in (t, back(t)):
                yield (*swept(low, high, u, side), part_boxes)
        elif kind.level:
            # the part comes down along the pad, its widest place too, and no nearer than may be
            low, high = kind.with_room(low, high, u, ACROSS + TOUCH)
            low[:, 2] -= 10.0
            yield low, high, part_boxes
        else:
            yield (*swept(low, high, u), part_boxes)

    def joined(
        self, robot: int, kind: HandKind, places: Places, u: Way, t: Way
    ) -> Iterator[tuple[bool, Swept]]:
        """The sweep of a hand relative to each input of its operations, which comes from either
        side while the hand is there, and as its lift rises; with whether that is so in any case,
        since it has a pile by then and the lift is up."""
        low, high = self._facing(kind, places, u)
        rising = low
        if kind.level:
            low, high = swept(low, high, back(u))
            rising = low - [0.0, 0.0, self.holding.factory.lowering(robot)]
        for operation in self.holding.made(robot):
            later = operation.pile != NOPART
            for guest, label in zip(operation.robots, operation.before, strict=True):
                if guest != robot and label != NOPART:
                    parts = self.holding.boxes(label)
                    for side in (t, back(t)):
                        yield later, (*swept(low if later else rising, high, side), parts)


def _digest(places: Places) -> bytes:
    """A digest of where places are, in place of 24 bytes for each in the keys of caches."""
    return sha256(places.at.tobytes()).digest()


def _any(sweeps: Iterable[Swept], places: Places) -> Truth:
    """Whether any sweep meets its boxes, for each place (n,)."""
    met = (hit(*ways) for ways in sweeps)
    return reduce(np.logical_or, met, np.zeros(len(places), bool))
