"""What the panels have in common: a heading, a gutter with the robots' names, and which robots they
show, each in a row of its own, and where the rows are.

Where there is room for all robots all are shown, in the order of their numbers. Else those in the
neighbourhood of the product that is furthest on its way: the robots that have it now and those it
meets next. Their rows fade in and out, and glide to their places.
"""

from __future__ import annotations

from collections.abc import Container, Iterator
from dataclasses import dataclass
from functools import cached_property
from math import inf

import numpy as np

from factory.film.colours import AMBER, robot_colours
from factory.film.history import History, depths, followed
from factory.support.pictures.ink import EDGE, FAINT, GROUND, INK, Ink, width
from factory.theory.plant.factory import Factory
from factory.theory.plant.operation import Operation

CLOSE, EASY = 18.0, 26.0
"""Least distances of rows at 1280x720 where all robots are shown, and where not [px]."""

NARROW = 34.0
"""Least width of columns where all are shown, at 1280x720 [px]."""

NAMES = 60.0
"""Room for the names of robots, at 1280x720 [px]."""

ROOM = 292.0
"""For rows, in one of two panels at 1280x720 [px]."""

COLUMNS = 6.0
"""Operations side by side where not all robots are shown."""

CALM = 0.25
"""Time constant of everything that comes, goes or moves to another row [s]."""


@dataclass(frozen=True, slots=True)
class PanelRow:
    """A robot's row: `at` which height, in rows from the top; `alpha`: how far it has come or
    gone."""

    robot: int
    at: float
    alpha: float = 1.0


class Rows:
    """The rows at present, in so much `room` for them and `across` for columns [px at 1280x720], if
    there are any. `reduced`: whether not all robots and columns are shown; `named`: how many robots
    are, without those that fade out; `count`: for how many there are places, `most` at the most;
    `first`: the leftmost column of operations to be seen, and `columns` how many are."""

    def __init__(self, history: History, room: float = ROOM, across: float = inf) -> None:
        self.history, self.factory = history, history.factory
        robots = len(self.factory.robots)
        self.reduced = CLOSE * robots > room or NARROW * self.width > across
        self.most = min(int(room / EASY), robots)
        self.count = float(self.most if self.reduced else robots)
        self.shown = [] if self.reduced else [PanelRow(r, float(r)) for r in range(robots)]
        self.columns = min(COLUMNS, self.width) if self.reduced else self.width
        self.named = robots
        self.first = 0.0
        self.focus: Operation | None = None

    @cached_property
    def column(self) -> tuple[int, ...]:
        """For each operation its column: the last is rightmost, each as far right as it can be."""
        depth = depths(self.factory)
        return tuple(max(depth) - d for d in depth)

    @property
    def width(self) -> float:
        """Columns that there are."""
        return max(self.column) + 1.0

    def advance(self, time: float, elapsed: float) -> None:
        """To what is shown at a time, `elapsed` [s] after the last; with 0 at once."""
        if not self.reduced:
            return
        self.focus = followed(self.factory, self.history.counts(time))
        share = 1.0 - float(np.exp(-elapsed / CALM)) if elapsed > 0 and self.shown else 1.0
        wanted = self.column[self.focus.index] + 1.5 - self.columns / 2
        wanted = min(max(wanted, 0.0), self.width - self.columns)
        self.first += share * (wanted - self.first)
        near = neighbourhood(self.factory, self.focus, self.most, self._in_sight(wanted))
        place = {robot: float(number) for number, robot in enumerate(near)}
        self.named = len(near)
        self.count += share * (self.named - self.count)
        old = {row.robot: row for row in self.shown}
        fresh = [PanelRow(r, at, 0.0) for r, at in place.items() if r not in old]
        moved = (_moved(row, place, share) for row in (*self.shown, *fresh))
        self.shown = sorted((row for row in moved if row), key=lambda row: row.robot)

    def _in_sight(self, first: float) -> frozenset[int]:
        """The operations that are in sight where that is the leftmost column."""
        last = first + self.columns - 0.5
        return frozenset(o for o, c in enumerate(self.column) if first - 0.4 < c < last)


def _moved(row: PanelRow, place: dict[int, float], share: float) -> PanelRow | None:
    """A row on its way to its place, or out."""
    at, there = place.get(row.robot, row.at), float(row.robot in place)
    alpha = row.alpha + share * (there - row.alpha)
    return PanelRow(row.robot, row.at + share * (at - row.at), alpha) if alpha > 0.02 else None


def neighbourhood(
    factory: Factory, focus: Operation, most: int, sight: Container[int]
) -> list[int]:
    """At most so many robots of operations in sight: those of one, of the operations that its
    result goes to, the nearest first, and of those that make what joins it there; then of those
    that make what these need, and so on. In the order of their numbers."""
    chosen = list(_ahead(factory, focus))
    robots = set(focus.robots[:most])
    for operation in chosen:
        if operation.index not in sight:
            continue
        more = robots | set(operation.robots)
        if len(more) > most:
            break
        robots = more
        chosen += (factory.by_label[label] for label in operation.inputs)
    return sorted(robots)


def _ahead(factory: Factory, focus: Operation) -> Iterator[Operation]:
    """An operation, those that its inputs come from, and what it leads to, each with what joins it
    there."""
    operation = focus
    while True:
        yield operation
        yield from (factory.by_label[label] for label in operation.inputs)
        if (parent := factory.parents[operation.index]) < 0:
            return
        operation = factory.operations[parent]


TALLEST = 80.0
"""Distance of rows at 1280x720, at the most [px]."""

TOP, FOOT, BOTTOM = 40.0, 22.0, 6.0
"""Above the rows at 1280x720, and below them with a scale of time and without [px]."""

OUTSIDE = TOP + FOOT + BOTTOM
"""What of a panel's height no row has [px]."""


@dataclass(frozen=True)
class PanelSheet:
    """The measures of a panel of a size, at a scale (1 at 1280x720), over some rows; `below`: what
    is kept free at the bottom [px]."""

    size: tuple[int, int]
    scale: float
    rows: Rows
    below: float = 0.0

    @property
    def points(self) -> int:
        """Height of words."""
        return max(11, round(14.5 * self.scale))

    @property
    def small(self) -> int:
        """Height of words that have to fit a row."""
        return max(9, min(self.points - 1, int(self.pitch * 0.75)))

    @property
    def edge(self) -> float:
        """Free at the left and at the right."""
        return 14 * self.scale

    @property
    def top(self) -> float:
        """Where the rows begin."""
        return TOP * self.scale

    @property
    def pitch(self) -> float:
        """Distance of rows."""
        room = self.size[1] - self.top - self.below - BOTTOM * self.scale
        return min(room / max(self.rows.count, 1.0), TALLEST * self.scale)

    @property
    def gutter(self) -> float:
        """Where the names of robots end."""
        longest = max((len(r.name) for r in self.rows.factory.robots), default=2)
        name = width("0" * longest, self.name_points)
        return self.edge + self.points * 1.1 + name + 6 * self.scale

    @property
    def name_points(self) -> int:
        """Height of the robots' names."""
        return max(10, min(self.points, int(self.pitch * 0.85)))

    def height(self, row: PanelRow) -> float:
        """The middle of a row."""
        return self.top + (row.at + 0.5) * self.pitch

    def blank(self, title: str, detail: str) -> Ink:
        """A panel with its heading."""
        pixels = np.empty((self.size[1], self.size[0], 3), np.uint8)
        pixels[:] = GROUND
        ink = Ink(pixels)
        ink.box(0, 0, max(1.0, self.scale), self.size[1], EDGE)
        ink.box(0, 0, self.size[0], max(1.0, self.scale), EDGE)
        y = 20 * self.scale
        ink.words(self.edge, y, title, self.points + 2, INK)
        ink.words(self.size[0] - self.edge, y, detail, self.points - 1, FAINT, "r")
        return ink

    def names(self, ink: Ink, standing: frozenset[int] = frozenset()) -> None:
        """The robots' names, each with a spot of its paint; those of robots that stand on amber."""
        for row in self.rows.shown:
            y, colour = self.height(row), robot_colours(self.rows.factory)[row.robot]
            if row.robot in standing:
                half = 0.42 * self.pitch
                left, right, alpha = 0.4 * self.edge, self.gutter - 3, 0.6 * row.alpha
                ink.box(left, y - half, right, y + half, AMBER, alpha, 3)
            radius = min(4.5 * self.scale, 0.3 * self.pitch)
            ink.disc(self.edge + radius, y, radius, colour, row.alpha)
            name = self.rows.factory.robots[row.robot].name
            left = self.edge + self.points * 1.1
            ink.words(left, y, name, self.name_points, INK, "l", row.alpha)


def robots_shown(rows: Rows) -> str:
    """Which robots are shown, in words."""
    robots = len(rows.factory.robots)
    if not rows.reduced or rows.focus is None:
        return f"{robots} robots"
    return f"{rows.named} of {robots} robots, round {rows.focus.label}"
