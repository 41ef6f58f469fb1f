"""Free spaces of two robots on guidepaths, with the flow of F."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import combinations, product

import numpy as np

from factory.api import Limits, Mode
from factory.apps.drawing.canvas import Point, number
from factory.support.arrays import Array
from factory.theory.control.navigation import Bundle
from tests.navigation_functions import potential
from tools.figures.sheet import HEAD, PLAIN, SMALL, Sheet

LENGTH, EPS, DT = 0.4, 0.004, 0.004
"""Length of the guidepaths [m], radius of the goal ball [m], and a step of a flow line [s]."""

SPEEDS = Limits(np.array([5.0, 5.0]), np.array([1.0, 1.0]))
"""Of both robots. No speed is limited but by the field, as for the points of the paper."""

LEVELS, GRID = (0.02, 0.05, 0.1, 0.15, 0.2, 0.25), 65
"""Values of φ whose level lines are drawn, and the number of grid lines to find them with."""

SIDE = 262.0
"""Of a free space on the page [pixels]."""


def mate() -> Mode:
    """Two robots that bring parts to one point: Δ is a triangle about it."""
    return Mode(
        goals=np.array([0.1, 0.1]),
        lower=np.array([0.0, 0.0]),
        upper=np.array([LENGTH, LENGTH]),
        eps=EPS,
        pairs=np.array([[0, 1]]),
        meet=np.array([[0.0, 0.0]]),
        touch=np.array([0.12]),
    )


def insert() -> Mode:
    """The second robot waits at a standoff until the first, the carrier, is at its goal."""
    return Mode(
        goals=np.array([0.1, 0.08]),
        lower=np.array([0.0, 0.0]),
        upper=np.array([LENGTH, LENGTH]),
        eps=EPS,
        gate=np.array([-1, 0]),
        standoff=np.array([0.0, 0.16]),
    )


def flow(mode: Mode, start: Point) -> Array:
    """A flow line of F from a configuration to the goal (n, 2) [m]."""
    bundle = Bundle.of([mode], [SPEEDS])
    x = np.array(start)
    line = [x]
    while not bundle.at_goal(x)[0] and len(line) < 4000:
        x = x + DT * bundle.field(x, DT)
        line.append(x)
    return np.array(line)


class Space:
    """A free space of two robots on the page, its corner (0, 0) at a point below on the left."""

    def __init__(self, sheet: Sheet, mode: Mode, corner: Point) -> None:
        self.sheet, self.mode, self.corner = sheet, mode, corner

    def at(self, x: Iterable[float]) -> Point:
        """A configuration on the page."""
        first, second = x
        scale = SIDE / LENGTH
        return self.corner[0] + scale * first, self.corner[1] - scale * second

    def draw(self, starts: Iterable[Point], names: tuple[str, str]) -> None:
        """Axes, what is not free, flow lines, and the goal."""
        (left, bottom), (right, top) = self.at((0, 0)), self.at((LENGTH, LENGTH))
        self.sheet.rectangle((left, right, top, bottom), "free")
        self.levels()
        for corners in self._taken():
            self.sheet.polygon([self.at(corner) for corner in corners], "taken")
        for start in starts:
            self._line(flow(self.mode, start))
        ends = ((left, bottom), (right + 14, bottom)), ((left, bottom), (left, top - 14))
        for foot, tip in ends:
            self.sheet.link(foot, tip, "axis")
        self.sheet.words((right + 12, bottom + 16), names[0], PLAIN)
        self.sheet.words((left - 16, top - 8), names[1], PLAIN)
        goal = self.at(self.mode.goals)
        with self.sheet.group("right"):
            self.sheet.circle(goal, 8.0, "ring")
            self.sheet.circle(goal, 3.2, "disc")

    def _taken(self) -> Iterable[list[Point]]:
        """Polygons of configurations outside of the free space."""
        for touch in self.mode.touch:
            yield [(0, 0), (touch, 0), (0, touch)]
        if self.mode.gate[1] == 0:
            low = float(self.mode.goals[1] + self.mode.standoff[1])
            goal, eps = float(self.mode.goals[0]), self.mode.eps
            yield [(0, 0), (goal - eps, 0), (goal - eps, low), (0, low)]
            yield [(goal + eps, 0), (LENGTH, 0), (LENGTH, low), (goal + eps, low)]

    def levels(self) -> None:
        """Draw the lines on which φ has the values of LEVELS, triangle by triangle of a grid."""
        bundle, steps = Bundle.of([self.mode], [SPEEDS]), np.linspace(0.0, LENGTH, GRID)
        grid = np.array([[np.array([u, v]) for v in steps] for u in steps])
        phi = np.apply_along_axis(lambda x: potential(bundle, x)[0], 2, grid)
        phi[~np.apply_along_axis(lambda x: bundle.in_domain(x)[0], 2, grid)] = np.nan
        for value in LEVELS:
            way = ""
            for i, j, side in product(range(GRID - 1), range(GRID - 1), ((1, 0), (0, 1))):
                corners = (i, j), (i + side[0], j + side[1]), (i + 1, j + 1)
                ends = [
                    self.at(steps[list(low)] + share * (steps[list(high)] - steps[list(low)]))
                    for low, high in combinations(corners, 2)
                    if 0.0 <= (share := _share(phi[low], phi[high], value)) < 1.0
                ]
                if len(ends) == 2:
                    (x0, y0), (x1, y1) = ends
                    way += f"M{number(x0)} {number(y0)}L{number(x1)} {number(y1)}"
            self.sheet.add("path", "level", d=way)

    def _line(self, line: Array) -> None:
        """A flow line, thinned, with a head where it has gone a third of its way."""
        points = [self.at(x) for x in line]
        kept = [points[0]]
        for point in points:
            if abs(point[0] - kept[-1][0]) + abs(point[1] - kept[-1][1]) > 3.0:
                kept.append(point)
        with self.sheet.group("stream"):
            self.sheet.line("arc", *kept)
            third = max(1, len(kept) // 3)
            if len(kept) > third:
                tip, foot = kept[third], kept[third - 1]
                length = float(np.hypot(tip[0] - foot[0], tip[1] - foot[1]))
                back = HEAD[0] / max(length, 1e-9)
                base = tip[0] - back * (tip[0] - foot[0]), tip[1] - back * (tip[1] - foot[1])
                self.sheet.head(tip, base, HEAD[1], "tip")


def _share(low: float, high: float, value: float) -> float:
    """Where between two ends a value is reached, -1 for nowhere or where an end has none."""
    return (value - low) / (high - low) if min(low, high) < value <= max(low, high) else -1.0


STYLE = """
.free { fill: #ffffff; stroke: #dfe3e8; }
.taken { fill: #f6d9d5; stroke: #b42318; stroke-width: 1; }
.level { fill: none; stroke: #b9c4d0; stroke-width: 1; }
.axis { color: #52606d; } .stream { color: #2a6fa8; } .stream .arc { stroke-width: 1.5; }
"""


def draw_spaces() -> str:
    """The free space of a mate, and that of an insertion, which is L-shaped."""
    sheet = Sheet(376.0)
    sheet.panel(8, 374, 8, 368)
    sheet.panel(386, 752, 8, 368)
    sheet.title((22, 27), "mate:  W − Δ")
    sheet.title((400, 27), "with a gate:  W is L-shaped")
    edge = [0.0, 0.08, 0.16, 0.24, 0.32, 0.4]
    starts = [(0.4, y) for y in edge] + [(x, 0.4) for x in edge[:-1]] + [(0.2, 0.0), (0.0, 0.2)]
    Space(sheet, mate(), (62.0, 328.0)).draw(starts, ("x_{1}", "x_{2}"))
    starts = [(0.4, y) for y in (0.26, 0.33, 0.4)] + [(x, 0.4) for x in (0.3, 0.2, 0.1, 0.0)]
    starts += [(0.0, 0.28)]
    Space(sheet, insert(), (440.0, 328.0)).draw(starts, ("x_{c}", "x_{g}"))
    sheet.words((90.0, 306.0), "Δ", 15.0, "h")
    sheet.words((606.0, 262.0), "not in W: g may not be", SMALL)
    sheet.words((606.0, 278.0), "nearer while c is away", SMALL)
    sheet.words((191.0, 356.0), "two robots touch where x_{1} + x_{2} ≤ t", SMALL, "grey")
    sheet.words((569.0, 356.0), "the carrier c first, then the guest g", SMALL, "grey")
    return sheet.svg("Free spaces with the flow of F", STYLE)
