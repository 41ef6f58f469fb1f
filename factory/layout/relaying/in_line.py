"""The hands of robots that relay each other.

They run in one line, in two lanes beside it by turns. Giver and taker of a hand-over hold different
places, each on the side of the line on which its carriage runs, from below. So nothing of one comes
over the line, and none of two meets the other, whatever the robots do. As seen from what is handed
over every hand leaves against its heading and comes from ahead.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from factory.control.mode import Truth
from factory.geometry.meshes import Array
from factory.layout.dimensions import ARM_WIDTH, CARRIAGE, FINGER, Clearance
from factory.layout.hands.choosing import STRONG, Hands
from factory.layout.hands.hand import Hand, Kind, breadth
from factory.layout.hands.holding import Holding, held
from factory.layout.hands.in_the_way import BESIDE, InTheWay, Swept
from factory.layout.hands.places import Places, centre_of
from factory.layout.hands.surfaces import Way, swept
from factory.layout.layout import Layout, carriers
from factory.plant.factory import Factory, Operation


@dataclass(frozen=True, slots=True)
class Lane:
    """Where a robot runs that relays another: how it lies (`heading`, and `toward`, that of the
    carrier at the end of the line), the `line` across its heading in the frame of the product [m]
    to one `side` of which (+1, -1 along the axis) its lane is and it holds."""

    heading: Way
    toward: Way
    line: float
    side: int

    @property
    def across(self) -> int:
        """The axis across its heading."""
        return 1 if self.heading[0] else 0


SAME = 1e-5
"""Places that are no further apart across are on one line [m]."""

NOTHING = Hand("none", ((0.0, 0.0, 0.0),))
"""Where there is no hand."""


@dataclass(frozen=True, slots=True)
class InLine:
    """The hands of a factory with relays, and the robots (of that without) whose lanes are the
    other way round."""

    hands: tuple[Hand | None, ...]
    turned: frozenset[int]


def hands_in_line(
    before: Layout,
    factory: Factory,
    origins: Sequence[int],
    lines: Mapping[int, Sequence[int]],
    relays: Collection[int],
) -> InLine:
    """The hands of a factory with hand-overs in line, the operations `relays`: new ones of the
    robots that have one guidepath now, the last first (`lines`, by the robot whose it was), of
    others those of the robots that they were (`origins`). Of the kind `none` where nothing can
    hold strongly enough."""
    cut = {robot for pieces in lines.values() for robot in pieces}
    settled = [None if robot in cut else before.hand(old) for robot, old in enumerate(origins)]
    choice = _Choice(before, _Held(before, factory, origins, cut, relays), settled)
    on, turned = carriers(before.factory), set()
    for old in sorted(lines, key=lambda robot: _depth(on, robot)):
        if choice.settle(old, on[old], lines[old]) < 0:
            turned.add(old)
    return InLine(tuple(settled), frozenset(turned))


def _depth(on: Sequence[int], robot: int) -> int:
    """How many robots carry on what a robot delivers."""
    count = 0
    while on[robot] >= 0:
        count, robot = count + 1, on[robot]
    return count


class _Choice(Hands):
    """Chooses the hands of robots in lanes, those of carriers first, and of those that deliver to
    them; `settled`: those that are chosen."""

    holding: _Held
    in_the_way: _Ways

    def __init__(self, before: Layout, holding: _Held, settled: list[Hand | None]) -> None:
        self.before, self.holding, self.settled = before, holding, settled
        self.lanes: dict[int, Lane] = {}
        self.in_the_way = _Ways(holding, self.lanes, settled)

    def settle(self, old: int, carrier: int, pieces: Sequence[int]) -> int:
        """Choose the hands of the robots that have a robot's guidepath now, and its lanes: gives
        which way round, +1 or -1."""
        known = self.before.hand(old)
        if known is None or known.kind == "none":
            for robot in pieces:
                self.settled[robot] = known
            return 1
        tried = []
        for way in (1, -1):
            hands = self._hands(old, carrier, pieces, way, max(1.0, known.share))
            lacking = sum(hand.kind == "none" for hand in hands.values())
            tried.append((lacking, max(hand.share for hand in hands.values()), way, hands))
            if not lacking and tried[-1][1] <= STRONG:
                break
        _, _, way, hands = min(tried, key=lambda found: found[:2])
        for robot, hand in hands.items():
            self.settled[robot] = hand
        return way

    def _hands(
        self, old: int, carrier: int, pieces: Sequence[int], way: int, most: float
    ) -> dict[int, Hand]:
        """The hands of the robots that have a robot's guidepath now, and of those that deliver to
        them, with the lanes one way round."""
        found: dict[int, Hand] = {}
        for number, robot in enumerate(pieces):
            self.lanes[robot] = self._lane(old, carrier, pieces, way * (-1) ** number)
        for robot in pieces:
            found[robot] = self._below(
                robot, [(self.lanes[robot].heading, self.lanes[robot].toward)], most
            )
        for robot in pieces:
            self.settled[robot] = found[robot]
        for robot in pieces:
            guests = {g for o in self.holding.made(robot) for g in o.robots} - {robot}
            for guest in sorted(guests):
                if hand := self._guest(guest, robot):
                    found[guest] = hand
        return found

    def _guest(self, guest: int, robot: int) -> Hand | None:
        """The hand from below of a robot that delivers to one in a lane, on its own side; None
        where it has none from below, or where that is to be chosen."""
        known = self.before.hand(self.holding.origins[guest])
        if self.holding.on[guest] != robot or self.holding.cut(guest):
            return None
        if known is None or known.kind != "below":
            return None
        u, t = self.holding.headings[guest], self.holding.headings[robot]
        sides = (t, (-t[0], -t[1])) if self.holding.is_carrier(guest) else (t,)
        at, radius = np.array(known.places), np.full(len(known.places), known.radius)
        self.in_the_way.kept[guest] = known
        free = self.in_the_way.own_side(guest, Places(at, radius, radius), u, t)
        if free.all():
            return known
        return self._below(guest, [(u, side) for side in sides], max(1.0, known.share))

    def _lane(self, old: int, carrier: int, pieces: Sequence[int], side: int) -> Lane:
        """A lane to one side (of the guidepath's own) of a robot's guidepath. What the robots hold
        is divided near its centre of mass, where their crosses do not come to each other's arms."""
        path, layout = self.before.guidepaths[old], self.before
        toward = layout.guidepaths[carrier].heading if carrier >= 0 else (0.0, 1.0)
        across, way = (0 if path.side[0] else 1), round(path.side[0] + path.side[1])
        under = float(layout.product.middle[across]) + path.offset * way
        parts = self.holding.factory.contents[held(self.holding.factory, pieces[-1])]
        middle = float(centre_of(layout.product, parts)[1][across])
        c = self.holding.clearance
        room = c.spread - ARM_WIDTH / 2 - c.c / 2
        line = min(max(middle, under - room), under + room)
        return Lane(path.heading, toward, line, side * way)

    def _below(self, robot: int, frames: Sequence[tuple[Way, Way]], most: float) -> Hand:
        """The best hand from below of a robot, of whose strength no more than so much is used; of
        the kind `none` if there is none."""
        label = held(self.holding.factory, robot)
        found = self._best(robot, label, "below", frames)
        if found is not None and found.share <= most:
            return found
        parts = self.holding.factory.contents[label]
        x, y, z = centre_of(self.holding.product, parts)[1].tolist()
        return Hand("none", ((x, y, z),), share=most)


class _Held(Holding):
    """As `Holding`; hand-overs in line are no operations that others come to."""

    def __init__(
        self,
        before: Layout,
        factory: Factory,
        origins: Sequence[int],
        cut: Collection[int],
        relays: Collection[int],
    ) -> None:
        super().__init__(factory, before.product)
        self.relays, self.clearance = relays, Clearance(before.clearance)
        self.origins, self._cut = origins, cut
        self.headings = [before.guidepaths[old].heading for old in origins]
        for robot in cut:
            self.axis[robot] = 0 if self.headings[robot][0] else 1

    def made(self, robot: int) -> list[Operation]:
        return [o for o in super().made(robot) if o.index not in self.relays]

    def cut(self, robot: int) -> bool:
        """Whether a robot has a piece of a guidepath."""
        return robot in self._cut

    def gives(self, robot: int) -> bool:
        """Whether a robot delivers to one in line with it."""
        return self.last(robot).index in self.relays

    def takes(self, robot: int) -> bool:
        """Whether a robot takes over from one in line with it."""
        return self.factory.robots[robot].operations[0] in self.relays


class _Ways(InTheWay):
    """As `InTheWay`, for robots in lanes, and for those whose hands are chosen anew on the line of
    the one that was `kept`; `settled`: the hands that are chosen already."""

    holding: _Held

    def __init__(
        self, holding: _Held, lanes: Mapping[int, Lane], settled: Sequence[Hand | None]
    ) -> None:
        super().__init__(holding, lambda robot, _: settled[robot] or NOTHING)
        self.lanes, self.kept = lanes, dict[int, Hand]()

    def _own_side(self, robot: int, kind: Kind, found: Places, u: Way, t: Way) -> Truth:
        if robot in self.kept:
            known, across = self.kept[robot], 1 if u[0] else 0
            free: Truth = np.abs(found.at[:, across] - known.places[0][across]) < SAME
            free &= found.radius <= max(known.radius, FINGER / 2) + SAME
            return free & super()._own_side(robot, kind, found, u, t)
        lane, c = self.lanes[robot], self.holding.clearance
        wide = np.array([breadth(radius) / 2 for radius in found.radius.tolist()])
        away = (found.at[:, lane.across] - lane.line) * lane.side
        free = (away - wide >= c.c / 2) & (away - found.radius >= BESIDE)
        free &= away + wide <= c.spread + CARRIAGE / 2
        if self.holding.gives(robot):
            return free
        return free & super()._own_side(robot, kind, found, u, t)

    def own_side(self, robot: int, found: Places, u: Way, t: Way) -> Truth:
        """Whether a hand from below at a place (n,) stays on its own side."""
        return self._own_side(robot, "below", found, u, t)

    def _going_on(self, robot: int, kind: Kind, found: Places, u: Way, t: Way) -> Array:
        if self.holding.gives(robot):
            return np.zeros(len(found))
        return super()._going_on(robot, kind, found, u, t)

    def _crossing(self, robot: int, found: Places, u: Way, t: Way) -> Array:
        if self.holding.gives(robot):
            return np.zeros(len(found))
        return super()._crossing(robot, found, u, t)

    def _carriers_hand(
        self, robot: int, kind: Kind, found: Places, u: Way, t: Way
    ) -> Iterator[Swept]:
        if not self.holding.gives(robot):
            yield from super()._carriers_hand(robot, kind, found, u, t)

    def _leaving(
        self, robot: int, label: str, kind: Kind, found: Places, u: Way
    ) -> Iterator[Swept]:
        """Also what a hand sweeps as it comes to what it takes over, from ahead."""
        low, high = self.reach(kind, found, u)
        if self.holding.takes(robot):
            yield (*swept(low, high, u), self.holding.around(label, low, high))
        if self.holding.gives(robot):
            last = held(self.holding.factory, robot, at_last=True)
            yield (*swept(low, high, (-u[0], -u[1])), self.holding.around(last, low, high))
        else:
            yield from super()._leaving(robot, label, kind, found, u)

    def coming(
        self, robot: int, label: str, kind: Kind, found: Places, u: Way, t: Way
    ) -> Iterator[Swept]:
        if not self.holding.takes(robot):
            yield from super().coming(robot, label, kind, found, u, t)
