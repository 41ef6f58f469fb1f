"""The sheet that all figures are drawn on: one page width, one palette, one lettering."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import pairwise
from math import cos, hypot, pi, sin

from factory.apps.drawing.canvas import Canvas, Point, clean, number
from factory.apps.exports.swimlanes import COLOURS, SHARED

WIDTH = 760.0
"""Of a figure, as of the text column of a page [pixels]."""

SMALL, PLAIN, LARGE = 11.0, 12.5, 15.0
"""Sizes of lettering [pixels]."""

RADIUS, HEAD = 12.0, (8.0, 3.8)
"""Radius of a place; length and half width of an arrowhead."""

STYLE = f"""
.arc, .thread, .rail {{ fill: none; stroke: currentColor; stroke-width: 1.7; }}
.thread {{ stroke-width: 2.2; stroke-linecap: round; }}
.rail {{ stroke-width: 5; stroke-linecap: round; }}
.tip, .disc, .hue {{ fill: currentColor; }} .bar {{ fill: #323f4b; }}
.ring {{ fill: #ffffff; stroke: currentColor; stroke-width: 1.9; }}
.op {{ fill: #fdecd2; stroke: {SHARED}; stroke-width: 2.2; }}
.slot {{ fill: #ffffff; stroke: #9aa5b1; stroke-width: 1.2; }}
.token {{ fill: #1f2933; }} .white {{ fill: #ffffff; stroke: none; }}
.panel {{ fill: #f7f8fa; stroke: #dfe3e8; stroke-width: 1; }}
.faint {{ fill: none; stroke: #9aa5b1; stroke-width: 1.2; stroke-dasharray: 4 4; }}
.halo {{ fill: none; stroke: #b42318; stroke-width: 9; stroke-opacity: 0.16;
  stroke-linecap: round; stroke-linejoin: round; }}
.shared {{ color: {SHARED}; }} .wrong {{ color: #b42318; }} .right {{ color: #1f6f6b; }}
""" + "".join(f".gear{n} {{ color: {paint}; }}\n" for n, paint in enumerate(COLOURS))

SUBSCRIPT = re.compile(r"_\{([^}]*)\}")
"""`x_{i}`: an index below."""


class Sheet(Canvas):
    """A figure of the common width, and of a height [pixels]."""

    def __init__(self, height: float) -> None:
        super().__init__()
        self.height = height

    def svg(self, title: str, style: str = "") -> str:
        """The figure as a file."""
        return self.document(title, (0.0, WIDTH, 0.0, self.height), STYLE + style)

    # --- words -----------------------------------------------------------------------------------

    def words(
        self, at: Point, text: str, size: float = PLAIN, style: str = "", anchor: str = "middle"
    ) -> None:
        """A line of text, with indices below, whose middle height is at a point."""
        spans, last, drop = "", 0, 0.28 * size
        for found in SUBSCRIPT.finditer(text):
            spans += clean(text[last : found.start()])
            index, small = clean(found[1]), number(0.72 * size)
            spans += f'<tspan dy="{number(drop)}" font-size="{small}">{index}</tspan>'
            spans += f'<tspan dy="{number(-drop)}">\u200b</tspan>'
            last = found.end()
        spans += clean(text[last:])
        place = f'x="{number(at[0])}" y="{number(at[1] + 0.35 * size)}"'
        look = f'font-size="{number(size)}" text-anchor="{anchor}" class="{style}"'
        self.elements.append(f"<text {place} {look}>{spans}</text>")

    def title(self, at: Point, text: str) -> None:
        """The heading of a panel."""
        self.words(at, text, PLAIN, "h", "start")

    # --- nodes of nets ---------------------------------------------------------------------------

    def node(self, at: Point, style: str, *, shared: bool = False, tokens: int = 0) -> None:
        """A place, shared by gears or of one, with a token or without."""
        with self.group(style):
            self.circle(at, RADIUS, "op" if shared else "ring")
            if tokens:
                self.circle(at, 4.8, "token")

    def bar(self, at: Point, half: float, turned: float = pi / 2) -> None:
        """A transition: a bar about a point, at an angle."""
        u, v = cos(turned), sin(turned)
        across = -3.0 * v, 3.0 * u
        ends = [(at[0] + side * half * u, at[1] + side * half * v) for side in (-1, 1)]
        (x0, y0), (x1, y1) = ends
        i, j = across
        self.polygon(
            ((x0 - i, y0 - j), (x1 - i, y1 - j), (x1 + i, y1 + j), (x0 + i, y0 + j)), "bar"
        )

    def robot(self, at: Point, gear: int, radius: float = 9.5) -> None:
        """A robot as the token that it is: a disc in its colour with its number."""
        with self.group(f"gear{gear % len(COLOURS)}"):
            self.circle(at, radius, "disc")
        self.add(
            "text",
            "white h",
            str(gear + 1),
            x=at[0],
            y=at[1] + 0.36 * 1.25 * radius,
            font_size=1.25 * radius,
            text_anchor="middle",
        )

    # --- lines -----------------------------------------------------------------------------------

    def link(self, start: Point, end: Point, style: str = "", off: float = 0.0) -> None:
        """A straight arc of a net."""
        with self.group(style):
            self.arrow(start, end, ("arc", "tip"), HEAD, off)

    def thread(self, points: Sequence[Point], style: str, kind: str = "thread") -> None:
        """A smooth line through points to the right, level at each."""
        way = f"M{number(points[0][0])} {number(points[0][1])}"
        for (x0, y0), (x1, y1) in pairwise(points):
            half = (x1 - x0) / 2
            bends = (x0 + half, y0), (x1 - half, y1), (x1, y1)
            way += "C" + " ".join(f"{number(x)} {number(y)}" for x, y in bends)
        with self.group(style):
            self.add("path", kind, d=way)

    def sweep(
        self,
        centre: Point,
        radius: float,
        start: float,
        end: float,
        style: str,
        kind: str = "arc",
        heads: bool = True,
    ) -> None:
        """An arc of a circle from one angle to another, clockwise where the second is greater,
        with a head at its end."""
        turn = 1.0 if end > start else -1.0
        stop = end - turn * (HEAD[0] / radius if heads else 0.0)
        (x0, y0), (x1, y1) = around(centre, radius, start), around(centre, radius, stop)
        big, way = int(abs(stop - start) > pi), int(turn > 0)
        path = f"M{number(x0)} {number(y0)}A{number(radius)} {number(radius)} 0 {big} {way} "
        with self.group(style):
            self.add("path", kind, d=f"{path}{number(x1)} {number(y1)}")
            if heads:
                self.head(around(centre, radius, end), (x1, y1), HEAD[1], "tip")

    def panel(self, left: float, right: float, top: float, bottom: float) -> None:
        """A ground for one part of the figure."""
        self.rectangle((left, right, top, bottom), "panel", 6.0)

    def nested(self, drawing: Canvas, box: tuple[float, ...], at: Point, wide: float) -> None:
        """Another drawing, of a box of its page, so wide at a point (left, top)."""
        shown = " ".join(map(number, (box[0], box[2], box[1] - box[0], box[3] - box[2])))
        tall = wide * (box[3] - box[2]) / (box[1] - box[0])
        place = f'x="{number(at[0])}" y="{number(at[1])}"'
        size = f'width="{number(wide)}" height="{number(tall)}"'
        inside = "".join(f"{element}\n" for element in drawing.elements)
        self.elements.append(f'<svg {place} {size} viewBox="{shown}">\n{inside}</svg>')


def around(centre: Point, radius: float, angle: float) -> Point:
    """A point of a circle; angles are clockwise from the right, as y is downwards."""
    return centre[0] + radius * cos(angle), centre[1] + radius * sin(angle)


def towards(start: Point, end: Point, by: float) -> Point:
    """The point so far from one point towards another."""
    length = max(hypot(end[0] - start[0], end[1] - start[1]), 1e-9)
    share = by / length
    return start[0] + share * (end[0] - start[0]), start[1] + share * (end[1] - start[1])


def scoped(style: str, group: str) -> str:
    """A style sheet for the elements of one group alone."""

    def within(rule: re.Match[str]) -> str:
        names = ", ".join(f".{group} {name.strip()}" for name in rule[1].split(","))
        return f"{names} {{{rule[2]}}}\n"

    return re.sub(r"\s*([^{}]+)\{([^{}]*)\}", within, style)
