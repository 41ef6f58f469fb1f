"""The footprint of one robot: the floor of its own path, with its feeder and its piles.

Frame of a robot: u ahead along its heading, t along the heading of the robot it delivers to, the
origin at its B station. Everything has half a clearance around it.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate
from math import inf

from factory.floor.layout.dimensions import PAYLOADS, POST, SIDE, Clearance
from factory.floor.layout.shapes import Shape
from factory.floor.layout.stops import Stop, stops_of
from factory.support.boxes import Extent, hull
from factory.support.decimals import up
from factory.theory.plant.factory import Factory
from factory.theory.plant.operation import Operation
from factory.theory.problem.robot_bodies import MAST

Block = tuple[float, float, float, float]
"""(ulo, uhi, tlo, thi) [m]; on one side of a path (from, to, near, far), away from its line."""

Placed = tuple[float, Extent]
"""A pile: where the product's middle is, ahead of the B station [m], and its box about it."""

Strip = tuple[float, float, float]
"""How far to one side a path takes the floor, by layer [m]; -inf for not at all."""


@dataclass(frozen=True)
class Footprint:
    """The footprint of one robot.

    Attributes:
        shape: the robot's shape with its payloads.
        clearance: the clearances to keep.
        stops: where it stands for the operations after which it carries something, one after
            the other; the first may be at a feeder.
        returns: whether it comes back to some: then all that it ever holds may be anywhere from
            the first of them on.
        corridor: whether its way ahead is kept free for its last pile.
    """

    shape: Shape
    clearance: Clearance
    stops: tuple[Stop, ...]
    returns: bool = False
    corridor: bool = False

    def pile(self, stop: Stop) -> Extent:
        """The box of everything that the robot may hold at a stop."""
        piles = self.shape.piles
        if self.returns and not (self.fed and stop is self.stops[0]):
            return hull(list(piles.values()))
        return hull([piles[operation.index] for operation in stop.operations])

    @cached_property
    def half(self) -> float:
        """Half a clearance [m]."""
        return self.clearance.c / 2

    @cached_property
    def fed(self) -> bool:
        """Whether a feeder presents the first pile."""
        return bool(self.stops) and len(self.stops[0].first.robots) == 1

    @cached_property
    def housing(self) -> Extent:
        """The housing of the feeder about the product's middle, nowhere without one [m]."""
        if not self.fed:
            return inf, -inf, inf, -inf
        rear, front, low, high = self.pile(self.stops[0])
        return rear - SIDE, front + SIDE, low - SIDE, high + SIDE

    @cached_property
    def frontier(self) -> tuple[float, float, float]:
        """Where along the path, by layer, other robots may come to it from the side: ahead of the
        housing."""
        return (-inf, -inf, self.housing[1] + self.half)

    @cached_property
    def strips(self) -> dict[int, Strip]:
        """The floor taken on each side, with the last pile."""
        last = self.shape.laden(self.shape.last)
        return {side: self.strip(side, last) for side in (-1, +1)}

    def strip(self, side: int, pile: Extent) -> Strip:
        """The floor taken on one side, with a pile on the path."""
        shape, half = self.shape, self.half
        lane = side * shape.offset + half + shape.spread
        post = side * shape.post + POST / 2 + half if self.fed else -inf
        ahead = extent_to(shape.last, side) + SIDE + half if self.corridor else -inf
        wide = max(extent_to(pile, side), extent_to(self.housing, side))
        load = -inf if shape.tool else max(wide + half, post)
        carriage, mast = (lane + width / 2 for width in (self.clearance.carriage, MAST))
        return max(carriage, post, ahead), max(mast, post, ahead), load

    def strip_at(self, piles: Sequence[Placed]) -> Callable[[int, float], Strip]:
        """The strip on a side beside something that reaches a given distance ahead on this path.
        Only piles that come back so far are beside it: the last of them is the widest."""
        starts = [at + pile[0] - self.half for at, pile in piles]
        starts = list(accumulate(reversed(starts), min))[::-1]
        widest = list(accumulate((pile for _, pile in piles), lambda *both: hull(both)))

        def found(side: int, end: float) -> Strip:
            return self.strip(side, widest[max(bisect_left(starts, end), 1) - 1])

        return found

    def along(self, piles: Sequence[Placed]) -> list[tuple[float, float]]:
        """The interval along the path that each layer takes; (inf, -inf) for none. A post is behind
        the carriage's rear stop and behind the part."""
        shape, half = self.shape, self.half
        widths = self.clearance.carriage, MAST
        taken = [(-shape.reach - width / 2 - half, half - shape.arm) for width in widths]
        starts = [at + pile[0] - half for at, pile in piles]
        ends = [at + pile[1] + half for at, pile in piles]
        taken.append((min(starts, default=inf), max(ends, default=-inf)))
        if self.fed:
            rear = shape.laden(self.pile(self.stops[0]))[0]
            post, room = -self.clearance.post(shape.reach, rear), POST / 2 + half
            taken = [(min(low, post - room), max(high, post + room)) for low, high in taken]
            taken[PAYLOADS] = taken[PAYLOADS][0], max(taken[PAYLOADS][1], self.housing[1] + half)
        return taken

    def blocks(self, piles: Sequence[Placed]) -> list[tuple[Block, ...]]:
        """The blocks of each layer: one as wide as the strips on both sides, or none."""
        widest = hull([self.shape.laden(self.shape.last), *(pile for _, pile in piles)])
        sides = (self.strip(side, widest) for side in (-1, +1))
        spans = zip(self.along(piles), *sides, strict=True)
        return [((*span, -low, high),) if span[0] <= span[1] else () for span, low, high in spans]

    def least(self, stop: Stop, station: float) -> float:
        """The least station of a stop after another station [m]: inputs, and payloads that come
        back, must be clear of the housing and the part in it."""
        if not self.fed or stop is self.stops[0] or not (stop.joins or stop.visits > 1):
            return station
        return max(station, up(self.housing[1] + self.clearance.c - self.pile(stop)[0]))

    def placed(
        self,
        stop: Stop,
        station: float,
        further: Mapping[int, float],
        guests: Iterable[tuple[int, Shape]],
    ) -> Placed:
        """The pile at a stop at a station, displaced (`further`) for some of its operations, with
        the hands that reach over it, of robots that deliver from a side."""
        rear, front, low, high = self.shape.laden(self.pile(stop))
        if further:
            rear, front = rear + min(further.values()), front + max(further.values())
        for side, shape in guests:
            ahead = shape.grip[1] if shape.grip else -inf
            low, high = (min(low, -ahead), high) if side > 0 else (low, max(high, ahead))
        return station + ahead_of(stop.first, self.shape.reach), (rear, front, low, high)

    def further(self, stop: Stop, guests: Iterable[tuple[int, Shape]]) -> dict[int, float]:
        """For operations (by number): displacement of the robot beyond the station of a stop [m],
        because it, or a robot that delivers there, holds its payload in another place; empty if
        there is none."""
        shapes = sorted(guests, key=lambda guest: guest[1].tool)
        if not shapes or not (self.shape.shifts or shapes[0][1].shifts):
            return {}
        aside = {o.index: shapes[0][1].shift(o.index)[1] for o in stop.operations}
        return {n: round(far - self.shape.shift(n)[0], 6) for n, far in aside.items()}

    def early(self, stop: Stop, side: int, guest: Shape) -> float:
        """Greatest distance before the end of its guidepath at which a guest from a side delivers
        at a stop [m]: guest and carrier may hold different parts in different places."""
        return max(
            guest.shift(o.index)[0] + side * self.shape.shift(o.index)[1] for o in stop.operations
        )


def footprint(
    factory: Factory, robot: int, shape: Shape, clearance: Clearance, corridor: bool = False
) -> Footprint:
    """The footprint of a robot with a shape of its own."""
    return Footprint(shape, clearance, *stops_of(factory, robot), corridor)


def extent_to(pile: Extent, side: int) -> float:
    """Extent of a pile to one side of the product's middle [m]."""
    return pile[3] if side > 0 else -pile[2]


def ahead_of(operation: Operation, reach: float) -> float:
    """Distance of a carrier's goal ahead of its station [m]; 0 where it meets its inputs."""
    point = operation.template.law.goals[operation.template.carrier - 1]
    exact = {"B": 0.0, "S": 2.0}.get(point.end, point.multiple)
    return (exact - point.multiple) * reach / 2
