"""Tools beside the carrier's line of a cell: where they work on what the carrier brings.

A tool stands as on rails. Its station is behind that of the arms, towards the carrier's feeder,
where it is clear of what the arms bring, of their feeders, and of other tools.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from factory.api import Factory, Guidepath, Layout, Operation
from factory.floor.layout.certificate import Region
from factory.floor.layout.guidepath import Box, hull, moved
from factory.floor.layout.hands.hand import Hand

STEP = 0.02
"""Between the stations that are tried [m]."""


@dataclass(frozen=True)
class Tool:
    """A tool at its station.

    Attributes:
        robot: the tool (index).
        station: where the product's middle is on the line (x) [m].
        rails: the layout of the same product on rails.
        there: the tool on rails (index).
    """

    robot: int
    station: float
    rails: Layout
    there: int

    @property
    def path(self) -> Guidepath:
        """Its guidepath."""
        path = self.rails.guidepaths[self.there]
        return replace(path, a=(self.station, path.a[1]))

    @property
    def hand(self) -> Hand | None:
        """Its hand, if it has one."""
        return self.rails.hands[self.there]

    @property
    def regions(self) -> Iterator[Region]:
        """The floor that it takes."""
        assert self.rails.certificate is not None
        by = self.station - self.rails.guidepaths[self.there].a[0], 0.0
        for one in self.rails.certificate.regions:
            if one.robot == self.there:
                yield replace(one, robot=self.robot, box=moved(one.box, by))

    @property
    def box(self) -> Box:
        """All that it takes [m]."""
        return hull([region.box for region in self.regions])

    @property
    def high(self) -> float:
        """Height of its top [m]."""
        return max(region.z[1] for region in self.regions)


def tools_of(
    factory: Factory, rails: Layout, station: float, near: float, room: Sequence[Box]
) -> dict[int, Tool]:
    """The tools of a cell by index, each where it is clear.

    Args:
        factory: of the cell.
        rails: the layout of the same product on rails.
        station: of the arms (x) [m].
        near: how far from it no tool comes, on either side [m].
        room: what else stands [m].
    """
    tools, taken = dict[int, Tool](), [*room]
    for robot in factory.robots[1:]:
        if robot.body.first.moves:
            continue
        operation = factory.operations[robot.operations[0]]
        there = rails.factory.by_label[operation.label].robots[operation.robots.index(robot.index)]
        tool = Tool(robot.index, station, rails, there)
        tool = replace(tool, station=station - (near + tool.box[1] - station))
        while any(_overlap(tool.box, box) for box in taken):
            tool = replace(tool, station=tool.station - STEP)
        tools[robot.index] = replace(tool, station=round(tool.station, 3))
        taken.append(tool.box)
    return tools


def _overlap(one: Box, other: Box) -> bool:
    across = one[0] < other[1] and other[0] < one[1]
    return across and one[2] < other[3] and other[2] < one[3]


def works_at(tools: dict[int, Tool], operation: Operation) -> float | None:
    """The station of an operation, if a tool does it (x) [m]."""
    return next((tools[r].station for r in operation.robots if r in tools), None)
