"""Hands that meet hands: those of robots that deliver to one carrier, and the carrier's own."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import ClassVar

import numpy as np

from factory.floor.layout.dimensions import BEAM, FINGER, FINGER_TOP, PAYLOAD
from factory.floor.layout.hands.hand import Hand
from factory.floor.layout.hands.holding import Holding
from factory.floor.layout.hands.kinds import HandKind
from factory.floor.layout.hands.places import Places
from factory.floor.layout.hands.reach import back, halves, widths
from factory.floor.layout.hands.surfaces import Way, swept
from factory.support.arrays import Array, Truth
from factory.theory.plant.operation import Operation
from factory.theory.problem.pag import NOPART
from factory.theory.problem.robot_bodies import MAST

Swept = tuple[Array, Array, Array]
"""Boxes that hands sweep, from `low` to `high` (n, 3), and boxes (m, 2, 3) that could be in the
way [m]."""

BESIDE = 0.001
"""How far a hand stays to its own side of the line of another [m]."""

OVER, LEVEL = 0.01, 0.003
"""How far above everything the beam of a hand above is, and how far those of robots that lie across
each other are apart [m]."""

UNDER = (PAYLOAD - FINGER_TOP) / 2
"""How far a hand behind reaches down under the plane of payloads at the most, to the fingers of
those below [m]."""


class HandsApart:
    """Hands of a factory's robots that could meet. `hand_of`: that of a carrier with a heading;
    `BESIDE`: how far a hand stays to its own side of the line of another [m]."""

    BESIDE: ClassVar[float] = BESIDE

    def __init__(self, holding: Holding, hand_of: Callable[[int, Way], Hand]) -> None:
        self.holding, self.hand_of = holding, hand_of
        self._middles: dict[tuple[int, int], float | None] = {}

    @staticmethod
    def widths(places: Places) -> Array:
        """Widths (n,) of the fingers of the pads at places [m]."""
        return widths(places.radius)

    @staticmethod
    def swept(low: Array, high: Array, *ways: Way) -> tuple[Array, Array]:
        """Boxes from `low` to `high` (n, 3) [m], swept any distance along world directions."""
        return swept(low, high, *ways)

    def over_fingers(self, kind: HandKind, places: Places) -> Truth:
        """Whether a hand behind stays over the fingers of those below (n,)."""
        if not kind.level:
            return np.ones(len(places), bool)
        least = self.holding.product.low[2] - UNDER
        return np.asarray(places.at[:, 2] - halves(places.radius) >= least)

    def own_side(self, robot: int, kind: HandKind, places: Places, u: Way, t: Way) -> Truth:
        """Whether a hand at a place stays on its own side: of the carrier's line if the carrier is
        held from below too, otherwise of the payload of another robot that comes from the opposite
        side."""
        carrier, free = self.holding.on[robot], np.ones(len(places), bool)
        if carrier < 0 or self.holding.serves_fixed(robot):
            return free
        axis, side = (0, u[0]) if u[0] else (1, u[1])
        hand = self.hand_of(carrier, t)
        if hand.kind.rises and kind.rises:
            half = hand.half + BESIDE
            free &= (hand.places[0][axis] - places.at[:, axis]) * side >= halves(
                places.radius
            ) + half
        if (middle := self._middle(self.holding.last(robot), axis)) is not None:
            free &= (middle - places.at[:, axis]) * side >= halves(places.radius) + BESIDE / 2
        return free

    def _middle(self, operation: Operation, axis: int) -> float | None:
        """Position along an axis of the middle between the inputs of an operation that come from
        opposite sides [m]; None where no two do. Cached."""
        key = operation.index, axis
        if key not in self._middles:
            brought = [label for label in operation.before if label != NOPART]
            apart = operation.pile == NOPART and len(brought) > 1
            ends = [self.holding.box(label)[:, axis] for label in brought if apart]
            self._middles[key] = float(np.mean([sum(end) / 2 for end in ends])) if apart else None
        return self._middles[key]

    def crossing(self, robot: int, places: Places, u: Way, t: Way) -> Array:
        """Distance that a hand reaches over the line of a carrier whose tall mast comes along
        there, or over a broader part of its hand (n,) [m]."""
        carrier = self.holding.on[robot]
        if carrier < 0 or not (hand := self.hand_of(carrier, t)).kind.tall:
            return np.zeros(len(places))
        axis, side = (0, u[0]) if u[0] else (1, u[1])
        over = (places.at[:, axis] - hand.places[0][axis]) * side
        half = max(MAST / 2, float(halves(np.array(hand.radius))), hand.half * bool(hand.clamp))
        return np.maximum(0.0, over + halves(places.radius) + half + BESIDE)

    def beam(self, robot: int, at: Places, frames: Sequence[tuple[Way, Way]]) -> float:
        """Height of the lower edge of the beam of a hand above, by place [m]: over everything that
        its payload is joined to, and over its carrier's beam if it reaches over the carrier's
        line."""
        height = self.holding.top(self.holding.last(robot)) + OVER
        height += self.holding.axis[robot] * (BEAM + LEVEL)
        for u, t in frames:
            if self.crossing(robot, at, u, t).any():
                carriers = self.hand_of(self.holding.on[robot], t)
                if carriers.kind.hangs:
                    height = max(height, carriers.beam + BEAM + LEVEL)
        return height

    def carriers_hand(
        self, robot: int, kind: HandKind, places: Places, u: Way, t: Way
    ) -> Iterator[Swept]:
        """The sweep of a hand with everything behind it, against the carrier's hand: a tall one, as
        its lift rises, with everything behind it, since both are there at once; one below the
        column, with all its way ahead."""
        carrier = self.holding.on[robot]
        if carrier < 0 or self.holding.serves_fixed(robot):
            return
        if not (hand := self.hand_of(carrier, t)).kind.holds:
            return
        if kind.rises and hand.kind.rises:  # fingers keep to their sides
            return
        way_out = swept(*kind.boxes(self.holding.product, places.at, places.radius, u), back(u))
        way_out[1][:, 2] += self.holding.factory.lowering(robot)
        at, radius = np.array(hand.places), np.full(len(hand.places), hand.radius)
        low, high = hand.kind.boxes(self.holding.product, at, radius, t)
        if hand.kind.level:
            low[:, 2] -= self.holding.factory.lowering(carrier)
        if hand.kind.hangs:
            yield (*way_out, np.stack((low, high), axis=1))
            half = max(FINGER, hand.width) / 2
            low, high = at - half, at + half
            low[:, 2], high[:, 2] = hand.beam, hand.beam + BEAM
        ways = [back(t) if hand.kind.tall else t]
        if carrier in self.holding.turning and not hand.kind.tall:
            ways.append(back(t))
        for way in ways:
            yield (*way_out, np.stack(swept(low, high, way), axis=1))
