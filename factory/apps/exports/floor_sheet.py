"""The floor plan as SVG, to scale: one millimetre of floor to a unit, with title, dimensions, scale
bar and legend. The same layout gives the same bytes."""

from __future__ import annotations

from math import dist, floor, sqrt

import numpy as np

from factory.api import Layout, LayoutMachines
from factory.apps.drawing.canvas import LETTER, Box, Canvas, Point, millimetres, page_box
from factory.apps.exports.floor_plan import Flat, flat_shapes, stations

FONT = 17.0
"""Size of a label on the floor [mm]."""

ARROWS = 600.0
"""Approximate distance of the arrows on a guidepath [mm]."""

RIM = 60.0
"""Width of the margin around the floor in which there are no labels [mm]."""

GROUPS = {
    "floor": ("floor", "tile"),
    "sweeps": ("coupled", "uncoupled"),
    "outfeed": ("belt", "product"),
    "feeders": ("boom", "post", "housing"),
    "guidepaths": ("path", "last"),
    "robots": ("finger", "arm", "dot", "tool"),
    "parts": ("part",),
    "junctions": ("junction",),
}
"""The groups of the drawing, from the ground up, and the shapes in each."""

SOLID = frozenset({"post", "dot", "tool", "junction"})
"""Styles of shapes that labels do not cover."""

LEGEND = (
    ("dot", "robot at home"),
    ("tool", "tool"),
    ("path", "guidepath"),
    ("junction", "junction or station"),
    ("post", "feeder with its part"),
    ("belt", "outfeed"),
    ("uncoupled", "swept by a payload in any mode"),
    ("coupled", "in its last operation only"),
)

STYLE = """
.floor { fill: #fbfbfa; stroke: #9aa5b1; stroke-width: 2; }
.grid { stroke: #eceef0; stroke-width: 1.5; fill: none; }
.coupled { fill: #fdecd2; } .uncoupled { fill: #dfeaf5; }
.belt { fill: #d5dade; stroke: #7b8794; stroke-width: 2; }
.chevron { fill: none; stroke: #9aa5b1; stroke-width: 4; stroke-linejoin: round; }
.path { fill: none; stroke: #52606d; stroke-width: 4; }
.last { fill: none; stroke: #52606d; stroke-width: 2; stroke-dasharray: 6 5; }
.tip { fill: #323f4b; }
.part { stroke: #323f4b; stroke-width: 1.5; fill-opacity: 0.5; stroke-linejoin: round; }
.product { fill: #ffffff; fill-opacity: 0.5; stroke: #323f4b; stroke-width: 1.5; }
.post { fill: #e6b422; stroke: #8d6708; stroke-width: 1.5; } .boom { fill: #efcf73; }
.housing { fill: none; stroke: #8d6708; stroke-width: 1.5; }
.dot { fill: #2a5c9a; stroke: #1b3f6b; stroke-width: 2; }
.tool { fill: #d9731a; stroke: #94480a; stroke-width: 2; }
.arm { fill: #9aa5b1; stroke: #52606d; stroke-width: 1; }
.finger { fill: none; stroke: #52606d; stroke-width: 3; stroke-linecap: round; }
.junction { fill: #ffffff; stroke: #b42318; stroke-width: 3.5; }
.j { fill: #b42318; } .p { fill: #3e4c59; } .r { fill: #ffffff; font-weight: bold; }
.j, .p { stroke: #ffffff; stroke-width: 4; paint-order: stroke; stroke-linejoin: round; }
.line { stroke: #52606d; stroke-width: 2; fill: none; }
"""

TILES = ".tile { fill: #eef1f4; stroke: #9aa5b1; stroke-width: 3; }\n"
"""Besides, on a platen."""


def write_svg(layout: Layout) -> str:
    """The floor plan: guidepaths, robots at home, junctions, feeders, outfeed, payload sweeps."""
    return FloorSheet(layout).text()


def draw_floor(layout: Layout, ruler: float) -> tuple[str, Box]:
    """The floor alone, to stand beside others at one scale: without words, with a scale bar of at
    most so many millimetres (`ruler`); and the bounds of its page [mm]."""
    return FloorSheet(layout).plain(ruler)


class FloorSheet:
    """Draws the sheet. The sizes around the floor are multiples of `unit` [mm]; a floor that is
    tall (`upright`) has the legend on its right, any other below. Words are outside of `reach`, the
    floor and all that is drawn beside it."""

    def __init__(self, layout: Layout) -> None:
        self.layout, self.canvas = layout, Canvas()
        self.floor = self.reach = page_box(layout.floor)
        self.wide, self.tall = self.floor[1] - self.floor[0], self.floor[3] - self.floor[2]
        self.unit = max(14.0, sqrt(self.wide * self.tall) / 45, self.wide / 60)
        self.upright = self.tall > 1.5 * self.wide

    def plain(self, ruler: float) -> tuple[str, Box]:
        """The document without words, and its bounds."""
        self._shapes()
        (left, right, top, bottom), size = self.floor, ruler / 12
        self.canvas.scale_bar((left + size, bottom + 1.2 * size), ruler, size)
        page = left - RIM / 2, right + RIM / 2, top - RIM / 2, bottom + 3 * size
        return self.canvas.document(f"{self._name()}: floor", page, self._style()), page

    def _shapes(self) -> None:
        shapes = list(flat_shapes(self.layout))
        for name, styles in GROUPS.items():
            with self.canvas.group(id=name):
                for shape in shapes:
                    if shape.style in styles:
                        self._draw(shape)

    def _style(self) -> str:
        return STYLE + TILES if self.layout.tile else STYLE

    def _paint(self, shape: Flat) -> str:
        """The style in which a shape is drawn."""
        return shape.style

    def text(self) -> str:
        """The document."""
        self._shapes()
        with self.canvas.group(id="labels"):
            self._labels()
        with self.canvas.group(id="sheet"):
            page = self._around()
        scale = min(max(1500 / (page[1] - page[0]), 0.25), 1.5)
        return self.canvas.document(f"{self._name()}: floor plan", page, self._style(), scale)

    def _name(self) -> str:
        pag = self.layout.factory.pag
        name = pag.file.replace("\\", "/").rpartition("/")[2]
        return name.removesuffix(".pag") or pag.root

    # --- the floor -------------------------------------------------------------------------------

    def _draw(self, shape: Flat) -> None:
        """A shape in its style; a part in its colour, with its name as a tooltip."""
        style = self._paint(shape)
        points = [millimetres(point) for point in shape.points]
        xs, ys = zip(*points, strict=True)
        reach = 1e3 * shape.radius
        around = min(xs) - reach, max(xs) + reach, min(ys) - reach, max(ys) + reach
        if shape.style in SOLID:
            self.canvas.block(around)
        more = {"title": shape.name, "fill": shape.paint if shape.style == "part" else None}
        if shape.box:
            self.canvas.rectangle(around, style, 8.0 * (shape.style in ("dot", "tool")))
            if shape.style == "floor":
                self._grid()
            elif shape.style == "belt":
                self._chevrons(around)
        elif shape.radius:
            self.canvas.circle(points[0], reach, style, **more)
        elif len(points) == 2:
            self.canvas.line(style, *points)
            if shape.style == "path":
                self._arrows(points[0], points[1])
        else:
            self.canvas.polygon(points, style, **more)

    def _grid(self) -> None:
        """Lines each tenth of a metre, or half on a large floor; labels keep inside the floor."""
        left, right, top, bottom = self.floor
        step = 100.0 if max(self.wide, self.tall) < 3000 else 500.0
        for x in np.arange(np.ceil(left / step) * step, right, step):
            self.canvas.line("grid", (x, top), (x, bottom))
        for y in np.arange(np.ceil(top / step) * step, bottom, step):
            self.canvas.line("grid", (left, y), (right, y))
        for box in (
            (left - RIM, left, top - RIM, bottom + RIM),
            (right, right + RIM, top - RIM, bottom + RIM),
            (left, right, top - RIM, top),
            (left, right, bottom, bottom + RIM),
        ):
            self.canvas.block(box)

    def _chevrons(self, belt: Box) -> None:
        """Chevrons in the direction of the belt."""
        left, right, top, bottom = belt
        middle, half = (top + bottom) / 2, min((bottom - top) / 4, 40.0)
        steps = max(1, floor((right - left) / (4 * half)))
        for n in range(steps):
            x = left + (n + 0.5) * (right - left) / steps
            wings = (x - half / 2, middle - half), (x - half / 2, middle + half)
            self.canvas.line("chevron", wings[0], (x + half / 2, middle), wings[1])

    def _arrows(self, start: Point, end: Point) -> None:
        """Arrowheads on a guidepath, towards A."""
        length = max(dist(start, end), 1e-9)
        u, v = ((b - a) / length for a, b in zip(start, end, strict=True))
        count = max(1, round(length / ARROWS))
        for n in range(count):
            way = length * (n + 0.5) / count
            x, y = start[0] + u * way, start[1] + v * way
            self.canvas.head((x + 14 * u, y + 14 * v), (x - 7 * u, y - 7 * v), 8.0, "tip")

    def _labels(self) -> None:
        """Robots on their carriages, operations at their junctions, parts at their feeders."""
        layout = self.layout
        for robot, path in zip(layout.factory.robots, layout.guidepaths, strict=True):
            size = min(FONT + 3, 1e3 * layout.factory.carriage / (0.7 * len(robot.name)))
            self.canvas.label(millimetres(path.carriage(path.length)), robot.name, size, "r")
        for at, labels in stations(layout).items():
            for label in labels:
                self.canvas.place(millimetres(at), label, FONT, 8.0, "j")
        for leaf in layout.factory.leaves:
            xlo, xhi, ylo, yhi = LayoutMachines(layout).feeder(leaf.label).post
            middle = millimetres(((xlo + xhi) / 2, (ylo + yhi) / 2))
            self.canvas.place(middle, leaf.label, FONT, 19.0, "p")

    # --- around the floor ------------------------------------------------------------------------

    def _around(self) -> Box:
        """Draw title, figures, dimensions, scale bar and legend; returns the bounds of the page."""
        unit, (left, right, top, bottom) = self.unit, self.reach
        title, figures = self._name(), self._figures()
        longest = max(*(0.8 * len(words) for words in figures), 1.5 * 1.15 * len(title)) * LETTER
        edge = max(right + (17 if self.upright else 1) * unit, left + (longest + 1) * unit)
        self.canvas.text((left, top - 4.7 * unit), title, 1.5 * unit, "h")
        for number, words in enumerate(figures):
            self.canvas.text((left, top - (2.7 - 1.3 * number) * unit), words, 0.8 * unit)
        self._dimensions()
        entries = self._legend()
        below = bottom + (3.2 if self.upright else 5.6) * unit
        if self.upright:
            x = right + 1.5 * unit
            self.canvas.scale_bar((x, bottom - 1.2 * unit), 13 * unit, 0.7 * unit)
            self.canvas.legend(entries, (x, bottom - (2.5 + 1.2 * len(entries)) * unit), x, unit)
        else:
            self.canvas.scale_bar((left, bottom + 3.0 * unit), self.wide / 3, 0.7 * unit)
            below = self.canvas.legend(entries, (left, below), edge, unit)
        return left - 3.2 * unit, edge, top - 7.2 * unit, below

    def _figures(self) -> tuple[str, str]:
        """Two lines below the title."""
        layout = self.layout
        return (
            f"{len(layout.guidepaths)} robots, {len(layout.factory.leaves)} parts, floor"
            f" {layout.area:.2f} m²",
            f"guidepaths {layout.guidepath_length:.2f} m, clearance {layout.clearance * 1e3:g} mm",
        )

    def _legend(self) -> list[tuple[str, str]]:
        """Styles with what they stand for."""
        types = {robot.type for robot in self.layout.factory.robots}
        return [entry for entry in LEGEND if entry[0] != "tool" or "tool" in types]

    def _dimensions(self) -> None:
        """The floor's width below it and its depth to its left."""
        unit, tick, (left, right, top, bottom) = self.unit, 0.25 * self.unit, self.floor
        y, x, size = self.reach[3] + 0.9 * unit, self.reach[0] - 0.9 * unit, 0.7 * unit
        self.canvas.line("line", (left, y), (right, y))
        self.canvas.line("line", (x, top), (x, bottom))
        for end in (left, right):
            self.canvas.line("line", (end, y - tick), (end, y + tick))
        for end in (top, bottom):
            self.canvas.line("line", (x - tick, end), (x + tick, end))
        self.canvas.text(
            ((left + right) / 2, y + size), f"{self.wide / 1e3:.3f} m", size, "", "middle"
        )
        turned = f"translate({x - size:.1f} {(top + bottom) / 2:.1f}) rotate(-90)"
        with self.canvas.group(transform=turned):
            self.canvas.text((0.0, 0.0), f"{self.tall / 1e3:.3f} m", size, "", "middle")
