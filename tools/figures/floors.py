"""Workspaces: how they are glued, how they are stretched, and the whole way to the floor."""

from __future__ import annotations

from factory.api import Layout
from factory.apps.drawing.canvas import Canvas, Point
from factory.apps.exports import floor_sheet, svg
from factory.apps.exports.floor_plan import Flat, flat_shapes, stations
from tools.figures.nets import LaneNet
from tools.figures.sheet import HEAD, PLAIN, SMALL, Sheet, scoped

FLOOR_STYLE = ".robot { stroke: none; fill: currentColor; } .p { fill: #3e4c59; }\n"


class ColouredFloor(floor_sheet.FloorSheet):
    """The floor plan with each robot in the colour of its gear."""

    def _paint(self, shape: Flat) -> str:
        if shape.style not in ("dot", "tool"):
            return shape.style
        names = [robot.name for robot in self.layout.factory.robots]
        return f"robot gear{names.index(shape.name)}"

    def whole(self) -> tuple[Canvas, tuple[float, ...]]:
        """The drawing with labels, and its bounds."""
        self._shapes()
        self._labels()
        left, right, top, bottom = self.floor
        return self.canvas, (left - 3, right + 3, top - 3, bottom + 3)


def draw_way(layout: Layout) -> str:
    """From the tree through the net to the floor."""
    factory = layout.factory
    net = LaneNet(factory, 176.0)
    sheet = Sheet(net.bottom + 396.0)
    sheet.title((10, 18), "1  The product: a tree")
    tree, at = Canvas(), svg._places(factory.pag)
    tree.elements = _inside(svg.draw_tree(factory.pag))
    wide = max(x for x, _ in at.values()) + svg.BOX / 2 + svg.MARGIN
    with sheet.group("tree"):
        sheet.nested(tree, (0.0, wide, 20.0, 132.0), (26.0, 34.0), 708.0)
    sheet.title((10, 168), "2  The net: a gear for each robot")
    net.draw(sheet)
    top = net.bottom + 22
    sheet.title((10, top), "3  The floor: a guidepath for each robot")
    with sheet.group("plan"):
        floor, box = ColouredFloor(layout).whole()
        sheet.nested(floor, box, (160.0, top + 12), 430.0)
    style = scoped(svg.TREE_STYLE, "tree") + scoped(floor_sheet.STYLE, "plan")
    more = scoped(FLOOR_STYLE, "plan") + ".faint { stroke: currentColor; }\n"
    return sheet.svg("From a tree to a net to a floor", style + more)


def _inside(document: str) -> list[str]:
    """The elements of a document of the drawing library, but for its ground."""
    lines = document.splitlines()
    first = next(n for n, line in enumerate(lines) if 'class="paper"' in line)
    return lines[first + 1 : -1]


def draw_gluing() -> str:
    """Three workspaces, apart and glued by the equivalence of mate."""
    sheet = Sheet(236.0)
    sheet.panel(8, 330, 8, 228)
    sheet.panel(342, 752, 8, 228)
    sheet.title((22, 27), "Three workspaces")
    sheet.title((356, 27), "Glued:  A_{1} = A_{2} = B_{3} − 2r")
    for row, gear in enumerate((4, 5, 2)):
        y, name = 76.0 + 52 * row, row + 1
        _path(sheet, (92, y), (272, y), gear)
        sheet.words((74, y), f"A_{{{name}}}", PLAIN, "", "end")
        sheet.words((290, y), f"B_{{{name}}}", PLAIN, "", "start")
        with sheet.group(f"gear{gear}"):
            sheet.words((36, y), f"r_{{{name}}}", 15.0, "h hue")
    x, y = 540.0, 124.0
    _path(sheet, (x, y), (x - 150, y), 4)
    _path(sheet, (x, y), (x + 150, y), 5)
    _path(sheet, (x, y + 84), (x, y - 58), 2)
    for at, gear in (((x - 58, y), 4), ((x + 58, y), 5), ((x, y - 58), 2)):
        _goal(sheet, at, gear)
    sheet.circle((x, y), 5.0, "token")
    sheet.words((x + 12, y + 82), "A_{3}", PLAIN, "", "start")
    sheet.words((x + 18, y - 60), "B_{3}: goal of r_{3}", SMALL, "", "start")
    sheet.words((x + 10, y + 22), "A_{1} = A_{2}", PLAIN, "", "start")
    sheet.words((x - 58, y - 20), "goal of r_{1}", SMALL)
    sheet.words((x + 74, y - 20), "goal of r_{2}", SMALL)
    sheet.words((x - 58, y + 22), "A_{1} + 2r", SMALL)
    sheet.words((x - 150, y + 22), "B_{1}", PLAIN)
    sheet.words((x + 150, y + 22), "B_{2}", PLAIN)
    with sheet.group("right"):
        sheet.line("arc", (x + 9, y - 50), (x + 9, y - 8))
        for tip, foot in (((x + 9, y - 55), (x + 9, y - 47)), ((x + 9, y - 3), (x + 9, y - 11))):
            sheet.head(tip, foot, HEAD[1], "tip")
        sheet.words((x + 18, y - 28), "2r", SMALL, "hue", "start")
    return sheet.svg("Workspaces, glued by an equivalence")


def _path(sheet: Sheet, a: Point, b: Point, gear: int) -> None:
    with sheet.group(f"gear{gear}"):
        sheet.line("rail", a, b)


def _goal(sheet: Sheet, at: Point, gear: int) -> None:
    with sheet.group(f"gear{gear}"):
        sheet.circle(at, 8.0, "ring")
        sheet.circle(at, 3.0, "disc")


SCALE, UNIT = 600.0, 0.16
"""Pixels to a metre of floor, and the length of an interval that is not stretched [m]."""


def draw_stretching(layout: Layout) -> str:
    """The workspaces as they are glued, of one length; and embedded, each as long as needed."""
    sheet = Sheet(338.0)
    sheet.panel(8, 330, 8, 330)
    sheet.panel(342, 752, 8, 330)
    sheet.title((22, 27), "W, glued by ~:  all of one length")
    sheet.title((356, 27), "f(W):  stretched until it fits")
    half = SCALE * layout.factory.carriage / 2
    _unstretched(sheet, half)
    shapes = [shape for shape in flat_shapes(layout) if shape.style in DRAWN]
    names = [robot.name for robot in layout.factory.robots]

    def on_page(point: Point) -> Point:
        return 610.0 + SCALE * point[0], 156.0 - SCALE * point[1]

    for shape in (s for s in shapes if s.style == "uncoupled"):
        (left, bottom), (right, top) = map(on_page, shape.points)
        sheet.rectangle((left, right, top, bottom), "swept")
    for shape in (s for s in shapes if s.style in ("path", "last")):
        with sheet.group(f"gear{names.index(shape.name)}"):
            points = list(map(on_page, shape.points))
            sheet.line("rail" if shape.style == "path" else "faint", *points)
    for robot, path in enumerate(layout.guidepaths):
        _carriage(sheet, on_page(path.carriage(path.length)), half, robot)
    for at, labels in stations(layout).items():
        x, y = on_page(at)
        sheet.circle((x, y), 4.0, "joint")
        sheet.words((x + 9, y - 9), ", ".join(labels), SMALL, "", "start")
    sheet.line("arc", (706.0, 312.0), (706.0 + SCALE * 0.05, 312.0))
    sheet.words((700.0, 312.0), "50 mm", SMALL, "grey", "end")
    return sheet.svg("Workspaces, glued and stretched", STRETCHED_STYLE)


STRETCHED_STYLE = """
.swept { fill: #e3edf7; } .joint { fill: #ffffff; stroke: #1f2933; stroke-width: 2; }
.cart { fill: currentColor; } .faint { stroke: currentColor; }
.clash { fill: none; stroke: currentColor; stroke-width: 2; }
"""

DRAWN = ("uncoupled", "path", "last")
"""Shapes of a floor plan in the picture of the stretched floor."""


def _unstretched(sheet: Sheet, half: float) -> None:
    """The tree of intervals of the paper's example, each of one length and each guest's A end 2r
    before its carrier's B end; the two carriages that would be in one another are marked."""
    unit, gap, (x, y) = SCALE * UNIT, 2 * half, (192.0, 152.0)
    station, last = (unit - gap) / 2, unit - gap
    rails = (
        ((x + unit - gap, y), (x - gap, y)),
        ((x, y), (x, y - unit)),
        ((x, y), (x, y + unit)),
        ((x, y + station), (x - unit, y + station)),
        ((x, y + last), (x - unit, y + last)),
        ((x, y + last), (x + unit, y + last)),
    )
    for robot, (start, end) in enumerate(rails):
        _path(sheet, start, end, robot)
    for robot, (_, end) in enumerate(rails):
        _carriage(sheet, end, half, robot)
    for row, label in enumerate(("sub3", "sub2", "sub1")):
        at = x, y + row * station
        sheet.circle(at, 4.0, "joint")
        sheet.words((at[0] + 9, at[1] - 9), label, SMALL, "", "start")
    middle = x - unit, y + (station + last) / 2
    reach = half + (last - station) / 2 + 4
    with sheet.group("wrong"):
        box = middle[0] - half - 4, middle[0] + half + 4, middle[1] - reach, middle[1] + reach
        sheet.rectangle(box, "clash", 6.0)
        sheet.words((22, 300), "the carriages of r_{4} and r_{5} overlap:", SMALL, "hue", "start")
        sheet.words((22, 315), "W does not fit the floor yet", SMALL, "hue", "start")


def _carriage(sheet: Sheet, at: Point, half: float, gear: int) -> None:
    """A carriage with its robot's name."""
    with sheet.group(f"gear{gear}"):
        box = at[0] - half, at[0] + half, at[1] - half, at[1] + half
        sheet.rectangle(box, "cart", 4.0)
    sheet.words(at, f"r_{{{gear + 1}}}", PLAIN, "white h")
