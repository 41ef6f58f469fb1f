"""Lines of a cell: a carrier with its guidepath, the station at which arms place onto what it
carries, and tools.

A line is that of the same pile on rails. Its feeder is behind the station of the arms, and its
tools in between. The line of the product goes on ahead of the station, to the outfeed; that of a
sub-assembly ends there, where an arm takes it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

from factory.api import (
    Dimensions,
    Factory,
    Guidepath,
    Hand,
    Layout,
    LayoutMachines,
    Operation,
    Product,
    Region,
)
from factory.apps.arms.body import PEDESTAL, Stand
from factory.apps.arms.scene import StandingBox
from factory.support.arrays import Array
from factory.support.boxes import Box, Point2, hull, moved

LANE = 0.32
"""From the station to either end of a line, without the length of what it carries [m]."""

NEAREST = 0.03
"""Least distance of a carrier behind the product's middle [m]."""

BEHIND, BESIDE = 0.3, 0.07
"""How far the wrist of an arm reaches behind the tip of a tool that lies level, and how far beside
it [m]."""

STEP = 0.02
"""Between the stations that are tried for a tool, and least distance of what stands [m]."""


@dataclass(frozen=True)
class Tool:
    """A tool of a line.

    Attributes:
        robot: the tool (index).
        there: its index on rails.
        ahead: from the station of the arms to where the tool works, less than 0 [m].
    """

    robot: int
    there: int
    ahead: float = 0.0


@dataclass(frozen=True)
class Line:
    """The line of a carrier.

    Attributes:
        factory: of the cell.
        carrier: the robot (index).
        product: of the cell; places are those of its middle.
        rails: the layout of what the carrier brings, on rails.
        tools: those that work on what the carrier brings.
        station: of the arms [m].
        ahead: from there to the end of the line [m].
        steps: by operation (index) of an arm, how much further ahead than at the station the
            carrier stands for it [m]; nothing where it stands there for all.
    """

    factory: Factory
    carrier: int
    product: Product
    rails: Layout
    tools: tuple[Tool, ...]
    station: Point2 = (0.0, 0.0)
    ahead: float = 0.0
    steps: Mapping[int, float] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """What the carrier is called."""
        return "the carrier" if not self.carrier else self.factory.robots[self.carrier].name

    @cached_property
    def off(self) -> Point2:
        """From the product's middle to that of what the carrier brings [m]."""
        x, y = (self.rails.product.middle - self.product.middle)[:2].tolist()
        return float(x), float(y)

    @cached_property
    def extent(self) -> Box:
        """What the carrier brings, about the product's middle [m]."""
        low, high = (end - self.product.middle for end in self._ends)
        return float(low[0]), float(high[0]), float(low[1]), float(high[1])

    @property
    def _ends(self) -> tuple[Array, Array]:
        return self.rails.product.low, self.rails.product.high

    @property
    def length(self) -> float:
        """Of what the carrier brings [m]."""
        return self.extent[1] - self.extent[0]

    @cached_property
    def top(self) -> float:
        """Height of its top, or of that of the carrier's hand [m]."""
        low, high = (float(end[2] - self.product.low[2]) for end in self._ends)
        hand = max(
            (limb.high[2] for limb in LayoutMachines(self.rails).limbs(0)),
            default=Dimensions.PAYLOAD,
        )
        return max(Dimensions.PAYLOAD + high, hand + low)

    @cached_property
    def behind(self) -> float:
        """From the station of the arms to the carrier's feeder [m]."""
        back = (self.station[0] - self.box_of(tool)[0] for tool in self.tools)
        return round(max([LANE, *back]) + self.length, 3)

    def stand(self, operation: Operation | None) -> Point2:
        """Where the product's middle is in an operation of an arm, or else at the station [m]."""
        step = 0.0 if operation is None else self.steps.get(operation.index, 0.0)
        return self.station[0] + step, self.station[1]

    @cached_property
    def path(self) -> Guidepath:
        """The carrier's guidepath."""
        path = self._shifted(self.rails.guidepaths[0])
        a = self.station[0] + self.ahead, self.station[1]
        return replace(path, a=a, travel=round(self.ahead + self.behind, 3))

    def path_of(self, tool: Tool) -> Guidepath:
        """A tool's guidepath."""
        path = self._shifted(self.rails.guidepaths[tool.there])
        return replace(path, a=(self.station[0] + tool.ahead, self.station[1]))

    def _shifted(self, path: Guidepath) -> Guidepath:
        """A guidepath of the rails, about the product's middle in place of that of what the carrier
        brings; the robot has a longer arm where it would be ahead of that middle."""
        (x, y), (u, v), (s, t) = self.off, path.heading, path.side
        along, across = x * u + y * v, x * s + y * t
        return replace(
            path,
            reach=round(max(path.reach - along, NEAREST), 6),
            arm=round(path.arm - along, 6),
            nest=round(path.nest + along, 6),
            offset=round(path.offset + across, 6),
        )

    def hand_of(self, robot: int) -> Hand | None:
        """The hand of the carrier or of a tool (index)."""
        there = next((tool.there for tool in self.tools if tool.robot == robot), 0)
        return self.rails.hands[there]

    def stop(self, operation: Operation) -> float:
        """How far from its feeder the carrier stands in an operation [m]."""
        at = next((t.ahead for t in self.tools if t.robot in operation.robots), 0.0)
        return round(self.behind + at, 6) + self.steps.get(operation.index, 0.0)

    def regions_of(self, tool: Tool) -> Iterator[Region]:
        """The floor that a tool takes."""
        assert self.rails.certificate is not None
        (x, y), (u, v) = self.rails.guidepaths[tool.there].a, self.station
        by = u + tool.ahead + self.off[0] - x, v + self.off[1] - y
        for one in self.rails.certificate.regions:
            if one.robot == tool.there:
                yield replace(one, robot=tool.robot, box=moved(one.box, by))

    def box_of(self, tool: Tool) -> Box:
        """All that a tool takes [m]."""
        return hull([region.box for region in self.regions_of(tool)])

    @property
    def tool_boxes(self) -> list[Box]:
        """All that its tools take [m]."""
        return [*map(self.box_of, self.tools)]

    @cached_property
    def swept(self) -> Box:
        """All that the carrier takes with what it brings [m]."""
        path, half = self.path, self.factory.carriage / 2
        (low, y), (high, _) = path.middle(path.length), path.middle(path.reach)
        xlo, xhi, ylo, yhi = self.extent
        ylo, yhi = min(ylo, path.offset - half), max(yhi, path.offset + half)
        behind = max(-xlo, path.reach + half)
        return min(low, high) - behind, max(low, high) + xhi, y + ylo, y + yhi

    @property
    def regions(self) -> Iterator[Region]:
        """The floor that the carrier and its tools take."""
        yield Region(self.carrier, Region.PAYLOADS, Region.PAYLOAD, self.swept, (0.0, self.top))
        for tool in self.tools:
            yield from self.regions_of(tool)

    @property
    def standing(self) -> Iterator[StandingBox]:
        """All that the carrier and its tools take, as obstacles."""
        yield upright(self.name, self.swept, 0.0, self.top)
        for tool in self.tools:
            high = max(region.z[1] for region in self.regions_of(tool))
            name = self.factory.robots[tool.robot].name
            yield upright(name, self.box_of(tool), 0.0, max(high, self.top))

    @property
    def band(self) -> tuple[float, float]:
        """What the line takes across it, with its tools, from the station [m]."""
        _, _, low, high = hull([self.swept, *self.tool_boxes])
        return low - self.station[1], high - self.station[1]

    def with_tools(self, near: float, room: Sequence[Box]) -> Line:
        """The line with its tools where they are clear of each other, and of what else stands.

        Args:
            near: how near to the pile at the station a tool may come [m].
            room: what else stands [m].
        """
        placed, taken = list[Tool](), [*room]
        for tool in self.tools:
            ahead = self.extent[0] - near - (self.box_of(tool)[1] - self.station[0] - tool.ahead)
            at = replace(tool, ahead=ahead)
            while any(overlap(self.box_of(at), box) for box in taken):
                at = replace(at, ahead=at.ahead - STEP)
            placed.append(replace(at, ahead=round(at.ahead, 3)))
            taken.append(self.box_of(placed[-1]))
        return replace(self, tools=tuple(placed))


def line_of(factory: Factory, carrier: int, product: Product, rails: Layout) -> Line:
    """The line of a carrier (index), not placed yet."""
    tools = list[Tool]()
    for robot in factory.robots:
        operation = factory.operations[robot.operations[0]]
        if carrier != robot.index and operation.carrier == carrier and operation.template.tools():
            there = rails.factory.by_label[operation.label].robots
            tools.append(Tool(robot.index, there[operation.robots.index(robot.index)]))
    return Line(factory, carrier, product, rails, tuple(tools))


def overlap(one: Box, other: Box) -> bool:
    """Whether two boxes overlap."""
    return depth(one, other) > 0.0


def depth(one: Box, other: Box) -> float:
    """How far one of two boxes must move along an axis to be clear of the other; less than 0 where
    they are apart [m]."""
    return min(one[1] - other[0], other[1] - one[0], one[3] - other[2], other[3] - one[2])


def pedestal(stand: Stand) -> Box:
    """The square round a pedestal [m]."""
    x, y, _ = stand.place
    return x - PEDESTAL, x + PEDESTAL, y - PEDESTAL, y + PEDESTAL


def wrist(at: Array, normal: Array) -> Box:
    """What an arm takes behind a tool whose tip is at a place, on a face with a normal that lies
    level [m]."""
    (x, y), (u, v) = at[:2].tolist(), (at + BEHIND * normal[:2]).tolist()
    return min(x, u) - BESIDE, max(x, u) + BESIDE, min(y, v) - BESIDE, max(y, v) + BESIDE


def upright(name: str, box: Box, low: float, high: float) -> StandingBox:
    """What stands on a box of the floor, from one height to another [m]."""
    xlo, xhi, ylo, yhi = map(float, box)
    return StandingBox(name, (xlo, ylo, float(low)), (xhi, yhi, float(high)))
