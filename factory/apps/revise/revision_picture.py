"""A picture of a revision: the floor plan of the new factory, its robots coloured by what stays of
them, with what is gone, and where what moved was."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from math import dist

from factory.api import Layout
from factory.apps.drawing.canvas import Box, millimetres
from factory.apps.exports.floor_plan import Flat, flat_shapes
from factory.apps.exports.floor_sheet import FONT, LEGEND, FloorSheet
from factory.apps.revise.pins import StayingRobot
from factory.support.boxes import Point2

STYLE = """
.path { stroke-width: 5; } .last { stroke-width: 2.5; } .r { fill: #ffffff; }
.stays { stroke: #7b8794; } .changed { stroke: #2a5c9a; }
.moved { stroke: #c05d0c; } .new { stroke: #2f855a; } .dot, .tool { stroke: none; }
.dot.stays, .tool.stays { fill: #7b8794; } .dot.changed, .tool.changed { fill: #2a5c9a; }
.dot.moved, .tool.moved { fill: #d9731a; } .dot.new, .tool.new { fill: #2f855a; }
.was, .gone { fill: none; stroke-width: 2.5; stroke-dasharray: 9 7; stroke-linejoin: round; }
.was { stroke: #c05d0c; } .gone { stroke: #b42318; }
.gone-name { fill: #b42318; font-weight: bold; }
.gone-name { stroke: #ffffff; stroke-width: 4; paint-order: stroke; }
.way { fill: none; stroke: #c05d0c; stroke-width: 6; } .head { fill: #c05d0c; }
"""

GRADES = {
    "stays": "robot that stays as it is",
    "changed": "in place; program, contents, hand or arm change",
    "moved": "stays, in another place or of another length",
    "new": "new",
}
"""What becomes of a robot of the new factory."""

GHOSTS = {"gone": "gone", "was": "where what moved was"}
"""What is drawn of the old factory, in outline."""

MACHINES = frozenset({"path", "last", "dot", "tool"})
FEEDERS = frozenset({"post", "housing", "part"})
"""Styles of the shapes that belong to a robot, and to what it is fed by."""

HEAD = (26.0, 13.0)
"""Length and half width of the head of an arrow [mm]."""


def draw_revision(
    title: str, layouts: tuple[Layout, Layout], kept: tuple[StayingRobot, ...], shift: Point2
) -> str:
    """The document; `layouts`: the old and the new, of which robots are `kept`; `shift`: by how
    much the new lies elsewhere [m]."""
    return _RevisionSheet(title, layouts, kept, shift).text()


class _RevisionSheet(FloorSheet):
    """Draws it. `grades` of new robots by name; `ghosts`: the styles of old robots by number."""

    def __init__(
        self,
        title: str,
        layouts: tuple[Layout, Layout],
        kept: tuple[StayingRobot, ...],
        shift: Point2,
    ) -> None:
        self.old, new = layouts
        super().__init__(new)
        self.title, self.kept, self.shift = title, kept, shift
        names = [robot.name for robot in new.factory.robots]
        self.grades = dict.fromkeys(names, "new") | {
            names[k.new]: "stays" if k.whole else "changed" if k.place else "moved" for k in kept
        }
        self.ghosts = dict.fromkeys(range(len(self.old.guidepaths)), "gone")
        for one in kept:
            if one.place:
                del self.ghosts[one.old]
            else:
                self.ghosts[one.old] = "was"
        self.outlines = [*self._outlines()]
        boxes = [self.floor, *(_around(shape) for shape in self.outlines)]
        left, right, top, bottom = zip(*boxes, strict=True)
        self.reach = min(left), max(right), min(top), max(bottom)

    def _outlines(self) -> Iterator[Flat]:
        """What there was of old robots and their feeders, on the new floor."""
        factory = self.old.factory
        machines = {factory.robots[robot].name: style for robot, style in self.ghosts.items()}
        leaves = {o.label: self.ghosts.get(o.carrier, "") for o in factory.leaves}
        for shape in flat_shapes(self.old):
            of = machines if shape.style in MACHINES else leaves if shape.style in FEEDERS else {}
            if style := of.get(shape.name):
                points = tuple((x + self.shift[0], y + self.shift[1]) for x, y in shape.points)
                yield Flat(style, points, shape.radius, shape.box)

    def _name(self) -> str:
        return self.title

    def _figures(self) -> tuple[str, str]:
        counts = Counter(self.grades.values()) | Counter(self.ghosts.values())
        words = {"stays": "as they were", "changed": "changed", "moved": "moved", "new": "new"}
        robots_of = {**words, "gone": "gone"}.items()
        parts = [f"{counts[grade]} {word}" for grade, word in robots_of if counts[grade]]
        robots = f"{len(self.old.guidepaths)} -> {len(self.layout.guidepaths)} robots"
        floor = f"floor {self.old.area:.2f} -> {self.layout.area:.2f} m²"
        return f"{robots}: {', '.join(parts)}", floor

    def _style(self) -> str:
        return super()._style() + STYLE

    def _paint(self, shape: Flat) -> str:
        grade = self.grades.get(shape.name) if shape.style in MACHINES else None
        return f"{shape.style} {grade}" if grade else shape.style

    def _legend(self) -> list[tuple[str, str]]:
        grades, ghosts = {*self.grades.values()}, {*self.ghosts.values()}
        robots = [(f"dot {grade}", words) for grade, words in GRADES.items() if grade in grades]
        outlines = [(ghost, words) for ghost, words in GHOSTS.items() if ghost in ghosts]
        rest = [entry for entry in LEGEND if entry[0] in ("junction", "post", "belt")]
        return robots + outlines + rest

    def _shapes(self) -> None:
        """The floor plan, what there was in outline, and an arrow along each move."""
        super()._shapes()
        half = 500 * self.layout.factory.carriage
        with self.canvas.group(id="was"):
            for shape in self.outlines:
                self._draw(shape)
            for k in self.kept:
                ends = self._home(self.old, k.old), self._home(self.layout, k.new)
                if not k.place and dist(*ends) > half + HEAD[0]:
                    self.canvas.arrow(*ends, ("way", "head"), HEAD, half)

    def _home(self, layout: Layout, robot: int) -> tuple[float, float]:
        """Where the carriage of a robot is at home, on the page."""
        path = layout.guidepaths[robot]
        x, y = path.carriage(path.length)
        right, up = self.shift if layout is self.old else (0.0, 0.0)
        return millimetres((x + right, y + up))

    def _labels(self) -> None:
        for robot, style in self.ghosts.items():
            if style == "gone":
                at, name = self._home(self.old, robot), self.old.factory.robots[robot].name
                self.canvas.label(at, name, FONT, "gone-name")
        super()._labels()


def _around(shape: Flat) -> Box:
    """The bounds of a shape on the page."""
    xs, ys = zip(*map(millimetres, shape.points), strict=True)
    reach = 1e3 * shape.radius
    return min(xs) - reach, max(xs) + reach, min(ys) - reach, max(ys) + reach
