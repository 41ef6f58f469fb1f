"""The compiled net as the SVG exporter lays it out, as wide as a page; a circuit with a token."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from factory.api import Factory, MarkedNet
from factory.apps.exports.swimlanes import swimlanes
from tools.figures.sheet import RADIUS, SMALL, WIDTH, Sheet

LANE = 55.0
"""Distance of the lanes of robots [pixels]."""

SMALLER = 10.0
"""Lettering between narrow columns."""


class LaneNet:
    """The net of a factory with a lane for each robot, drawn on a sheet from a height on; `order`:
    its robots from top to bottom, as the exporter has them where none are named."""

    def __init__(self, factory: Factory, top: float, order: Sequence[int] = ()) -> None:
        self.factory, self.net = factory, factory.net.threaded
        self.at = swimlanes(MarkedNet.of(factory.net))
        first, last = min(self.at.x), max(self.at.x)
        self.pitch = (WIDTH - 128.0) / (last - first + 120.0)
        self.first = first
        levels = [self.at.lanes[robot] for robot in order] or sorted(self.at.lanes)
        self.level = {y: top + 22.0 + LANE * row for row, y in enumerate(levels)}
        self.bottom = top + 8.0 + LANE * len(levels)

    def x(self, x: float) -> float:
        """A column of the exporter's drawing on this page."""
        return 94.0 + (x - self.first) * self.pitch

    def draw(self, sheet: Sheet) -> None:
        """Lanes, then places and transitions on them."""
        gears, slots = self.factory.net.gears, self.factory.net.slots
        for number in range(len(gears)):
            y, style = self.level[self.at.lanes[number]], f"gear{number}"
            with sheet.group(style):
                sheet.words((10.0, y), f"r_{{{number + 1}}}", 15.0, "h hue", "start")
            self._lane(sheet, number, y)
        for event, transition in enumerate(self.net.transitions):
            low, high = (self.level[y] for y in self._ends(event))
            x = self.x(self.at.x[event])
            sheet.bar((x, (low + high) / 2), (high - low) / 2 + 13)
            name, _, sign = transition.name.rpartition("_")
            sheet.words((x, high + 23), f"{name}_{{{sign}}}", SMALLER, "grey")
        for place, shown in enumerate(self.net.places):
            x, y = self.at.places[place]
            at = self.x(x), self.level[y]
            shared = len(slots[place]) > 1
            style = "shared" if shared else f"gear{slots[place][0]}"
            here = place in self.factory.net.initial_marking
            sheet.node(at, style, shared=shared, tokens=here)
            words = shown.mode if shown.mode not in ("wait", "hold") else shown.label
            sheet.words((at[0], at[1] - 20), words, SMALLER, "h" if shared else "")

    def _lane(self, sheet: Sheet, number: int, y: float) -> None:
        """The arcs of one gear: straight along its lane, with a head at each node."""
        gear, style = self.factory.net.gears[number], f"gear{number}"
        places = {p: self.x(self.at.places[p][0]) for p in gear.places}
        shared = {p for p in gear.places if len(self.factory.net.slots[p]) > 1}
        away = {places[p] for p in shared if self.level[self.at.places[p][1]] != y}
        bars = {self.x(self.at.x[e]) for e in gear.transitions}
        nodes = sorted({*places.values(), *bars} - away)
        stops = [40.0, *nodes, WIDTH - 10.0]
        for x0, x1 in pairwise(stops):
            if any(x0 < x < x1 for x in away) and {x0, x1} <= bars:
                with sheet.group(style):
                    sheet.line("faint", (x0, y), (x1, y))
            else:
                sheet.link((x0, y), (x1, y), style, 3.0 if x1 in bars else RADIUS * (x1 in nodes))

    def _ends(self, event: int) -> tuple[float, float]:
        """The outermost lanes of a transition, as the exporter has them."""
        lanes = [
            self.at.lanes[number]
            for number, gear in enumerate(self.factory.net.gears)
            if event in gear.transitions
        ]
        return min(lanes, key=self.level.__getitem__), max(lanes, key=self.level.__getitem__)


def draw_net(factory: Factory, order: Sequence[int] = ()) -> str:
    """The compiled net, its robots from top to bottom in an order."""
    lanes = LaneNet(factory, 8.0, order)
    sheet = Sheet(lanes.bottom)
    lanes.draw(sheet)
    counts = f"{len(factory.robots)} robots, {len(lanes.net.places)} places"
    return sheet.svg(
        f"The net of the paper's example: {counts}", ".faint { stroke: currentColor; }"
    )


ORDER = ("b", "c", 0), ("d", "a", 1)
"""Two order places: from and to which transition, and the tokens."""


def draw_exclusion() -> str:
    """Two places that are never marked together, by two order places and one token."""
    sheet = Sheet(236.0)
    sheet.panel(8, 752, 8, 228)
    sheet.title((22, 27), "Order places [b; c] and [d; a]: a circuit with one token")
    rows = {"gear0": (92.0, "p", "a", "b", "r_{1}"), "gear1": (180.0, "q", "c", "d", "r_{2}")}
    start, middle, end = 300.0, 384.0, 468.0
    for style, (y, name, first, last, robot) in rows.items():
        sheet.line("halo", (start, y), (end, y))
        sheet.link((120.0, y), (200 - RADIUS, y), style)
        sheet.link((200 + RADIUS, y), (start, y), style, 3.0)
        sheet.link((start, y), (middle - RADIUS, y), style)
        sheet.link((middle + RADIUS, y), (end, y), style, 3.0)
        sheet.link((end, y), (640.0, y), style)
        for x, event in ((start, first), (end, last)):
            sheet.bar((x, y), 17.0)
            side = -26 if style == "gear0" else 27
            sheet.words((x, y + side), event, 13.0, "h")
        sheet.node((200.0, y), style, tokens=1)
        sheet.node((middle, y), style)
        sheet.words((middle, y + (-23 if style == "gear0" else 24)), name, 13.0, "h")
        with sheet.group(style):
            sheet.words((70.0, y), robot, 17.0, "h hue")
        sheet.words((646.0, y), "…", 15.0, "grey", "start")
    top, bottom = rows["gear0"][0], rows["gear1"][0]
    at = {"a": (start, top), "b": (end, top), "c": (start, bottom), "d": (end, bottom)}
    for before, after, tokens in ORDER:
        foot, tip = at[before], at[after]
        share = 0.76 if tokens else 0.24
        x = foot[0] + share * (tip[0] - foot[0])
        y = foot[1] + share * (tip[1] - foot[1])
        sheet.line("halo", foot, tip)
        sheet.link(foot, tip, "wrong", 4.0)
        sheet.node((x, y), "wrong", tokens=tokens)
    for row, words in enumerate(
        ("p and q lie on one circuit;", "its one token is in p, in q,", "or in an order place")
    ):
        sheet.words((536.0, 118.0 + 17 * row), words, SMALL, "grey", "start")
    return sheet.svg("Two places that are never marked together")
