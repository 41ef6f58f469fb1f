"""Lettering: text on a drawing, put where it hides nothing that was drawn or lettered before."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from xml.sax.saxutils import escape

from factory.layout.plan import Box, Point2

WIDTH = 0.58
"""Mean width of a letter, in font sizes."""

LONGEST = 20
"""A label of more letters is cut; its whole text is shown as a tooltip."""


def number(value: float) -> str:
    """A coordinate [mm] to a tenth, the same for all zeros."""
    text = f"{value:.1f}"
    return text[:-2].replace("-0", "0") if text.endswith(".0") and len(text) < 5 else text


def clean(text: str) -> str:
    """A text as XML may contain it."""
    return escape("".join(c if c.isprintable() else " " for c in text))


def shortened(label: str) -> str:
    """A label as it is drawn."""
    return label if len(label) <= LONGEST else f"{label[: LONGEST - 1]}…"


def text(at: Point2, words: str, size: float, style: str = "", anchor: str = "middle") -> str:
    """A text whose middle line is at a point of the page [mm]."""
    shown = shortened(words) if style != "h" else words
    title = "" if shown == words else f"<title>{clean(words)}</title>"
    marked = f' class="{style}"' if style else ""
    return (
        f'<text x="{number(at[0])}" y="{number(at[1] + 0.35 * size)}" font-size="{number(size)}"'
        f' text-anchor="{anchor}"{marked}>{clean(shown)}{title}</text>'
    )


@dataclass(slots=True)
class Lettering:
    """Finds room for labels; boxes are on the page, y down [mm]. A grid keeps it near linear."""

    cell: float = 150.0
    taken: dict[tuple[int, int], list[Box]] = field(default_factory=dict)

    def block(self, box: Box) -> None:
        """Keep labels off a box."""
        for key in self._cells(box):
            self.taken.setdefault(key, []).append(box)

    def place(self, at: Point2, words: str, size: float, off: float, style: str = "") -> str:
        """A label about `off` away from a point, where it covers least of what is there already."""
        half = len(shortened(words)) * size * WIDTH / 2, size / 2
        best = min(
            ((self._hidden(box := _about(middle, half)), n, middle, box)
             for n, middle in enumerate(_around(at, half, off))),
            key=lambda found: found[:2],
        )  # fmt: skip
        self.block(best[3])
        return text(best[2], words, size, style)

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


def _around(at: Point2, half: Point2, off: float) -> Iterable[Point2]:
    """Places about a point, the best first."""
    for reach in (1.0, 1.8, 2.8):
        x, y = half[0] + off * reach, half[1] + off * reach
        for i, j in ((1, -1), (-1, -1), (1, 1), (-1, 1), (0, -1), (0, 1), (1, 0), (-1, 0)):
            yield at[0] + i * x, at[1] + j * y
