"""A canvas for drawings in SVG: shapes, words, signs and lettering on a page, y downwards.

The same calls give the same bytes, and nothing outside the file is referred to. Packages that write
SVG (svgwrite, drawsvg) offer the shapes alone, which are forty lines here.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from itertools import pairwise
from math import ceil, floor, hypot, log10
from typing import TYPE_CHECKING, Any

from factory.apps.drawing.markup import escape, quoteattr

if TYPE_CHECKING:
    from numpy.typing import NDArray

Point = tuple[float, float]
"""(x, y)."""

Box = tuple[float, float, float, float]
"""(xlo, xhi, ylo, yhi)."""

LONGEST = 20
"""A label of more letters is cut; the whole of it is shown as a tooltip."""

BLOT = 4.0
"""Size of the spots in which lettering sees a curve."""

LETTER = 0.6
"""Mean width of a letter, in font sizes."""

CELL = 150.0
"""Size of the cells in which lettering looks for what is drawn."""

DIRECTIONS = ((1, -1), (-1, -1), (1, 1), (-1, 1), (0, -1), (0, 1), (1, 0), (-1, 0))
"""Where a label may be about its point, the best first."""

LINES, DISCS = frozenset({"path"}), frozenset({"junction"})
"""Styles whose sample in a legend is a line, or a disc; that of any other is a square."""

STYLE = """
text { font-family: 'DejaVu Sans', 'Helvetica Neue', Arial, sans-serif; fill: #1f2933; }
.paper { fill: #ffffff; } .h { font-weight: bold; } .grey { fill: #52606d; }
.black { fill: #1f2933; stroke: #1f2933; } .white { fill: #ffffff; stroke: #1f2933; }
"""
"""What all documents share."""


def number(value: float) -> str:
    """A coordinate to a tenth, without a zero behind the point or a minus before zero."""
    shown = f"{value:.1f}".removesuffix(".0")
    return "0" if shown == "-0" else shown


def clean(words: str) -> str:
    """A text as XML may contain it."""
    return escape("".join(c if c.isprintable() else " " for c in words))


def shortened(label: str) -> str:
    """A label as it is drawn."""
    return label if len(label) <= LONGEST else f"{label[: LONGEST - 1]}…"


def hexadecimal(rgba: Iterable[float]) -> str:
    """A colour from 0 to 1 as `#rrggbb`."""
    red, green, blue = (round(255 * min(max(float(c), 0.0), 1.0)) for c in list(rgba)[:3])
    return f"#{red:02x}{green:02x}{blue:02x}"


def millimetres(point: Point) -> Point:
    """A point [m], y upwards, on a page in millimetres."""
    return 1e3 * point[0], -1e3 * point[1]


def page_box(box: Box) -> Box:
    """A box [m], y upwards, on a page in millimetres."""
    return 1e3 * box[0], 1e3 * box[1], -1e3 * box[3], -1e3 * box[2]


def round_length(length: float) -> float:
    """The greatest 1, 2 or 5 times a power of ten that is no greater."""
    power: float = 10.0 ** floor(log10(length))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= length)


def hull(points: NDArray[Any]) -> list[Point]:
    """The convex outline of points (n, 2), against the clock where y is upwards."""
    from shapely import MultiPoint
    from shapely.geometry.polygon import orient

    outline = MultiPoint(points).convex_hull
    around = (
        orient(outline).exterior.coords[:-1] if outline.geom_type == "Polygon" else outline.coords
    )
    return [(float(x), float(y)) for x, y in around]


class Canvas:
    """The `elements` of a drawing, from the ground up."""

    def __init__(self) -> None:
        self.elements: list[str] = []
        self._taken: dict[tuple[int, int], list[Box]] = {}

    # --- the whole -------------------------------------------------------------------------------

    def document(self, title: str, page: Box, style: str, scale: float = 1.0) -> str:
        """The drawing as a file; `scale`: pixels to a unit of the page."""
        wide, tall = page[1] - page[0], page[3] - page[2]
        shown = " ".join(map(number, (page[0], page[2], wide, tall)))
        ground = Canvas()
        ground.rectangle(page, "paper")
        lines = (
            '<?xml version="1.0" encoding="UTF-8"?>',
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{wide * scale:.0f}"'
            f' height="{tall * scale:.0f}" viewBox="{shown}">',
            f"<title>{clean(title)}</title>",
            f"<style>{STYLE}{style}</style>",
            *ground.elements,
            *self.elements,
            "</svg>",
        )
        return "".join(f"{line}\n" for line in lines)

    def embedded(self, style: str, page: Box, **attributes: Any) -> str:
        """The drawing as an element of a page."""
        shown = " ".join(map(number, (page[0], page[2], page[1] - page[0], page[3] - page[2])))
        head = _attributes({"class": style, "viewBox": shown, "role": "img", **attributes})
        return f"<svg{head}>{''.join(self.elements)}</svg>"

    @contextmanager
    def group(self, style: str = "", **attributes: Any) -> Iterator[None]:
        """What is drawn meanwhile is a group."""
        self.elements.append(f"<g{_attributes({'class': style, **attributes})}>")
        yield
        self.elements.append("</g>")

    def add(
        self, tag: str, style: str, words: str = "", title: str = "", **attributes: Any
    ) -> None:
        """An element with words in it, a tooltip, and attributes (`data_robot` for
        `data-robot`)."""
        head = f"{tag}{_attributes({**attributes, 'class': style})}"
        inside = clean(words) + (f"<title>{clean(title)}</title>" if title else "")
        self.elements.append(f"<{head}>{inside}</{tag}>" if inside else f"<{head}/>")

    # --- shapes ----------------------------------------------------------------------------------

    def rectangle(self, box: Box, style: str, radius: float = 0.0, **attributes: Any) -> None:
        """A box, with round corners."""
        wide, tall, round_ = box[1] - box[0], box[3] - box[2], radius or None
        place: dict[str, Any] = {"x": box[0], "y": box[2], "width": wide, "height": tall}
        self.add("rect", style, **place, rx=round_, **attributes)

    def line(self, style: str, *points: Point) -> None:
        """A line through points."""
        self.add("path", style, d=_way(points))

    def loops(self, rings: Iterable[Sequence[Point]], style: str, title: str = "") -> None:
        """An area with these edges."""
        self.add("path", style, title=title, d="".join(f"{_way(ring)}Z" for ring in rings))

    def circle(self, at: Point, radius: float, style: str, **attributes: Any) -> None:
        """A circle."""
        self.add("circle", style, cx=at[0], cy=at[1], r=radius, **attributes)

    def polygon(self, points: Iterable[Point], style: str, **attributes: Any) -> None:
        """A polygon."""
        corners = " ".join(f"{number(x)},{number(y)}" for x, y in points)
        self.add("polygon", style, points=corners, **attributes)

    def head(self, tip: Point, foot: Point, half: float, style: str) -> None:
        """An arrowhead from the middle of its foot, twice `half` wide, to its tip."""
        u, v = (half * c for c in _direction(foot, tip))
        self.polygon((tip, (foot[0] - v, foot[1] + u), (foot[0] + v, foot[1] - u)), style)

    def arrow(
        self, start: Point, end: Point, styles: tuple[str, str], head: Point, short: float = 0.0
    ) -> None:
        """A line with a head, so long and half so wide, that ends `short` of the end; the `styles`
        of both."""
        u, v = _direction(start, end)
        tip = end[0] - short * u, end[1] - short * v
        foot = tip[0] - head[0] * u, tip[1] - head[0] * v
        self.line(styles[0], start, foot)
        self.head(tip, foot, head[1], styles[1])

    def curved_arrow(
        self, points: Sequence[Point], styles: tuple[str, str], head: Point, short: float = 0.0
    ) -> None:
        """A smooth line through points to the right, level at both ends, with a head, so long and
        half so wide, that ends `short` of the last; the `styles` of both. Labels are kept off
        it."""
        end = points[-1]
        tip, foot = (end[0] - short, end[1]), (end[0] - short - head[0], end[1])
        line = [*points[:-1], foot]
        slopes = _slopes(line)
        way = f"M{number(line[0][0])} {number(line[0][1])}"
        for (a, b), (m, n) in zip(pairwise(line), pairwise(slopes), strict=True):
            third = (b[0] - a[0]) / 3
            bends = (a[0] + third, a[1] + m * third), (b[0] - third, b[1] - n * third), b
            way += "C" + " ".join(f"{number(x)} {number(y)}" for x, y in bends)
            self._block_between(a, b, m, n)
        self.add("path", styles[0], d=way)
        self.head(tip, foot, head[1], styles[1])

    def _block_between(self, a: Point, b: Point, m: float, n: float) -> None:
        """Keep labels off a cubic between two points, of these slopes there."""
        wide, rise = b[0] - a[0], b[1] - a[1]
        steps = max(1, ceil(hypot(wide, rise) / BLOT))
        for step in range(steps + 1):
            t = step / steps
            y = a[1] + rise * t * t * (3 - 2 * t)
            y += wide * t * (1 - t) * (m * (1 - t) - n * t)
            x = a[0] + wide * t
            self.block((x - BLOT / 2, x + BLOT / 2, y - BLOT / 2, y + BLOT / 2))

    # --- words -----------------------------------------------------------------------------------

    def text(
        self,
        at: Point,
        words: str,
        size: float,
        style: str = "",
        anchor: str = "start",
        **attributes: Any,
    ) -> None:
        """A line of text whose middle height is at a point."""
        place: dict[str, Any] = {"x": at[0], "y": at[1] + 0.35 * size, "font_size": size}
        held = anchor if anchor != "start" else None
        self.add("text", style, words, **place, text_anchor=held, **attributes)

    def label(self, at: Point, words: str, size: float, style: str = "") -> None:
        """A centred text, cut if it is long, with the whole of it as a tooltip."""
        shown = shortened(words)
        self.text(at, shown, size, style, "middle", title="" if shown == words else words)

    def block(self, box: Box) -> None:
        """Keep labels off a box."""
        for key in _cells(box):
            self._taken.setdefault(key, []).append(box)

    def place(self, at: Point, words: str, size: float, off: float, style: str) -> Point:
        """A label about `off` away from a point, where it covers least of what is blocked; gives
        its middle. A grid of cells keeps it near linear."""
        half = len(shortened(words)) * size * LETTER / 2, size / 2
        return self.place_at(list(_around(at, half, off)), words, size, style)

    def place_at(self, middles: Sequence[Point], words: str, size: float, style: str = "") -> Point:
        """A label at the first of points at which it covers least of what is blocked; gives its
        middle."""
        half = len(shortened(words)) * size * LETTER / 2, size / 2
        hidden = [round(self._hidden(_about(middle, half)), 6) for middle in middles]
        middle = middles[hidden.index(min(hidden))]
        self.block(_about(middle, half))
        self.label(middle, words, size, style)
        return middle

    def _hidden(self, box: Box) -> float:
        """How much of a box is blocked."""
        blocked = {other for key in _cells(box) for other in self._taken.get(key, ())}
        return sum(
            max(0.0, min(box[1], b[1]) - max(box[0], b[0]))
            * max(0.0, min(box[3], b[3]) - max(box[2], b[2]))
            for b in sorted(blocked)
        )

    # --- signs -----------------------------------------------------------------------------------

    def scale_bar(self, at: Point, most: float, size: float, scale: float = 1.0) -> None:
        """Five steps of a round length from a point, `most` long, with letters of a size; `scale`:
        units of the page to a millimetre."""
        step = round_length(most / 5 / scale)
        for n in range(5):
            left, right = (at[0] + k * step * scale for k in (n, n + 1))
            box = left, right, at[1] - 0.29 * size, at[1] + 0.29 * size
            self.rectangle(box, "white" if n % 2 else "black")
        whole = 5 * step
        words = f"{whole / 1e3:g} m" if whole >= 100 else f"{whole:g} mm"
        for x, shown in ((0.0, "0"), (whole * scale, words)):
            self.text((at[0] + x, at[1] + 1.14 * size), shown, size, "measure", "middle")

    def legend(
        self, entries: Iterable[tuple[str, str]], at: Point, right: float, unit: float
    ) -> float:
        """Samples of styles with what they stand for (style, words), from a point on, as many to a
        row as there is room for up to `right`, in multiples of a unit; gives y below them."""
        (x, y), half = at, 0.4 * unit
        for style, words in entries:
            needed = (1.5 + 0.7 * LETTER * len(words)) * unit
            if x > at[0] and x + needed > right:
                x, y = at[0], y + 1.2 * unit
            if style in LINES:
                self.line(style, (x, y), (x + 2 * half, y))
            elif style in DISCS:
                self.circle((x + half, y), half, style)
            else:
                self.rectangle((x, x + 2 * half, y - half, y + half), style)
            self.text((x + 1.2 * unit, y), words, 0.7 * unit)
            x += needed + 1.5 * unit
        return y + 1.2 * unit


def _attributes(attributes: dict[str, object]) -> str:
    """Attributes in their order; those that are None, or no style, are left out."""
    shown = {
        name.replace("_", "-"): number(value) if isinstance(value, float) else str(value)
        for name, value in attributes.items()
        if value is not None and (name, value) != ("class", "")
    }
    return "".join(f" {name}={quoteattr(value)}" for name, value in shown.items())


def _way(points: Sequence[Point]) -> str:
    return "M" + "L".join(f"{number(x)} {number(y)}" for x, y in points)


def _slopes(points: Sequence[Point]) -> list[float]:
    """Slopes of a smooth line at points to the right, by which it goes up and down only where they
    do (Fritsch and Butland 1984); level at both ends."""
    secants = [(b[1] - a[1]) / max(b[0] - a[0], 1e-9) for a, b in pairwise(points)]
    inner = [2 * s * t / (s + t) if s * t > 0 else 0.0 for s, t in pairwise(secants)]
    return [0.0, *inner, 0.0]


def _direction(start: Point, end: Point) -> Point:
    """The unit vector from one point to another."""
    length = max(hypot(end[0] - start[0], end[1] - start[1]), 1e-9)
    return (end[0] - start[0]) / length, (end[1] - start[1]) / length


def _cells(box: Box) -> Iterator[tuple[int, int]]:
    first, last, top, bottom = (int(side // CELL) for side in box)
    return ((i, j) for i in range(first, last + 1) for j in range(top, bottom + 1))


def _about(middle: Point, half: Point) -> Box:
    return middle[0] - half[0], middle[0] + half[0], middle[1] - half[1], middle[1] + half[1]


def _around(at: Point, half: Point, off: float) -> Iterator[Point]:
    for reach in (1.0, 1.8, 2.8):
        for i, j in DIRECTIONS:
            yield at[0] + i * (half[0] + off * reach), at[1] + j * (half[1] + off * reach)
