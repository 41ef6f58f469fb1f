"""From lengths to a layout: all guidepaths placed on the floor, and the outfeed before the output
robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import floor, inf

from factory.floor.geometry.solids import Product
from factory.floor.geometry.turning import fed_of
from factory.floor.layout.branches import carriers, delivery
from factory.floor.layout.certificate import (
    ARM_BODY,
    CARRIAGE_BODY,
    MAST_BODY,
    OUTFEED,
    SHED,
    Region,
)
from factory.floor.layout.dimensions import BEHIND, SIDE, WALL, Clearance
from factory.floor.layout.guidepath import Guidepath
from factory.floor.layout.hands.hand import Point3
from factory.floor.layout.layout import Layout
from factory.floor.layout.shapes import Shape, headings
from factory.floor.layout.stretching import Stretched
from factory.floor.layout.sweeps import regions
from factory.floor.layout.visits import visits_of
from factory.support.boxes import Box
from factory.support.decimals import up
from factory.theory.plant.factory import Factory


@dataclass(frozen=True, slots=True)
class LayoutDraft:
    """The data needed to place the robots of a factory on a floor."""

    factory: Factory
    product: Product
    clearance: Clearance
    payloads: Mapping[str, Box]
    shapes: Sequence[Shape]
    stretched: Stretched

    def layout(self, least: float = 0.0) -> Layout:
        """The layout of these lengths, with the output robot's path as short as possible, but of at
        `least` a given travel [m]; its floor is not computed yet."""
        travel = list(self.stretched.travel)
        lanes = (-1, +1) if any(shape.spread for shape in self.shapes) else (0,)
        spare = min(_spare(self._layout(travel, lane)) for lane in lanes)
        travel[0] = max(least, round(travel[0] - spare, 3))
        return self._layout(travel)

    def _layout(self, travel: Sequence[float], lane: int = 0) -> Layout:
        """The layout with each robot that has room for two lanes in their middle, or in one of
        them."""
        guidepaths = self._guidepaths(travel, lane)
        return Layout(
            self.factory,
            self.product,
            self.clearance.c,
            guidepaths,
            visits_of(self.factory, guidepaths, self.stretched.stations, self._shifts()),
            self.payloads,
            _outfeed(guidepaths[0], self.shapes[0], self.clearance),
            tuple(s.hand for s in self.shapes) if any(s.hand for s in self.shapes) else (),
        )

    def _shifts(self) -> tuple[tuple[Point3, ...], ...]:
        """For each robot the shifts of its tours; empty if no robot has any."""
        tours = self.factory.tours
        if not any(shape.shifts for shape in self.shapes):
            return ()
        return tuple(
            tuple(shape.shift(tour[-1]) for tour in tours[robot])
            for robot, shape in enumerate(self.shapes)
        )

    def _guidepaths(self, travel: Sequence[float], lane: int) -> tuple[Guidepath, ...]:
        """All guidepaths, carriers first: A is a station of the carrier."""
        paths: list[Guidepath] = []
        frames = headings(self.factory, self.stretched.sides)
        for robot, carrier in enumerate(carriers(self.factory)):
            (u, t), shape, a = frames[robot], self.shapes[robot], (0.0, 0.0)
            if carrier >= 0 and (end := delivery(self.factory, robot)) is not None:
                number = end.index
                on, further = paths[carrier], shape.shift(number)[1]
                further -= self.shapes[carrier].shift(number)[0]
                a = on.middle(on.length - self.stretched.stations[number] + further)
            a = (round(a[0], 3), round(a[1], 3))
            offset = round(shape.offset + lane * shape.spread, 3)
            turn = self._turn(robot)
            way = travel[robot] if turn is None else abs(turn)
            sizes = way, shape.reach, offset, shape.arm, shape.nest
            paths.append(Guidepath(u, t, a, *sizes, turn=turn))
        return tuple(paths)

    def _turn(self, robot: int) -> float | None:
        """The angle by which a fixed robot turns its payload into place [rad]."""
        if self.factory.robots[robot].travels:
            return None
        label, *_ = self.factory.deliveries(robot)  # the same for each unit of a period
        return -fed_of(self.product, self.factory.contents[label]) + 0.0


def _outfeed(path: Guidepath, shape: Shape, c: Clearance) -> Box:
    """The conveyor: under the product at A and ahead to the end of the shed, no wider than the
    product, so that what keeps clear of the product keeps clear of it."""
    last, grip = shape.last, shape.grip or shape.last
    ahead = 2 * last[1] - last[0] + up(max(0.0, grip[1] - last[1])) + c.c + WALL + BEHIND + SIDE
    return path.world((last[0] - c.c / 2, ahead, last[2], last[3]), path.a)


def _spare(layout: Layout) -> float:
    """Length by which the output robot's path can be shortened: the outfeed has to be clear of
    everything beside its course and of the product in the making [whole mm]."""
    c, spare = layout.clearance, inf
    swept = [
        region
        for region in regions(layout)
        if region.kind not in (OUTFEED, SHED)
        and (region.robot != 0 or not region.is_coupled)
        and not _runs_under(region)
    ]
    for start, _, low, high in (layout.outfeed, layout.shed):
        beside = (r.box[1] for r in swept if r.box[2] < high + c and r.box[3] > low - c)
        spare = min(spare, start - c - max(beside, default=-inf))
    return min(floor(spare * 1000 + 1e-6) / 1000, layout.guidepaths[0].travel - up(c))


def _runs_under(region: Region) -> bool:
    """Whether a region belongs to the output robot, which comes as far as A."""
    return region.robot == 0 and region.kind in (CARRIAGE_BODY, MAST_BODY, ARM_BODY)
