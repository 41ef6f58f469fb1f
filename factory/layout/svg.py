"""The few elements of SVG that a floor plan takes, as strings; coordinates in millimetres of the
page."""

from __future__ import annotations

from collections.abc import Iterable
from xml.sax.saxutils import escape

from factory.layout.layout import Box, Point2

LONGEST = 20
"""A label of more letters is cut; the whole of it is shown as a tooltip."""


def number(value: float) -> str:
    """A coordinate to a tenth of a millimetre, without a zero behind the point or a minus before
    zero."""
    shown = f"{value:.1f}".removesuffix(".0")
    return "0" if shown == "-0" else shown


def clean(words: str) -> str:
    """A text as XML may contain it."""
    return escape("".join(c if c.isprintable() else " " for c in words))


def shortened(label: str) -> str:
    """A label as it is drawn."""
    return label if len(label) <= LONGEST else f"{label[: LONGEST - 1]}…"


def text(at: Point2, words: str, size: float, style: str = "", anchor: str = "start") -> str:
    """A line of text whose middle height is at a point."""
    marked = f' class="{style}"' if style else ""
    held = f' text-anchor="{anchor}"' if anchor != "start" else ""
    place = f'x="{number(at[0])}" y="{number(at[1] + 0.35 * size)}" font-size="{number(size)}"'
    return f"<text {place}{held}{marked}>{clean(words)}</text>"


def label(at: Point2, words: str, size: float, style: str) -> str:
    """A centred text, cut if it is long, with the whole of it as a tooltip."""
    shown = shortened(words)
    drawn = text(at, shown, size, style, "middle")
    if shown == words:
        return drawn
    return drawn.replace("</text>", f"<title>{clean(words)}</title></text>")


def rectangle(box: Box, style: str, radius: float = 0.0) -> str:
    """A box (xlo, xhi, ylo, yhi) of the page."""
    corner = f' rx="{number(radius)}"' if radius else ""
    return (
        f'<rect class="{style}" x="{number(box[0])}" y="{number(box[2])}"'
        f' width="{number(box[1] - box[0])}" height="{number(box[3] - box[2])}"{corner}/>'
    )


def line(style: str, *points: Point2) -> str:
    """A line through points."""
    drawn = "L".join(f"{number(x)} {number(y)}" for x, y in points)
    return f'<path class="{style}" d="M{drawn}"/>'


def circle(middle: Point2, radius: float, style: str, extra: str = "", title: str = "") -> str:
    """A circle."""
    place = f'cx="{number(middle[0])}" cy="{number(middle[1])}" r="{number(radius)}"'
    return f'<circle class="{style}" {place}{extra}{_closed("circle", title)}'


def polygon(points: Iterable[Point2], style: str, extra: str = "", title: str = "") -> str:
    """A polygon."""
    corners = " ".join(f"{number(x)},{number(y)}" for x, y in points)
    return f'<polygon class="{style}" points="{corners}"{extra}{_closed("polygon", title)}'


def _closed(tag: str, title: str) -> str:
    return f"><title>{clean(title)}</title></{tag}>" if title else "/>"
