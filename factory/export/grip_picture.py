"""Pictures of what no hand can hold as SVG: for each kind of hand its nearest miss with what is in
its way, from the side, and all places that were tried, face on. The robot heads to the right where
that is seen. The same product gives the same bytes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from factory.export.part_view import PartView
from factory.geometry.meshes import Array
from factory.geometry.solids import Product
from factory.layout.hands.misses import Miss, NoGrip
from factory.support.canvas import Canvas, Point, shortened

WIDTH, TALL, EDGE, HEAD, GAP, BETWEEN = 560.0, 330.0, 50.0, 92.0, 108.0, 40.0
"""Of the sheet: the width of a view and its height at most, the margin, the room for the title,
above a row of views, and between two."""

ROOM = 0.3
"""Around the sub-assembly so much of its length is shown."""

ROW = 36.0
"""Room below a row of views."""

DOT, RING = 2.4, 9.0
"""Radii of a place that was tried, and of the ring around the nearest miss."""

UNIT = 21.4
"""What the sizes of the legend are multiples of."""

LINE = 112
"""The most letters of a line of words."""

WAYS = {"below": "from below", "behind": "from behind", "above": "from above"}
"""From where a kind of hand holds."""

STYLE = """
.view { fill: #fbfbfa; stroke: #cbd2d9; stroke-width: 1.5; }
path { stroke-linejoin: round; fill-rule: evenodd; }
.beside { fill: #d9dde3; stroke: #a3adba; stroke-width: 1; fill-opacity: 0.4; }
.held { fill: #6f9fd8; stroke: #274f82; stroke-width: 1.5; fill-opacity: 0.6; }
.obstacle { fill: #f2a73d; stroke: #8f5a0c; stroke-width: 1.5; fill-opacity: 0.45; }
.hand { fill: #3e4c59; stroke: #1f2933; stroke-width: 1; fill-opacity: 0.85; }
.way { fill: #d3122a; stroke: #d3122a; stroke-width: 1; fill-opacity: 0.1;
  stroke-dasharray: 5 4; }
.met { fill: #d3122a; stroke: #8e0717; stroke-width: 1; fill-opacity: 0.6; }
.tried { fill: #1f2933; stroke: #ffffff; stroke-width: 0.8; }
.nearest { fill: none; stroke: #d3122a; stroke-width: 3; }
.name { stroke: #ffffff; stroke-width: 4; paint-order: stroke; font-weight: bold; }
"""


def picture_names(found: Sequence[NoGrip]) -> list[str]:
    """A file name for each: numbered, so that no two are the same, with what of the label is safe
    in a name."""
    safe = ("".join(c if c.isalnum() or c in "-_." else "_" for c in g.label) for g in found)
    return [f"grip-{n:03d}-{name[:40]}.svg" for n, name in enumerate(safe, start=1)]


def pictures(folder: Path, found: Sequence[NoGrip], product: Product) -> dict[Path, bytes]:
    """The files to write: a picture of everything that no hand can hold."""
    return {
        folder / name: draw(grip, product).encode()
        for name, grip in zip(picture_names(found), found, strict=True)
    }


def draw(grip: NoGrip, product: Product) -> str:
    """The picture of one sub-assembly that no hand can hold."""
    return _Picture(grip, product).text()


class _Picture:
    """Draws it on a canvas: a row of two views for each kind of hand, all at one scale [1/m]."""

    def __init__(self, grip: NoGrip, product: Product) -> None:
        self.grip, self.product, self.canvas = grip, product, Canvas()
        solids = [product.solids[part] for part in grip.parts]
        low = np.min([solid.low for solid in solids], axis=0)
        high = np.max([solid.high for solid in solids], axis=0)
        self.middle, span = (low + high) / 2, high - low
        room = ROOM * float(span.max())
        self.half = span / 2 + room
        level = 2 * float(self.half[:2].max())
        self.scale = min(WIDTH / level, TALL / max(2 * float(self.half[2]), level))

    def text(self) -> str:
        """The document."""
        grip, canvas = self.grip, self.canvas
        canvas.text((EDGE, 34), f"No hand can hold {shortened(grip.label)}", 24, "h")
        words = f"{grip.robot} would carry it; the nearest miss of each kind of hand, with what is"
        canvas.text((EDGE, 66), f"{words} in its way", 17)
        y = HEAD
        for miss in grip.misses:
            y = self._row(miss, y)
        canvas.scale_bar((EDGE, y), WIDTH / 3, 15, self.scale / 1e3)
        entries = [("held", shortened(grip.label)), ("obstacle", "in the way")]
        entries += [
            ("beside", "other parts"),
            ("hand", "hand"),
            ("way", "way of the hand, or of the part"),
        ]
        entries += [("met", "in both"), ("tried", "place tried")]
        right = EDGE + 2 * WIDTH + BETWEEN
        below = canvas.legend(entries, (EDGE, y + 48), right, UNIT)
        page = 0.0, EDGE + right, 0.0, below + 2
        return canvas.document(f"{grip.label}: no hand can hold it", page, STYLE)

    def _row(self, miss: Miss, y: float) -> float:
        """The words and views of one kind; gives y below them."""
        kind = WAYS[miss.kind]
        self.canvas.text((EDGE, y + 22), kind.capitalize(), 19, "h")
        if miss.at is None:
            self.canvas.text((EDGE + 150, y + 22), "there is no place for a pad", 17)
            return y + 22 + ROW
        at = ", ".join(f"{c * 1e3:.4g}" for c in miss.at)
        words = f"{len(miss.tried)} places tried, none clear; nearest miss at ({at}) mm"
        words += f", where {miss.strength}"
        self.canvas.text((EDGE + 150, y + 22), words, 17)
        named = f"in its way: {', '.join(found.named for found in miss.obstacles)}"
        cut = named if len(named) <= LINE else f"{named[: LINE - 1]}…"
        self.canvas.text((EDGE + 150, y + 50), cut, 17, title="" if cut == named else named)
        u, z = np.array([*miss.heading, 0.0]), np.array([0.0, 0.0, 1.0])
        left = np.cross(z, u)
        faces = {"below": (u, -left), "above": (u, left), "behind": (-left, z)}
        top = y + GAP
        views = [
            self._framed("seen from the side", (u, z), EDGE, top),
            self._framed(f"seen {kind}", faces[miss.kind], EDGE + WIDTH + BETWEEN, top),
        ]
        for view, tried in zip(views, (miss.tried[:0], miss.tried), strict=True):
            with self.canvas.group(id=f"{miss.kind}-{view.name.split()[-1]}"):
                self._view(view, miss)
                self._marks(view, miss, tried)
        self._arrow(views[0])
        return max(view.box[3] for view in views) + ROW

    def _framed(self, name: str, axes: tuple[Array, Array], left: float, top: float) -> PartView:
        """A view of the sub-assembly with room around it."""
        both = np.stack(axes)
        middle, half = both @ self.middle, np.abs(both) @ self.half
        half[0] = WIDTH / 2 / self.scale
        box = left, left + WIDTH, top, top + 2 * float(half[1]) * self.scale
        return PartView(name, both, middle - half, middle + half, self.scale, box)

    def _view(self, view: PartView, miss: Miss) -> None:
        """The parts, those farther away first, then the hand, its way and what it meets there."""
        canvas, solids = self.canvas, self.product.solids
        canvas.rectangle(view.box, "view")
        canvas.text((view.box[0], view.box[2] - 16), view.name, 16, "grey")
        held, meets = frozenset(self.grip.parts), frozenset(miss.parts)
        shown = sorted(
            (*self.grip.parts, *self.grip.beside), key=lambda n: float(view.nearness(solids[n]))
        )
        for part in shown:
            style = "held" if part in held else "obstacle" if part in meets else "beside"
            if part in held & meets:
                style = "obstacle"
            view.area(canvas, view.seen(self.product, part), style, part)
        pairs = [pair for o in miss.obstacles for pair in zip(o.ways, o.bodies, strict=True)]
        self._boxed(view, [way for way, _ in pairs], "way")
        self._boxed(view, [body for _, body in pairs if np.isinf(body).any()], "way")
        lows = (np.maximum(way[0], body[0]) for way, body in pairs)
        highs = (np.minimum(way[1], body[1]) for way, body in pairs)
        self._boxed(view, [np.array(both) for both in zip(lows, highs, strict=True)], "met")
        self._boxed(view, [miss.box], "hand")

    def _boxed(self, view: PartView, boxes: Sequence[Array], style: str) -> None:
        """What boxes (2, 3), which may be endless, cover together, as far as it is in view."""
        from shapely import box, union_all

        far, shapes = 10.0 * float(self.half.max()), []
        for ends in boxes:
            flat = np.clip(ends, self.middle - far, self.middle + far) @ view.axes.T
            shapes.append(box(*flat.min(axis=0), *flat.max(axis=0)))
        view.area(self.canvas, union_all(shapes), style)

    def _marks(self, view: PartView, miss: Miss, tried: Array) -> None:
        """Places that were tried (n, 3), the nearest miss, and the names of what is in its way."""
        from shapely import box

        canvas, found = self.canvas, [(place, DOT) for place in view.points(tried @ view.axes.T)]
        for place, radius in found:
            canvas.circle(place, radius, "tried")
        (here,) = view.points(np.array([miss.at]) @ view.axes.T)
        canvas.circle(here, RING, "nearest")
        for (x, y), radius in dict.fromkeys([*found, (here, RING)]):
            canvas.block((x - radius, x + radius, y - radius, y + radius))
        for part in miss.parts:
            seen = view.seen(self.product, part).intersection(box(*view.low, *view.high))
            if not seen.is_empty:
                (at,) = view.points(np.array(seen.representative_point().coords))
                canvas.place(at, part, 16.0, 12.0, "name")

    def _arrow(self, view: PartView) -> None:
        """Which way the robot heads, above a view from the side."""
        right, y = view.box[1], view.box[2] - 16
        ends: tuple[Point, Point] = (right - 60.0, y), (right, y)
        self.canvas.arrow(*ends, ("path", "black"), (14.0, 6.0))
        self.canvas.text((right - 72, y), "the robot heads", 16, "grey", "end")
