"""Pictures of sub-assemblies that no hand can hold as SVG: for each kind of hand its nearest miss
with the obstacles, from the side, and all places that were tried, face on. The robot heads to the
right in the side view."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from factory.api import NoGrip, Product
from factory.apps.drawing.canvas import shortened
from factory.apps.exports.product_view import EDGE, ROW, PartView, ViewSheet, picture_names
from factory.floor.layout.hands.misses import Miss
from factory.support.arrays import Array

HEAD, GAP, INDENT = 92.0, 108.0, 150.0
"""Height of the title, height of the words above a row of views, indentation of these."""

ROOM = 0.3
"""Margin around the sub-assembly, as a share of its length."""

DOT, RING = 2.4, 9.0
"""Radii of a place that was tried, and of the ring around the nearest miss."""

LINE = 112
"""Greatest number of letters in a line of words."""

STYLE = """
.beside { fill: #d9dde3; stroke: #a3adba; stroke-width: 1; fill-opacity: 0.4; }
.held { fill: #6f9fd8; stroke: #274f82; stroke-width: 1.5; fill-opacity: 0.6; }
.obstacle { fill: #f2a73d; stroke: #8f5a0c; stroke-width: 1.5; fill-opacity: 0.45; }
.hand { fill: #3e4c59; stroke: #1f2933; stroke-width: 1; fill-opacity: 0.85; }
.way { fill: #d3122a; stroke: #d3122a; stroke-width: 1; fill-opacity: 0.1;
  stroke-dasharray: 5 4; }
.met { fill: #d3122a; stroke: #8e0717; stroke-width: 1; fill-opacity: 0.6; }
.tried { fill: #1f2933; stroke: #ffffff; stroke-width: 0.8; }
.nearest { fill: none; stroke: #d3122a; stroke-width: 3; }
"""


def pictures(folder: Path, grips: Sequence[NoGrip], product: Product) -> dict[Path, bytes]:
    """The files to write: a picture of everything that no hand can hold."""
    names = picture_names("grip", (grip.label for grip in grips))
    return {
        folder / name: _GripSheet(grip, product).text().encode()
        for name, grip in zip(names, grips, strict=True)
    }


class _GripSheet(ViewSheet):
    """A row of two views for each kind of hand."""

    def __init__(self, grip: NoGrip, product: Product) -> None:
        solids = [product.solids[part] for part in grip.parts]
        low = np.min([solid.low for solid in solids], axis=0)
        high = np.max([solid.high for solid in solids], axis=0)
        super().__init__(product, low, high, ROOM)
        self.grip = grip

    def text(self) -> str:
        """The document."""
        label = self.grip.label
        self.canvas.text((EDGE, 34), f"No hand can hold {shortened(label)}", 24, "h")
        words = "would carry it; nearest miss of each kind of hand, with the obstacles"
        self.canvas.text((EDGE, 66), f"{self.grip.robot} {words}", 17)
        y = HEAD
        for miss in self.grip.misses:
            y = self._row(miss, y)
        entries = [
            ("held", shortened(label)),
            ("obstacle", "obstacle"),
            ("beside", "other parts"),
            ("hand", "hand"),
            ("way", "path of the hand or of the obstacle"),
            ("met", "overlap"),
            ("tried", "place tried"),
        ]
        return self.document(f"{label}: no hand can hold it", y, entries, STYLE)

    def _row(self, miss: Miss, y: float) -> float:
        """The words and views of one kind of hand; returns the height below them."""
        kind, canvas = f"from {miss.kind}", self.canvas
        canvas.text((EDGE, y + 22), kind.capitalize(), 19, "h")
        if miss.at is None:
            canvas.text((EDGE + INDENT, y + 22), "no place for a pad", 17)
            return y + 22 + ROW
        at = ", ".join(f"{c * 1e3:.4g}" for c in miss.at)
        words = f"{len(miss.tried)} places tried, none clear; nearest miss at ({at}) mm"
        canvas.text((EDGE + INDENT, y + 22), f"{words}, where {miss.strength}", 17)
        named = f"obstacles: {', '.join(obstacle.named for obstacle in miss.obstacles)}"
        cut = named if len(named) <= LINE else f"{named[: LINE - 1]}…"
        title = "" if cut == named else named
        canvas.text((EDGE + INDENT, y + 50), cut, 17, title=title)
        u, z = np.array([*miss.heading, 0.0]), np.array([0.0, 0.0, 1.0])
        left = np.cross(z, u)
        faces = {"below": (u, -left), "above": (u, left), "behind": (-left, z)}
        views = [
            self.view("seen from the side", (u, z), 0, y + GAP),
            self.view(f"seen {kind}", faces[miss.kind], 1, y + GAP),
        ]
        self.arrow(views[0], 1, "the robot's direction")
        for view, tried in zip(views, (miss.tried[:0], miss.tried), strict=True):
            with canvas.group(id=f"{miss.kind}-{view.name.split()[-1]}"):
                self._draw(view, miss)
                self._mark(view, miss, tried)
        return max(view.box[3] for view in views) + ROW

    def _draw(self, view: PartView, miss: Miss) -> None:
        """The parts, then the hand, its way and where obstacles overlap it."""
        styles = dict.fromkeys(self.grip.parts, "held") | dict.fromkeys(self.grip.beside, "beside")
        styles |= {part: "obstacle" for part in miss.parts if part in styles}
        for part in self.nearest_last(view, styles):
            self.area(view, self.outline(view, part), styles[part], part)
        pairs = [pair for o in miss.obstacles for pair in zip(o.ways, o.bodies, strict=True)]
        self._boxes(view, [way for way, _ in pairs], "way")
        self._boxes(view, [body for _, body in pairs if np.isinf(body).any()], "way")
        met = [(np.maximum(a[0], b[0]), np.minimum(a[1], b[1])) for a, b in pairs]
        self._boxes(view, [np.array(ends) for ends in met], "met")
        self._boxes(view, [miss.box], "hand")

    def _boxes(self, view: PartView, boxes: Sequence[Array], style: str) -> None:
        """The union of boxes (2, 3), which may be infinite, as far as it is in view."""
        from shapely import box, union_all

        far, shapes = 10.0 * float(self.half.max()), []
        for ends in boxes:
            flat = np.clip(ends, self.middle - far, self.middle + far) @ view.axes.T
            shapes.append(box(*flat.min(axis=0), *flat.max(axis=0)))
        self.area(view, union_all(shapes), style)

    def _mark(self, view: PartView, miss: Miss, tried: Array) -> None:
        """Places that were tried (n, 3), the nearest miss, and the names of the obstacles."""
        circles = [(place, DOT, "tried") for place in view.points(tried @ view.axes.T)]
        (here,) = view.points(np.array([miss.at]) @ view.axes.T)
        for (x, y), radius, style in (*circles, (here, RING, "nearest")):
            self.canvas.circle((x, y), radius, style)
            self.canvas.block((x - radius, x + radius, y - radius, y + radius))
        for part in miss.parts:
            seen = view.inside(self.outline(view, part))
            if not seen.is_empty:
                self.name(view, seen, part)
