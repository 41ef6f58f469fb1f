"""Pictures of blocked operations as SVG: from above and from the side, at the position in which two
parts penetrate each other most. The last input moves along the sheet's horizontal in both views."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from factory.api import Matings, Product
from factory.apps.drawing.canvas import shortened
from factory.apps.exports.product_view import (
    EDGE,
    ROW,
    PartView,
    ViewSheet,
    bodies_of,
    picture_names,
)
from factory.floor.mating.findings import Mating

TOP = 150.0
"""Upper edge of the views."""

ROOM = 0.2
"""Margin around the two parts, as a share of their length."""

SMALL = 14.0
"""An overlap that is drawn smaller than this is circled."""

STYLE = """
.standing { fill: #cfd9e6; stroke: #8795a8; stroke-width: 1; fill-opacity: 0.55; }
.coming { fill: #fae3b0; stroke: #c9a24d; stroke-width: 1; fill-opacity: 0.55; }
.struck { fill: #6f9fd8; stroke: #274f82; stroke-width: 2; fill-opacity: 0.7; }
.striking { fill: #f2a73d; stroke: #8f5a0c; stroke-width: 2; fill-opacity: 0.7; }
.place { fill: none; stroke: #8f5a0c; stroke-width: 1.6; stroke-dasharray: 6 4; }
.clash { fill: #d3122a; stroke: #8e0717; stroke-width: 1.5; }
.ring { fill: none; stroke: #d3122a; stroke-width: 3; }
"""


def pictures(folder: Path, matings: Matings, product: Product) -> dict[Path, bytes]:
    """The files to write: a picture of every blocked operation."""
    blocked = matings.of_kind("blocked")
    names = picture_names("clash", (mating.label for mating in blocked))
    return {
        folder / name: draw(mating, matings, product).encode()
        for name, mating in zip(names, blocked, strict=True)
    }


def draw(mating: Mating, matings: Matings, product: Product) -> str:
    """The picture of one blocked operation."""
    return _ClashSheet(mating, matings, product).text()


class _ClashSheet(ViewSheet):
    """The parts `striking`, which moves, and `struck` overlap most when the first is displaced by
    `shift` (3,) [m] from its place."""

    def __init__(self, mating: Mating, matings: Matings, product: Product) -> None:
        self.mating, self.parts = mating, matings.parts
        self.clash = mating.clashes[0]
        self.side, self.axis = mating.approach.sides[0], mating.approach.axis
        one, other = self.clash.parts
        ours = one in self.parts[mating.inputs[-1]]
        self.striking, self.struck = (one, other) if ours else (other, one)
        self.shift = np.zeros(3)
        self.shift[self.axis] = self.side * self.clash.shift
        struck, striking = product.solids[self.struck], product.solids[self.striking]
        low = np.min([struck.low, striking.low, striking.low + self.shift], axis=0)
        high = np.max([struck.high, striking.high, striking.high + self.shift], axis=0)
        super().__init__(product, low, high, ROOM)

    def text(self) -> str:
        """The document; for a motion along y the plan's vertical is -x."""
        self._title()
        x, y, z = np.eye(3)
        across, up = (x, y) if self.axis == 0 else (y, -x)
        views = [
            self.view("seen from above", (across, up), 0, TOP),
            self.view("seen from the side", (across, z), 1, TOP),
        ]
        for view in views:
            with self.canvas.group(id=view.name.split()[-1]):
                self._draw(view)
        standing, coming = self.mating.inputs[0], self.mating.inputs[-1]
        entries = [("struck", "fixed part"), ("striking", "moving part"), ("place", "its position")]
        entries += [("clash", "overlap"), ("standing", shortened(standing))]
        entries += [("coming", shortened(coming))]
        below = max(view.box[3] for view in views) + ROW
        return self.document(f"{self.mating.label}: blocked", below, entries, STYLE)

    def _title(self) -> None:
        clash, more = self.clash, len(self.mating.clashes) - 1
        label, coming = shortened(self.mating.label), shortened(self.mating.inputs[-1])
        title = f"{label} is blocked: {coming} cannot reach its position"
        self.canvas.text((EDGE, 34), title, 24, "h")
        pair = f"{shortened(self.striking)} and {shortened(self.struck)}"
        words = f"{pair} overlap by {clash.depth * 1e3:.2f} mm"
        self.canvas.text(
            (EDGE, 66), f"{words}, {clash.shift * 1e3:.2f} mm before the final position", 17
        )
        if more:
            pairs = "another pair overlaps" if more == 1 else f"{more} other pairs overlap"
            self.canvas.text((EDGE, 89), f"{pairs} during the motion", 17, "grey")

    def _draw(self, view: PartView) -> None:
        """The other parts, the two that overlap, their overlap, and the direction of motion."""
        for number, style, shift in ((0, "standing", np.zeros(3)), (-1, "coming", self.shift)):
            for label in self.nearest_last(view, self.parts[self.mating.inputs[number]]):
                if label not in (self.struck, self.striking):
                    self.area(view, self.outline(view, label, shift), style, label)
        struck = self.outline(view, self.struck)
        striking = self.outline(view, self.striking, self.shift)
        self.area(view, struck, "struck", self.struck)
        self.area(view, striking, "striking", self.striking)
        self.area(view, self.outline(view, self.striking), "place")
        self._mark(view)
        for label, outline, other in (
            (self.struck, struck, striking),
            (self.striking, striking, struck),
        ):
            alone = outline.difference(other)
            self.name(view, outline if alone.is_empty else alone, label)
        axis, sign = "xy"[self.axis], "+" if self.side > 0 else "-"
        self.arrow(view, -self.side, f"along {axis}, from {sign}{axis}")

    def _mark(self, view: PartView) -> None:
        """The overlap of the two parts; labels keep off it."""
        from shapely import MultiPoint, union_all

        corners = (points for points in self._common() if len(points))
        overlap = union_all([MultiPoint(points @ view.axes.T).convex_hull for points in corners])
        x, y = (view.box[0] + view.box[1]) / 2, (view.box[2] + view.box[3]) / 2
        if not overlap.is_empty:
            self.area(view, overlap, "clash")
            ((x, y),) = view.points(np.array(overlap.centroid.coords))
            left, low, right, high = overlap.bounds
            if max(right - left, high - low) * view.scale < SMALL:
                self.canvas.circle((x, y), SMALL, "ring")
        self.canvas.block((x - 2 * SMALL, x + 2 * SMALL, y - 2 * SMALL, y + 2 * SMALL))

    def _common(self) -> list[Any]:
        """The corners (n, 3) of the intersections of the convex bodies of both parts [m]."""
        from manifold3d import Manifold

        bodies = bodies_of(self.product, self.striking), bodies_of(self.product, self.struck)
        striking = [Manifold.hull_points(body + self.shift) for body in bodies[0]]
        struck = [Manifold.hull_points(body) for body in bodies[1]]
        return [(a ^ b).to_mesh64().vert_properties[:, :3] for a in striking for b in struck]
