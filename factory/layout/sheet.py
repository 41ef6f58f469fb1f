"""The sheet around a floor plan: title and figures, dimensions, a scale bar and the legend."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import floor, log10, sqrt

from factory.layout.layout import Box, Point2
from factory.layout.lettering import WIDTH
from factory.layout.svg import circle, line, rectangle, text

Entries = Sequence[tuple[str, str]]
"""What the legend shows: a style and what it stands for."""


@dataclass(frozen=True, slots=True)
class Sheet:
    """A sheet for a floor (xlo, xhi, ylo, yhi) on the page, y down [mm].

    All its sizes are multiples of `unit`. A floor that is tall has the legend on its right, any
    other below.
    """

    floor: Box
    title: str
    figures: Sequence[str]
    entries: Entries

    @property
    def wide(self) -> float:
        """Width of the floor [mm]."""
        return self.floor[1] - self.floor[0]

    @property
    def tall(self) -> float:
        """Depth of the floor [mm]."""
        return self.floor[3] - self.floor[2]

    @property
    def unit(self) -> float:
        """The size that everything is a multiple of [mm]."""
        return max(14.0, sqrt(self.wide * self.tall) / 45, self.wide / 60)

    @property
    def upright(self) -> bool:
        """Whether the floor is so tall that there is room beside it."""
        return self.tall > 1.5 * self.wide

    @property
    def page(self) -> Box:
        """The whole sheet."""
        unit, (xlo, xhi, ylo, yhi) = self.unit, self.floor
        widest = max(len(words) for words in self.figures) * 0.8 * WIDTH
        longest = max(widest, len(self.title) * 1.5 * WIDTH * 1.15)
        right = max(xhi + (17 if self.upright else 1) * unit, xlo + (longest + 1) * unit)
        rows = len(self._rows(right))
        foot = 3.2 if self.upright else 5.6 + 1.2 * rows
        top = ylo - (4.6 + 1.3 * len(self.figures)) * unit
        return xlo - 3.2 * unit, right, top, yhi + foot * unit

    def lines(self) -> Iterator[str]:
        """The elements."""
        unit, (xlo, _, ylo, yhi) = self.unit, self.floor
        above = ylo - 1.4 * unit - 1.3 * unit * (len(self.figures) - 1)
        yield text((xlo, above - 2.0 * unit), self.title, 1.5 * unit, "h")
        for number, words in enumerate(self.figures):
            yield text((xlo, above + 1.3 * unit * number), words, 0.8 * unit)
        yield from self._dimensions()
        if self.upright:
            x = self.floor[1] + 1.5 * unit
            yield from self._scale_bar((x, yhi - 1.2 * unit), 13 * unit)
            start = yhi - 2.5 * unit - 1.3 * unit * len(self.entries)
            for number, entry in enumerate(self.entries):
                yield from self._entry(entry, (x, start + 1.3 * unit * number))
            return
        yield from self._scale_bar((xlo, yhi + 3.0 * unit), self.wide / 3)
        for row, entries in enumerate(self._rows(self.page[1])):
            for entry, x in entries:
                yield from self._entry(entry, (x, yhi + (5.6 + 1.2 * row) * unit))

    def _rows(self, right: float) -> list[list[tuple[tuple[str, str], float]]]:
        """The legend's entries with their places, as many to a row as there is room for."""
        rows: list[list[tuple[tuple[str, str], float]]] = [[]]
        x = self.floor[0]
        for entry in self.entries:
            needed = (1.5 + 0.7 * WIDTH * len(entry[1])) * self.unit
            if rows[-1] and x + needed > right:
                rows.append([])
                x = self.floor[0]
            rows[-1].append((entry, x))
            x += needed + 1.5 * self.unit
        return rows

    def _dimensions(self) -> Iterator[str]:
        """The floor's width below it and its depth to its left."""
        unit, tick, (left, right, top, bottom) = self.unit, 0.25 * self.unit, self.floor
        y, x = bottom + 0.9 * unit, left - 0.9 * unit
        yield line("measure", (left, y), (right, y))
        yield line("measure", (x, top), (x, bottom))
        for end in (left, right):
            yield line("measure", (end, y - tick), (end, y + tick))
        for end in (top, bottom):
            yield line("measure", (x - tick, end), (x + tick, end))
        middle, size = ((left + right) / 2, (top + bottom) / 2), 0.7 * unit
        yield text((middle[0], y + size), f"{self.wide / 1e3:.3f} m", size, "", "middle")
        yield f'<g transform="translate({x - size:.1f} {middle[1]:.1f}) rotate(-90)">'
        yield text((0.0, 0.0), f"{self.tall / 1e3:.3f} m", size, "", "middle")
        yield "</g>"

    def _scale_bar(self, at: Point2, most: float) -> Iterator[str]:
        """Five steps of a round length."""
        unit, (x, y) = self.unit, at
        step = _round_length(most / 5)
        for n in range(5):
            box = (x + n * step, x + (n + 1) * step, y - 0.2 * unit, y + 0.2 * unit)
            yield rectangle(box, "white" if n % 2 else "black")
        for n, words in ((0, "0"), (5, f"{5 * step / 1e3:g} m")):
            yield text((x + n * step, y + 0.8 * unit), words, 0.7 * unit, "", "middle")

    def _entry(self, entry: tuple[str, str], at: Point2) -> Iterator[str]:
        """A sample and what it stands for."""
        (style, words), half, (x, y) = entry, 0.4 * self.unit, at
        if style == "path":
            yield line(style, (x, y), (x + 2 * half, y))
        elif style == "junction":
            yield circle((x + half, y), half, style)
        else:
            yield rectangle((x, x + 2 * half, y - half, y + half), style)
        yield text((x + 1.2 * self.unit, y), words, 0.7 * self.unit)


def _round_length(length: float) -> float:
    """The next 1, 2 or 5 times a power of ten below a length."""
    power: float = 10.0 ** floor(log10(length))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= length)
