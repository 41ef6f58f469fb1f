"""The search for a layout, step by step: for searches of one's own that change some of its steps,
and for what is known of a layout before there is one."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from factory.floor.geometry.solids import Product
from factory.floor.layout.branches import branch_of, carriers
from factory.floor.layout.dimensions import TOOL_TRAVEL, Clearance
from factory.floor.layout.drafting import LayoutDraft
from factory.floor.layout.durations import Pace
from factory.floor.layout.guidepath import Guidepath
from factory.floor.layout.hands.choosing import Hands
from factory.floor.layout.layout import Layout
from factory.floor.layout.optimising import arrange, optimised, shape_of
from factory.floor.layout.packing import Task
from factory.floor.layout.shapes import Shape, Sides, headings, payload_boxes
from factory.floor.layout.sides import admissible
from factory.floor.layout.stops import carried
from factory.floor.layout.stretching import Stretched
from factory.floor.layout.visits import Visit, visits_of
from factory.floor.mating.mating import judged
from factory.support.boxes import Box, Point2
from factory.theory.plant.factory import Factory


@dataclass(frozen=True)
class LayoutSearch:
    """The steps of the search for a layout.

    Attributes:
        factory: the factory.
        product: its solids.
        clearance: least distance between machines that share no mode [m].
        pace: of its robots.
        hands: to choose from; None where they are not chosen.
    """

    factory: Factory
    product: Product
    clearance: float = 0.02
    pace: Pace = Pace()  # noqa: RUF009
    hands: Hands | None = None

    @property
    def judged(self) -> Factory:
        """The factory with an approach for every operation that joins inputs."""
        return judged(self.factory, self.product)

    @property
    def size(self) -> Clearance:
        """The distances that the layout keeps."""
        return Clearance(self.clearance, self.factory.carriage)

    @cached_property
    def payloads(self) -> Mapping[str, Box]:
        """The box of every sub-assembly about the product's middle [m], by label."""
        return payload_boxes(self.factory, self.product)

    @cached_property
    def carriers(self) -> Sequence[int]:
        """For each robot the carrier on whose guidepath its own ends; -1 for the output robot."""
        return carriers(self.factory)

    def branch(self, robot: int) -> list[int]:
        """A robot (index) and all robots that bring it something, carriers first."""
        return branch_of(self.carriers, robot)

    def carried(self, robot: int) -> list[int]:
        """The operations of a robot after which it carries something, in its gear's order."""
        return carried(self.factory, robot)

    def best(self, floor: Point2 | None = None, wide: Collection[int] = ()) -> Layout:
        """The best layout found, not certified, of those that fit a floor if there are any; with
        room for two lanes on the guidepaths of some robots (`wide`)."""
        return optimised(self.factory, self.product, self.size, self.pace, floor, wide, self.hands)

    def packed(self, sides: Sides | None = None) -> Stretched:
        """The best travel of each robot, station of each operation and side of each robot; with
        `sides` these alone are looked at."""
        return arrange(self._task, self.payloads, sides)[0]

    def admissible(self, sides: Sides) -> Sides:
        """The sides, with the robots of an operation swapped where its inputs cannot come from
        there."""
        return admissible(self.factory, sides)

    def least_travels(self, sides: Sides) -> list[float]:
        """The least travel of each robot on these sides [m]."""
        return [TOOL_TRAVEL if shape.tool else shape.least for shape in self._shapes_on(sides)]

    def drafted(
        self, travel: Sequence[float], stations: Sequence[float], sides: Sides, least: float = 0.0
    ) -> Layout:
        """The layout, not certified, with travels [m] of robots, stations [m] of operations and
        sides of robots; the output robot's travel is the shortest, but not less than `least`."""
        stretched = Stretched([*travel], [*stations], sides)
        shapes = self._shapes_on(sides)
        draft = self.factory, self.product, self.size, self.payloads, shapes, stretched
        return LayoutDraft(*draft).layout(least)

    def visits(
        self, guidepaths: Sequence[Guidepath], stations: Sequence[float]
    ) -> dict[tuple[int, int], Visit]:
        """The visits of robots on guidepaths, by operation and robot (index), with operations at
        stations, distances from the B ends of their carriers [m]."""
        return visits_of(self.factory, guidepaths, stations)

    @cached_property
    def _task(self) -> Task:
        alike = [1.0] * len(self.factory.robots)
        return Task(self.factory, self.size, self.pace, alike, hands=self.hands)

    @cached_property
    def _shapes(self) -> dict[tuple[tuple[int, int], ...], list[Shape]]:
        return {}

    def _shapes_on(self, sides: Sides) -> list[Shape]:
        key = (*sorted(sides.items()),)
        if key not in self._shapes:
            lying = enumerate(zip(self.carriers, headings(self.factory, sides), strict=True))
            self._shapes[key] = [
                shape_of(self._task, self.payloads, robot, on, frame)
                for robot, (on, frame) in lying
            ]
        return self._shapes[key]
