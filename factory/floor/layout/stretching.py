"""Stretching: choose free lengths and directions of the guidepaths so that nothing collides.

The guidepaths form a tree. A robot's path starts where it receives (B) and runs straight to where
it delivers (A); the paths of its guests end on it, from its left or right. A subtree takes a box in
each layer beside its carrier's path; boxes on one side follow one another; a path is as long as it
takes to keep its own subtree clear of the path it ends on, layer by layer. Bottom-up, linear in the
number of robots.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from factory.floor.layout.dimensions import LAYERS, PAYLOADS, Clearance
from factory.floor.layout.footprint import Footprint, Placed, footprint
from factory.floor.layout.outline import Choice, Guest, Outline, outlined
from factory.floor.layout.shapes import Shape, Sides
from factory.floor.layout.stops import Stop
from factory.support.decimals import up
from factory.theory.plant.factory import Factory


@dataclass(frozen=True)
class Stretched:
    """The result: travel of each robot, station of each operation, side of each robot."""

    travel: list[float]
    stations: list[float]
    sides: Sides


def stretch(
    factory: Factory, shapes: Sequence[Shape], clearance: Clearance, sides: Sides | None = None
) -> Stretched:
    """Lengths and stations for given sides; chooses the sides where none are given: the longer of
    two inputs away from where the robot delivers, a later input on the side where its station comes
    sooner.
    """
    travel = [0.0] * len(factory.robots)
    stations = [0.0] * len(factory.operations)
    chosen: Sides = {} if sides is None else sides
    outlines: dict[int, Outline] = {}
    for robot in reversed(range(len(factory.robots))):
        strip = footprint(factory, robot, shapes[robot], clearance)
        builder = _Builder(strip, outlines, chosen, sides is None)
        for stop in strip.stops:
            station = builder.add(stop)
            further = builder.further(stop)
            for operation in stop.operations:
                stations[operation.index] = station + further.get(operation.index, 0.0)
        guests = builder.attached()
        for guest in guests:
            travel[guest.robot] = guest.travel
        outlines[robot] = outlined(strip, builder.piles, guests, Choice(), boxed=True)
    travel[0] = outgoing(outlines[0], clearance)
    return Stretched(travel, stations, chosen)


def outgoing(outline: Outline, clearance: Clearance) -> float:
    """The travel of the output robot, so that its product is clear of all that is beside it."""
    return up(outline.ahead - min(0.0, outline.shape.last[0]) + clearance.c)


class _Builder:
    """Adds the stops of one robot from its B end forward."""

    def __init__(
        self, footprint: Footprint, outlines: Mapping[int, Outline], sides: Sides, choose: bool
    ) -> None:
        self.own, self.outlines, self.sides, self.choose = footprint, outlines, sides, choose
        self.frontier = {side: list(footprint.frontier) for side in (-1, +1)}
        self.station = 0.0
        self.piles: list[Placed] = []
        self.guests: list[tuple[int, float]] = []

    def add(self, stop: Stop) -> float:
        """Places one stop; the distance of its station from B [m]."""
        guests = stop.guests
        if self.choose:
            self.sides |= self._later(guests) if self.piles else self._mates(guests)
        back = max(0.0, -min(self.further(stop).values(), default=0.0))
        if self.piles:
            free = (self._free(guest, self.sides[guest]) for guest in guests)
            self.station = up(max((self.own.least(stop, self.station) + back, *free)))
        else:
            self.station = up(back)
        for guest in guests:
            frontier, high = self.frontier[self.sides[guest]], self.outlines[guest].high
            for layer in LAYERS:
                frontier[layer] = max(frontier[layer], self.station + high[layer])
            self.guests.append((guest, self.station))
        coming = [(self.sides[guest], self.outlines[guest].shape) for guest in guests]
        self.piles.append(self.own.placed(stop, self.station, self.further(stop), coming))
        return self.station

    def further(self, stop: Stop) -> dict[int, float]:
        """How much further than at its station the robot stands for the operations of a stop."""
        return self.own.further(stop, ((g, self.outlines[g].shape) for g in stop.guests))

    def attached(self) -> list[Guest]:
        """The robots that deliver, each with its travel."""
        strip, guests = self.own.strip_at(self.piles), []
        for robot, station in self.guests:
            outline, side = self.outlines[robot], self.sides[robot]
            travel = outline.clear(strip(side, station + outline.high[PAYLOADS]))
            if not outline.shape.travels:
                travel = 0.0
            guests.append(Guest(robot, outline, side, travel, station=station))
        return guests

    def _free(self, guest: int, side: int) -> float:
        """The least station for a guest on one side."""
        low, frontier = self.outlines[guest].low, self.frontier[side]
        return max(frontier[layer] - low[layer] for layer in LAYERS)

    def _mates(self, guests: Sequence[int]) -> Sides:
        """Of two that meet here, the longer goes away from where this robot delivers."""
        strip, outlines = self.own.strips[-1], self.outlines
        outward = {g: outlines[g].clear(strip) + outlines[g].behind for g in guests}
        ordered = sorted(guests, key=lambda g: (outward[g], g), reverse=True)
        return dict(zip(ordered, (-1, +1), strict=False))

    def _later(self, guests: Sequence[int]) -> Sides:
        """Where it comes sooner; a second one opposite."""
        if not guests:
            return {}
        left, right = (max(self._free(guests[0], side), self.station) for side in (-1, +1))
        side = -1 if left <= right else +1
        return dict(zip(guests, (side, -side), strict=False))
