"""Payloads of robots in lanes, and obstacles of their hands."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from factory.api import Dimensions, Factory, Hand, Hands, Layout, LayoutSearch, Operation
from factory.support.arrays import Array, Truth
from factory.support.boxes import Point2


@dataclass(frozen=True, slots=True)
class Lane:
    """Where a robot runs that relays another: how it lies (`heading`, and `toward`, that of the
    carrier at the end of the line), the `line` across its heading in the frame of the product [m]
    to one `side` of which (+1, -1 along the axis) its lane is and it holds."""

    heading: Point2
    toward: Point2
    line: float
    side: int

    @property
    def across(self) -> int:
        """The axis across its heading."""
        return 1 if self.heading[0] else 0


Kind: TypeAlias = Hands.Kind
Places: TypeAlias = Hands.Sites

Swept = tuple[Array, Array, Array]
"""Boxes that hands sweep, from `low` to `high` (n, 3), and boxes (m, 2, 3) that could be in the
way [m]."""

SAME = 1e-5
"""Places that are no further apart across are on one line [m]."""

NOTHING = Hand.nothing((0.0, 0.0, 0.0))
"""Where there is no hand."""


class HoldingInLanes(Hands.Held):
    """As `Hands.Held`; no robot comes to a hand-over in line. `cut`: the robots that run on a piece
    of a guidepath."""

    def __init__(
        self,
        before: Layout,
        factory: Factory,
        origins: Sequence[int],
        cut: Collection[int],
        relays: Collection[int],
    ) -> None:
        super().__init__(factory, before.product)
        self.relays = relays
        self.clearance = LayoutSearch(before.factory, before.product, before.clearance).size
        self.origins, self.cut = origins, cut
        self.headings = [before.guidepaths[old].heading for old in origins]
        for robot in cut:
            self.axis[robot] = 0 if self.headings[robot][0] else 1

    def made(self, robot: int) -> list[Operation]:
        return [o for o in super().made(robot) if o.index not in self.relays]

    def gives(self, robot: int) -> bool:
        """Whether a robot delivers to one in line with it."""
        return self.last(robot).index in self.relays

    def takes(self, robot: int) -> bool:
        """Whether a robot takes over from one in line with it."""
        return self.factory.robots[robot].operations[0] in self.relays


class HandsApartInLanes(Hands.Apart):
    """As `Hands.Apart`, for robots in lanes, and for those whose hands are chosen anew on the line
    of the one that was `kept`."""

    holding: HoldingInLanes

    def __init__(
        self,
        holding: HoldingInLanes,
        lanes: Mapping[int, Lane],
        hand_of: Callable[[int, Point2], Hand],
    ) -> None:
        super().__init__(holding, hand_of)
        self.lanes, self.kept = lanes, dict[int, Hand]()

    def own_side(self, robot: int, kind: Kind, places: Places, u: Point2, t: Point2) -> Truth:
        if robot in self.kept:
            kept, across = self.kept[robot], 1 if u[0] else 0
            free: Truth = np.abs(places.at[:, across] - kept.places[0][across]) < SAME
            free &= places.radius <= max(kept.radius, Dimensions.FINGER / 2) + SAME
            return free & super().own_side(robot, kind, places, u, t)
        lane, c = self.lanes[robot], self.holding.clearance
        wide = self.widths(places) / 2
        away = (places.at[:, lane.across] - lane.line) * lane.side
        free = (away - wide >= c.c / 2) & (away - places.radius >= self.BESIDE)
        free &= away + wide <= c.spread + c.carriage / 2
        if self.holding.gives(robot):
            return free
        return free & super().own_side(robot, kind, places, u, t)

    def crossing(self, robot: int, places: Places, u: Point2, t: Point2) -> Array:
        if self.holding.gives(robot):
            return np.zeros(len(places))
        return super().crossing(robot, places, u, t)

    def carriers_hand(
        self, robot: int, kind: Kind, places: Places, u: Point2, t: Point2
    ) -> Iterator[Swept]:
        if not self.holding.gives(robot):
            yield from super().carriers_hand(robot, kind, places, u, t)


class InTheWayInLanes(Hands.Obstacles):
    """As `Hands.Obstacles`, for robots in lanes; `settled`: hands chosen already."""

    holding: HoldingInLanes
    apart: HandsApartInLanes

    def __init__(
        self, holding: HoldingInLanes, lanes: Mapping[int, Lane], settled: Sequence[Hand | None]
    ) -> None:
        def hand_of(robot: int, _: Point2) -> Hand:
            return settled[robot] or NOTHING

        super().__init__(holding, hand_of)
        self.apart = HandsApartInLanes(holding, lanes, hand_of)

    def possible(
        self, robot: int, label: str, kind: Kind, frames: Sequence[tuple[Point2, Point2]]
    ) -> bool:
        """Always true: a lane has two ends."""
        return True

    def checks(
        self,
        robot: int,
        label: str,
        kind: Kind,
        places: Places,
        frames: Sequence[tuple[Point2, Point2]],
    ) -> tuple[dict[str, Truth], Truth]:
        """Not cached, since lanes and settled hands change."""
        return self._looked_at(robot, label, kind, places, frames)

    def _passing(
        self, robot: int, label: str, kind: Kind, places: Places, u: Point2, t: Point2
    ) -> Hands.Contacts:
        return self._looked_past(robot, label, kind, places, u, t)

    def _going_on(self, robot: int, kind: Kind, places: Places, u: Point2, t: Point2) -> Array:
        if self.holding.gives(robot):
            return np.zeros(len(places))
        return super()._going_on(robot, kind, places, u, t)

    def _leaving(self, robot: int, kind: Kind, places: Places, u: Point2) -> Iterator[Swept]:
        """Also the sweep of a hand as it comes to take over, from ahead."""
        low, high = self.reach(kind, places, u)
        if self.holding.takes(robot):
            label = self.holding.held(robot)
            yield (*self.apart.swept(low, high, u), self.holding.boxes(label))
        if self.holding.gives(robot):
            last = self.holding.held(robot, at_last=True)
            yield (*self.apart.swept(low, high, (-u[0], -u[1])), self.holding.boxes(last))
        else:
            yield from super()._leaving(robot, kind, places, u)

    def coming(
        self, robot: int, label: str, kind: Kind, places: Places, u: Point2, t: Point2
    ) -> Iterator[Swept]:
        if not self.holding.takes(robot):
            yield from super().coming(robot, label, kind, places, u, t)
