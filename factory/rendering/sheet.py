"""What the panels have in common: a heading, a gutter with the robots' names, rows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from factory.rendering.ink import AMBER, EDGE, FAINT, GROUND, INK, Ink, robot_colours, width
from factory.rendering.rows import PanelRow, Rows

TALLEST = 62.0
"""Distance of rows at 1280x720, at the most [px]."""

TOP, FOOT, BOTTOM = 40.0, 22.0, 6.0
"""Above the rows at 1280x720, and below them with a scale of time and without [px]."""

OUTSIDE = TOP + FOOT + BOTTOM
"""What of a panel's height no row has [px]."""


@dataclass(frozen=True)
class PanelSheet:
    """The measures of a panel of a size, at a scale (1 at 1280x720), over some rows; `below`: what
    is kept free at the bottom [px], and `notes` right of the robots' names."""

    size: tuple[int, int]
    scale: float
    rows: Rows
    below: float = 0.0
    notes: float = 0.0

    @property
    def points(self) -> int:
        """Height of words."""
        return max(9, round(13 * self.scale))

    @property
    def small(self) -> int:
        """Height of words that have to fit a row."""
        return max(8, min(self.points - 1, int(self.pitch * 0.75)))

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
        """Where the names of robots end, and the notes."""
        longest = max((len(r.name) for r in self.rows.factory.robots), default=2)
        name = width("0" * longest, self.name_points)
        return self.edge + self.points * 1.1 + name + 6 * self.scale + self.notes

    @property
    def name_points(self) -> int:
        """Height of the robots' names."""
        return max(9, min(self.points, int(self.pitch * 0.85)))

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

    def names(
        self, ink: Ink, standing: frozenset[int] = frozenset(), gone: frozenset[int] = frozenset()
    ) -> None:
        """The robots' names, each with a spot of its paint; those of robots that stand on amber,
        those of robots that are gone faint."""
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
            paint = FAINT if row.robot in gone else INK
            ink.words(left, y, name, self.name_points, paint, "l", row.alpha)


def robots_shown(rows: Rows) -> str:
    """Which robots are shown, in words."""
    robots = len(rows.factory.robots)
    if not rows.reduced or rows.focus is None:
        return f"{robots} robots"
    return f"{rows.named} of {robots} robots, round {rows.focus.label}"
