"""The hands of robots that relay each other.

They run in one line, in two lanes beside it in alternation. Giver and taker of a hand-over hold
different places, each on the side of the line on which its carriage runs, from below. So nothing of
one comes over the line, and neither meets the other, whatever the robots do. Seen from the payload,
every hand leaves against its heading and comes from ahead.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from factory.api import Dimensions, Factory, Hand, Hands, Layout, LayoutSearch
from factory.apps.relay.lanes import HoldingInLanes, InTheWayInLanes, Lane
from factory.support.boxes import Point2

InLine = tuple[tuple[Hand | None, ...], set[int]]
"""The hands of a factory with relays, and the robots (of the factory without) whose lanes are
exchanged."""


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
    choice = _Choice(before, HoldingInLanes(before, factory, origins, cut, relays), settled)
    on, turned = LayoutSearch(before.factory, before.product).carriers, set[int]()
    for old in sorted(lines, key=lambda robot: _depth(on, robot)):
        if choice.settle(old, on[old], lines[old]) < 0:
            turned.add(old)
    return tuple(settled), turned


def _depth(on: Sequence[int], robot: int) -> int:
    """Number of robots that carry on what a robot delivers."""
    count = 0
    while on[robot] >= 0:
        count, robot = count + 1, on[robot]
    return count


class _Choice:
    """Chooses the hands of robots in lanes, carriers first, and of those that deliver to them;
    `settled`: hands chosen already."""

    def __init__(self, before: Layout, holding: HoldingInLanes, settled: list[Hand | None]) -> None:
        self.before, self.holding, self.settled = before, holding, settled
        self.lanes: dict[int, Lane] = {}
        self.in_the_way = InTheWayInLanes(holding, self.lanes, settled)

    def settle(self, old: int, carrier: int, pieces: Sequence[int]) -> int:
        """Choose the hands of the robots that now share a robot's guidepath, and its lanes. Returns
        their orientation, +1 or -1."""
        before = self.before.hand(old)
        if before is None or not before.kind.holds:
            for robot in pieces:
                self.settled[robot] = before
            return 1
        tried = []
        for way in (1, -1):
            hands = self._hands(old, carrier, pieces, way, max(Hand.STRONG, before.share))
            lacking = sum(not hand.kind.holds for hand in hands.values())
            tried.append((lacking, max(hand.share for hand in hands.values()), way, hands))
            if not lacking and tried[-1][1] <= Hand.STRONG:
                break
        _, _, way, hands = min(tried, key=lambda attempt: attempt[:2])
        for robot, hand in hands.items():
            self.settled[robot] = hand
        return way

    def _hands(
        self, old: int, carrier: int, pieces: Sequence[int], way: int, most: float
    ) -> dict[int, Hand]:
        """The hands of the robots that share a robot's guidepath, and of those that deliver to
        them, for one orientation of the lanes."""
        hands: dict[int, Hand] = {}
        for number, robot in enumerate(pieces):
            self.lanes[robot] = self._lane(old, carrier, pieces, way * (-1) ** number)
        for robot in pieces:
            lane = self.lanes[robot]
            hands[robot] = self._below(robot, [(lane.heading, lane.toward)], most)
        for robot in pieces:
            self.settled[robot] = hands[robot]
        for robot in pieces:
            guests = {g for o in self.holding.made(robot) for g in o.robots} - {robot}
            for guest in sorted(guests):
                if hand := self._guest(guest, robot):
                    hands[guest] = hand
        return hands

    def _guest(self, guest: int, robot: int) -> Hand | None:
        """The hand from below of a robot that delivers to one in a lane, on its own side; None
        where it has none from below, or where that is to be chosen."""
        before = self.before.hand(self.holding.origins[guest])
        if self.holding.on[guest] != robot or guest in self.holding.cut:
            return None
        if before is None or not before.kind.rises:
            return None
        u, t = self.holding.headings[guest], self.holding.headings[robot]
        sides = (t, (-t[0], -t[1])) if self.holding.is_carrier(guest) else (t,)
        at, radius = np.array(before.places), np.full(len(before.places), before.radius)
        self.in_the_way.apart.kept[guest] = before
        free = self.in_the_way.apart.own_side(
            guest, before.kind, Hands.Sites(at, radius, radius, radius, radius), u, t
        )
        if free.all():
            return before
        return self._below(guest, [(u, side) for side in sides], max(Hand.STRONG, before.share))

    def _lane(self, old: int, carrier: int, pieces: Sequence[int], side: int) -> Lane:
        """A lane to one side (of the guidepath's own) of a robot's guidepath. What the robots hold
        is divided near its centre of mass, where their crosses do not come to each other's arms."""
        path, layout = self.before.guidepaths[old], self.before
        toward = layout.guidepaths[carrier].heading if carrier >= 0 else (0.0, 1.0)
        across, way = (0 if path.side[0] else 1), round(path.side[0] + path.side[1])
        under = float(layout.product.middle[across]) + path.offset * way
        middle = float(self.holding.centre(self.holding.held(pieces[-1]))[across])
        c = self.holding.clearance
        room = c.spread - Dimensions.ARM_WIDTH / 2 - c.c / 2
        line = min(max(middle, under - room), under + room)
        return Lane(path.heading, toward, line, side * way)

    def _below(self, robot: int, frames: Sequence[tuple[Point2, Point2]], most: float) -> Hand:
        """The best hand from below of a robot, using at most a given share of its strength; of the
        kind `none` if there is none."""
        label = self.holding.held(robot)
        hands = Hands.Choice(self.in_the_way).of_kind(Hand.BELOW, [robot], frames)
        if hands and hands[0].share <= most:
            return hands[0]
        x, y, z = self.holding.centre(label).tolist()
        return Hand.nothing((x, y, z), most)
