"""Gears as rings: how they mesh in a tooth, and what a second tooth does."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import asin, cos, pi, radians, sin, sqrt

from factory.api import Factory
from factory.apps.drawing.canvas import Point
from tools.figures.sheet import HEAD, RADIUS, SMALL, Sheet, around


@dataclass(frozen=True, slots=True)
class Node:
    """A place (`bar` false) or a transition on a ring: whether it is shared, its tokens, and the
    words beside it."""

    bar: bool = False
    shared: bool = False
    tokens: int = 0
    words: str = ""


@dataclass(frozen=True, slots=True)
class Ring:
    """A gear drawn as a circle: `turn` is 1 where it goes clockwise, -1 otherwise."""

    centre: Point
    radius: float
    turn: int
    style: str

    def at(self, angle: float) -> Point:
        """The point at an angle."""
        return around(self.centre, self.radius, angle)

    def draw(
        self,
        sheet: Sheet,
        angles: Sequence[float],
        nodes: Sequence[Node],
        *,
        closed: bool = False,
        away: float = 24.0,
        style: str = "",
    ) -> None:
        """Draw nodes at angles with arcs from each to the next; of an open row the first and the
        last are there already. Words stand `away` from their nodes, outside."""
        pairs = list(zip(range(len(nodes)), range(1, len(nodes)), strict=False))
        for a, b in pairs + ([(len(nodes) - 1, 0)] if closed else []):
            start, end = angles[a], angles[b]
            while (end - start) * self.turn <= 0:
                end += 2 * pi * self.turn
            off = self.turn * (3.0 if nodes[b].bar else RADIUS) / self.radius
            out = self.turn * (0.0 if nodes[a].bar else RADIUS) / self.radius
            sheet.sweep(self.centre, self.radius, start + out, end - off, style or self.style)
        inner = range(len(nodes)) if closed else range(1, len(nodes) - 1)
        for index in inner:
            self.draw_node(sheet, angles[index], nodes[index], away)

    def draw_node(self, sheet: Sheet, angle: float, node: Node, away: float = 24.0) -> None:
        """Draw one node, its words outside of the ring."""
        at = self.at(angle)
        if node.bar:
            sheet.bar(at, 12.0, angle)
        else:
            style = "shared" if node.shared else self.style
            sheet.node(at, style, shared=node.shared, tokens=node.tokens)
        if node.words:
            x, y = around(self.centre, self.radius + away, angle)
            side = cos(angle)
            anchor = "middle" if abs(side) < 0.35 else ("start" if side > 0 else "end")
            sheet.words((x, y), node.words, SMALL, "grey" if node.bar else "", anchor)


def spread(start: float, end: float, count: int, turn: int) -> list[float]:
    """So many angles from one to another, both included, in a direction."""
    while (end - start) * turn <= 0:
        end += 2 * pi * turn
    return [start + (end - start) * n / (count - 1) for n in range(count)]


class GearPicture:
    """The gears of a factory: in the middle the one of `hub`, around it those that mesh with it."""

    RADIUS = 118.0
    CENTRE = (380.0, 236.0)
    TOOTH = radians(17)
    """Half the angle of a tooth on the hub."""

    def __init__(self, factory: Factory, hub: str) -> None:
        self.factory, self.net = factory, factory.net.threaded
        self.gears = factory.net.gears
        self.hub = next(n for n, gear in enumerate(self.gears) if gear.robot == hub)
        self.sheet = Sheet(372.0)

    def draw(self, angles: Sequence[float]) -> str:
        """The picture; `angles`: where the operations of the hub's program are."""
        ring = Ring(self.CENTRE, self.RADIUS, 1, f"gear{self.hub}")
        program = self.gears[self.hub].places[1::2]
        teeth = dict(zip(program, angles, strict=True))
        for place, angle in teeth.items():
            others = [robot for robot in self.factory.net.slots[place] if robot != self.hub]
            sizes = (56.0,) if len(others) == 1 else (52.0, 94.0)
            for robot, radius in zip(sorted(others), sizes, strict=True):
                self._petal(robot, place, angle, radius)
        for place in program:
            before = self.gears[self.hub].places.index(place) - 1
            wait = self.gears[self.hub].places[before]
            previous = program[program.index(place) - 1]
            start, end = teeth[previous] + self.TOOTH, teeth[place] - self.TOOTH
            self._hub_arc(ring, wait, start, end)
        for place, angle in teeth.items():
            self._tooth(ring, place, angle)
        name = self.gears[self.hub].robot
        with self.sheet.group(f"gear{self.hub}"):
            self.sheet.words(self.CENTRE, name, 22.0, "h hue")
        counts = f"{len(self.gears)} gears, {len(self.net.places)} places"
        return self.sheet.svg(f"The gear net of the paper's example: {counts}")

    def _hub_arc(self, ring: Ring, wait: int, start: float, end: float) -> None:
        angles = spread(start, end, 3, 1)
        node = Node(tokens=self._tokens(wait))
        ring.draw(self.sheet, angles, [Node(bar=True), node, Node(bar=True)])
        x, y = around(self.CENTRE, self.RADIUS - 32, angles[1])
        self.sheet.words((x, y), self.net.places[wait].label, SMALL)

    def _tooth(self, ring: Ring, place: int, angle: float) -> None:
        """The shared place and its two transitions, on the hub's ring."""
        marks = [angle - self.TOOTH, angle, angle + self.TOOTH]
        row = [Node(bar=True), Node(shared=True), Node(bar=True)]
        ring.draw(self.sheet, marks, row, style="shared")
        for mark in (marks[0], marks[2]):
            self.sheet.bar(ring.at(mark), 15.0, mark)
        shown = self.net.places[place]
        x, y = around(self.CENTRE, self.RADIUS - 40, angle)
        self.sheet.words((x, y - 7), shown.mode, SMALL, "h")
        self.sheet.words((x, y + 7), shown.label, SMALL)

    def _petal(self, robot: int, place: int, angle: float, radius: float) -> None:
        """The gear of another robot: its way around from the end of the tooth to its start."""
        gear, style = self.gears[robot], f"gear{robot}"
        half = self.RADIUS * sin(self.TOOTH)
        off = self.RADIUS * cos(self.TOOTH) + sqrt(radius**2 - half**2)
        centre = around(self.CENTRE, off, angle)
        ring, lean = Ring(centre, radius, -1, style), asin(half / radius)
        at = gear.places.index(place)
        row = [Node(bar=True)]
        for step in range(1, len(gear.places)):
            index = (at + step) % len(gear.places)
            shown = self.net.places[gear.places[index]]
            shared = len(self.factory.net.slots[gear.places[index]]) > 1
            words = shown.mode if shown.mode not in ("wait", "hold") else ""
            row += [Node(False, shared, self._tokens(gear.places[index]), words), Node(bar=True)]
        back = angle + pi
        angles = spread(back - lean, back + lean, len(row), -1)
        ring.draw(self.sheet, angles, row, away=20.0)
        with self.sheet.group(style):
            beside = (radius - 26, angle + 0.95) if radius > 60 else (0.0, angle)
            self.sheet.words(around(centre, *beside), gear.robot, 17.0, "h hue")

    def _tokens(self, place: int) -> int:
        return int(place in self.factory.net.initial_marking)


def draw_tooth() -> str:
    """Two gears in one tooth, which Definition 3.6 allows; and in two, which it forbids."""
    sheet = Sheet(330.0)
    sheet.panel(8, 374, 8, 322)
    sheet.panel(386, 752, 8, 322)
    sheet.title((22, 27), "One tooth: a gear net, live")
    sheet.title((400, 27), "Two teeth, met in opposite order: dead")
    _one_tooth(sheet)
    _two_teeth(sheet)
    return sheet.svg("Two gears in one tooth, and the forbidden second one")


def _one_tooth(sheet: Sheet) -> None:
    middle, height, radius, half = 191.0, 172.0, 82.0, 46.0
    off = sqrt(radius**2 - half**2)
    lean = asin(half / radius)
    left = Ring((middle - off, height), radius, 1, "gear2")
    right = Ring((middle + off, height), radius, -1, "gear4")
    row = [Node(bar=True), Node(), Node(bar=True), Node(tokens=1), Node(bar=True)]
    left.draw(sheet, spread(lean, -lean, 5, 1), row)
    row[2] = Node(bar=True, words="c")
    right.draw(sheet, spread(pi - lean, pi + lean, 5, -1), row, away=20.0)
    top, bottom = (middle, height - half), (middle, height + half)
    sheet.link(top, (middle, height - RADIUS), "shared")
    sheet.link((middle, height + RADIUS), bottom, "shared", 3.0)
    sheet.node((middle, height), "shared", shared=True)
    for at, words, side in ((top, "a", -22), (bottom, "b", 20)):
        sheet.bar(at, 17.0, 0.0)
        sheet.words((at[0], at[1] + side), words, 13.0, "h")
    sheet.words((middle - 18, height), "[a; b]", SMALL, "", "end")
    sheet.words((middle - off - 26, height), "(T, P)", 14.0, "h")
    sheet.words((middle + off + 22, height), "(S, Q)", 14.0, "h")
    sheet.words((191, 304), "each keeps a waiting place of its own before a", SMALL, "grey")


TEETH = ("a", "p", "b"), ("c", "q", "d")
"""The shared places p and q of two gears, with the transitions before and after."""

WAITS = (
    ("b", "c", -1, 46.0, "gear0", 0),
    ("d", "a", -1, 124.0, "gear0", 1),
    ("b", "c", 1, 46.0, "gear1", 1),
    ("d", "a", 1, 104.0, "gear1", 0),
)
"""Their places between these: from and to which transition, on which side (-1: left) and how far
from the middle [pixels], the gear, and the tokens."""


def _two_teeth(sheet: Sheet) -> None:
    """Gears r1 (p before q) and r2 (q before p)."""
    x, side = 569.0, 10.0
    y = {"a": 72.0, "p": 101.0, "b": 130.0, "c": 206.0, "q": 235.0, "d": 264.0}
    for start, _, end in TEETH:
        sheet.line("halo", (x, y[start]), (x, y[end]))
    for start, end, way, by, _, tokens in WAITS:
        if not tokens:
            sheet.add("path", "halo", d=_bow(x + way * side, y[start], y[end] - 9.0, way * by))
    for start, middle, end in TEETH:
        sheet.link((x, y[start]), (x, y[middle] - RADIUS), "shared")
        sheet.link((x, y[middle] + RADIUS), (x, y[end]), "shared", 3.0)
        sheet.node((x, y[middle]), "shared", shared=True)
        sheet.words((x + 18, y[middle]), middle, 13.0, "h", "start")
    for start, end, way, by, style, tokens in WAITS:
        foot, down = x + way * side, 1 if y[end] > y[start] else -1
        tip = y[end] - 3.0
        with sheet.group(style):
            sheet.add("path", "arc", d=_bow(foot, y[start], tip - HEAD[0] + 2, way * by))
            sheet.head((foot, tip), (foot, tip - HEAD[0]), HEAD[1], "tip")
        far = 0.75 * by if down > 0 else by
        sheet.node((foot + way * far, (y[start] + y[end]) / 2), style, tokens=tokens)
    for name in "abcd":
        sheet.bar((x, y[name]), 19.0, 0.0)
        sheet.words((x + 30, y[name]), name, SMALL, "grey")
    for gear, at in ((0, x - 158), (1, x + 142)):
        with sheet.group(f"gear{gear}"):
            sheet.words((at, 168), f"r_{{{gear + 1}}}", 17.0, "h hue")
    with sheet.group("wrong"):
        sheet.words(
            (569, 304), "the circuit in red has no token, and none comes to it", SMALL, "hue"
        )


def _bow(x: float, start: float, end: float, by: float) -> str:
    """A line from one height to another that bulges to a side; upwards it leaves at the foot and
    comes back from above."""
    if end > start:
        far = x + by
        bends = f"C{far:.1f} {start + 14:.1f} {far:.1f} {end - 14:.1f} {x:.1f} {end:.1f}"
        return f"M{x:.1f} {start:.1f}{bends}"
    far, edge, lean = x + by, 24.0, 40.0
    return (
        f"M{x:.1f} {start:.1f}C{x:.1f} {start + edge:.1f} {far:.1f} {start + edge:.1f}"
        f" {far:.1f} {start - lean:.1f}L{far:.1f} {end + lean:.1f}"
        f"C{far:.1f} {end - edge:.1f} {x:.1f} {end - edge:.1f} {x:.1f} {end:.1f}"
    )
