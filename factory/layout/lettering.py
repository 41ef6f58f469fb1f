"""Lettering: labels put where they hide least of what was drawn or lettered before."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from factory.layout.layout import Box, Point2
from factory.layout.svg import label, shortened

WIDTH = 0.6
"""Mean width of a letter, in font sizes."""

DIRECTIONS = ((1, -1), (-1, -1), (1, 1), (-1, 1), (0, -1), (0, 1), (1, 0), (-1, 0))
"""Where a label may be about its point, the best first."""


@dataclass(slots=True)
class Lettering:
    """Finds room for labels; boxes are on the page, y down [mm]. A grid of cells keeps it near
    linear."""

    cell: float = 150.0
    taken: dict[tuple[int, int], list[Box]] = field(default_factory=dict)

    def block(self, box: Box) -> None:
        """Keep labels off a box."""
        for key in self._cells(box):
            self.taken.setdefault(key, []).append(box)

    def place(self, at: Point2, words: str, size: float, off: float, style: str) -> str:
        """A label about `off` away from a point, where it covers least of what is there already."""
        half = len(shortened(words)) * size * WIDTH / 2, size / 2
        found = [
            (self._hidden(_about(middle, half)), number, middle)
            for number, middle in enumerate(_around(at, half, off))
        ]
        middle = min(found)[2]
        self.block(_about(middle, half))
        return label(middle, words, size, style)

    def _hidden(self, box: Box) -> float:
        """How much of a box is taken [mm²]."""
        found = {other for key in self._cells(box) for other in self.taken.get(key, ())}
        return sum(
            max(0.0, min(box[1], b[1]) - max(box[0], b[0]))
            * max(0.0, min(box[3], b[3]) - max(box[2], b[2]))
            for b in sorted(found)
        )

    def _cells(self, box: Box) -> Iterator[tuple[int, int]]:
        first, last = int(box[0] // self.cell), int(box[1] // self.cell)
        top, bottom = int(box[2] // self.cell), int(box[3] // self.cell)
        return ((i, j) for i in range(first, last + 1) for j in range(top, bottom + 1))


def _about(middle: Point2, half: Point2) -> Box:
    x, y = middle
    return x - half[0], x + half[0], y - half[1], y + half[1]


def _around(at: Point2, half: Point2, off: float) -> Iterator[Point2]:
    for reach in (1.0, 1.8, 2.8):
        x, y = half[0] + off * reach, half[1] + off * reach
        for i, j in DIRECTIONS:
            yield at[0] + i * x, at[1] + j * y
