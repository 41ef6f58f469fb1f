"""Figures of the pages beyond the paper: a corner, the cells of a tee, and counts after an undo."""

from __future__ import annotations

from collections.abc import Mapping
from math import pi

import numpy as np

from factory.api import Factory, MarkedNet
from factory.apps.drawing.canvas import Point
from factory.apps.recovery.undo import undo
from factory.floor.layout.way import Bend, Ways
from factory.support.arrays import Array
from tools.figures.sheet import PLAIN, SMALL, Sheet, around

TURN, BEFORE, AFTER = 0.12, 0.26, 0.2
"""δ of the drawn corner, and how much of the way is shown before and after it [m]."""


def draw_corner() -> str:
    """A rounded corner, and what a robot's two accelerations are that goes through it."""
    sheet = Sheet(290.0)
    sheet.panel(8, 420, 8, 282)
    sheet.panel(432, 752, 8, 282)
    sheet.title((22, 27), "The way leaves the polyline by δ/4 at most")
    sheet.title((446, 27), "Second derivatives of g")
    corner, scale = 0.3, 620.0
    ways = Ways.of([[Bend(corner, 5.0)]], [TURN])

    def on_page(point: Point) -> Point:
        return 96.0 + scale * (point[0] - corner + BEFORE), 248.0 - scale * point[1]

    x = np.linspace(corner - BEFORE, corner + AFTER + TURN, 93)
    places, _, second = ways.at(np.zeros(len(x), int), x)
    edge = on_page((corner, 0.0))
    start, end = on_page((corner - TURN, 0.0)), on_page((corner, TURN))
    sheet.line("faint", on_page((corner - BEFORE, 0.0)), edge, on_page((corner, AFTER + TURN)))
    with sheet.group("gear0"):
        sheet.line("rail", *map(on_page, places))
    for at, words, anchor, shift in (
        (start, "c − δ", "middle", (0, 22)),
        (end, "c + δ", "start", (14, 0)),
        (edge, "c", "start", (10, 14)),
    ):
        sheet.circle(at, 4.0, "token")
        sheet.words((at[0] + shift[0], at[1] + shift[1]), words, PLAIN, "", anchor)
    middle = on_page(ways.at(np.zeros(1, int), np.array([corner]))[0][0])
    with sheet.group("wrong"):
        sheet.line("arc", edge, middle)
    sheet.words((middle[0] - 60, middle[1] - 14), "(b − a) δ/4", SMALL, "wrong hue", "end")
    sheet.line("faint", (middle[0] - 56, middle[1] - 14), (middle[0] + 6, middle[1] + 8))
    sheet.words((120.0, 268.0), "direction a", SMALL, "grey")
    sheet.words((edge[0] + 14, 66.0), "direction b", SMALL, "grey", "start")
    _accelerations(sheet, x - corner, second)
    return sheet.svg("A corner of a way", ".wrong.hue { fill: #b42318; }\n")


def _accelerations(sheet: Sheet, x: Array, second: Array) -> None:
    left, middle, wide = 482.0, 160.0, 236.0
    low, high = float(x[0]), float(x[-1])
    sheet.link((left, middle), (left + wide + 14, middle), "grey")
    sheet.words((left + wide + 8, middle + 16), "x", PLAIN)
    for axis, gear in ((0, 0), (1, 1)):
        points: list[Point] = []
        values = np.round(second[:, axis] * 2 * TURN)
        for here, value in zip(x, values, strict=True):
            at = left + wide * (float(here) - low) / (high - low), middle - 62.0 * float(value)
            if points and points[-1][1] != at[1]:
                points.append((at[0], points[-1][1]))
            points.append(at)
        with sheet.group(f"gear{gear}"):
            sheet.line("arc", *points)
    sheet.words((left + 10, middle - 80), "1/2δ along b", SMALL, "", "start")
    sheet.words((left + 10, middle + 80), "−1/2δ along a", SMALL, "", "start")
    sheet.words((592.0, 262.0), "at speed v: v²/2δ on each axis", SMALL, "grey")


def draw_tee() -> str:
    """The twelve cells of two robots on a tee: six squares in a ring, and six fins."""
    sheet = Sheet(420.0)
    centre, radius = (380.0, 210.0), 138.0
    squares = [(0, 1), (0, 2), (1, 2), (1, 0), (2, 0), (2, 1)]
    for number, cell in enumerate(squares):
        angle = -pi / 2 + number * pi / 3
        after = squares[(number + 1) % 6]
        half = angle + pi / 6
        still = next(robot for robot in (0, 1) if cell[robot] == after[robot])
        sheet.line("ringed", around(centre, radius, angle), around(centre, radius, angle + pi / 3))
        joint = around(centre, radius * 0.87, half)
        fin = around(centre, radius * 1.36, half)
        sheet.line("ringed", joint, fin)
        _cell(sheet, fin, {still: [(cell[still], 23.0)], 1 - still: [(cell[still], 8.0)]}, 20.0)
    for number, cell in enumerate(squares):
        at = around(centre, radius, -pi / 2 + number * pi / 3)
        _cell(sheet, at, {robot: [(edge, 17.0)] for robot, edge in enumerate(cell)}, 26.0)
    sheet.words((380.0, 196.0), "in the middle is missing", SMALL, "grey")
    sheet.words((380.0, 212.0), "what is in Δ:", SMALL, "grey")
    sheet.words((380.0, 228.0), "both at V", SMALL, "grey")
    for x, anchor, words in (
        (14.0, "start", ("Six squares, a ring:", "the robots are on", "different edges")),
        (746.0, "end", ("Six fins, dead ends:", "both robots are", "on one edge")),
    ):
        for row, line in enumerate(words):
            sheet.words((x, 28.0 + 18 * row), line, PLAIN, "h" if not row else "", anchor)
    return sheet.svg("The cells of two robots on a tee", TEE_STYLE)


TEE_STYLE = """
.ringed { fill: none; stroke: #9aa5b1; stroke-width: 2; }
.cell { fill: #ffffff; stroke: #52606d; stroke-width: 1.4; }
.edge { fill: none; stroke: #7b8794; stroke-width: 2.4; stroke-linecap: round; }
"""

ARMS = ((0.0, 1.0), (-0.87, -0.5), (0.87, -0.5))
"""The directions of the stem and the arms of a small tee."""


def _cell(
    sheet: Sheet, at: Point, robots: Mapping[int, list[tuple[int, float]]], half: float
) -> None:
    """A small tee with the robots on its edges (edge, depth)."""
    sheet.circle(at, half + 9, "cell")
    for u, v in ARMS:
        sheet.line("edge", at, (at[0] + half * u, at[1] + half * v))
    for robot, places in sorted(robots.items()):
        for edge, depth in places:
            u, v = ARMS[edge]
            sheet.robot((at[0] + depth * u, at[1] + depth * v), robot, 7.3)


def draw_counts(factory: Factory) -> str:
    """How often each transition has fired, before and after one is undone."""
    net = MarkedNet.of(factory.net)
    counts, tokens = [0] * len(net.net.transitions), list(net.tokens)
    number = {t.name: event for event, t in enumerate(net.net.transitions)}
    while counts[number[UNTIL]] < TIMES:
        for event in list(net.enabled(tokens)):
            counts[event] += 1
            net.fire(tokens, event)
    after = undo(factory.net, counts, [number[ASKED]], factory.joins)
    return _bars(factory, counts, list(after))


UNTIL, TIMES, ASKED = "sub3_s", 2, "sub2_e"
"""All that is enabled fires at once, until a transition has fired so often; then one is undone."""


def _bars(factory: Factory, before: list[int], after: list[int]) -> str:
    unit = 40.0
    base = 44.0 + unit * max(before)
    sheet = Sheet(base + 56.0)
    sheet.title(
        (14, 20), f"n, and the greatest n′ without the last {ASKED.replace('_e', '')}_{{e}}"
    )
    order = [
        e for o in factory.order for e in (factory.operations[o].start, factory.operations[o].end)
    ]
    names = [t.name for t in factory.net.threaded.transitions]
    for level in range(1, max(before) + 1):
        y = base - unit * level
        sheet.line("faint", (40.0, y), (750.0, y))
        sheet.words((28.0, y), str(level), SMALL, "grey")
    for column, event in enumerate(order):
        x = 48.0 + 50.6 * column
        for count in range(before[event]):
            kept = count < after[event]
            box = x, x + 34, base - unit * (count + 1) + 3, base - unit * count
            sheet.rectangle(box, "kept" if kept else "undone", 3.0)
        name, _, sign = names[event].rpartition("_")
        sheet.words((x + 17, base + 16), f"{name}_{{{sign}}}", SMALL)
    sheet.line("base", (40.0, base), (750.0, base))
    sheet.rectangle((48, 62, base + 32, base + 46), "kept", 2.0)
    sheet.words((68, base + 39), "fired, and still counts (n′)", SMALL, "", "start")
    sheet.rectangle((300, 314, base + 32, base + 46), "undone", 2.0)
    sheet.words((320, base + 39), "undone: to be fired again", SMALL, "", "start")
    return sheet.svg("Counts before and after an undo", COUNT_STYLE)


COUNT_STYLE = """
.kept { fill: #2a6fa8; } .base { fill: none; stroke: #1f2933; stroke-width: 1.4; }
.undone { fill: #f6d9d5; stroke: #b42318; stroke-width: 1.4; stroke-dasharray: 3 2; }
"""
