"""Pictures of blocked operations as SVG: from above and from the side, where two parts are deepest
in each other. The last input comes across the sheet in both views. The same product gives the same
bytes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from factory.compiler.mating.findings import Mating, Matings
from factory.export.part_view import PartView, bodies_of
from factory.geometry.meshes import Array
from factory.geometry.solids import Product
from factory.support.canvas import Canvas, shortened

WIDTH, VIEWS, EDGE, HEAD, GAP, FOOT = 900.0, 640.0, 50.0, 150.0, 74.0, 92.0
"""Of the sheet: the width of a view and height of both together, the margin, the room for
the title, between the views and below them."""

ROOM = 0.2
"""Around what clashes at least so much of its length is shown."""

SMALL = 14.0
"""A clash that is drawn smaller than this gets a ring around it."""

UNIT = 21.4
"""What the sizes of the legend are multiples of."""

STYLE = """
.view { fill: #fbfbfa; stroke: #cbd2d9; stroke-width: 1.5; }
path { stroke-linejoin: round; fill-rule: evenodd; }
.standing { fill: #cfd9e6; stroke: #8795a8; stroke-width: 1; fill-opacity: 0.55; }
.coming { fill: #fae3b0; stroke: #c9a24d; stroke-width: 1; fill-opacity: 0.55; }
.struck { fill: #6f9fd8; stroke: #274f82; stroke-width: 2; fill-opacity: 0.7; }
.striking { fill: #f2a73d; stroke: #8f5a0c; stroke-width: 2; fill-opacity: 0.7; }
.place { fill: none; stroke: #8f5a0c; stroke-width: 1.6; stroke-dasharray: 6 4; }
.clash { fill: #d3122a; stroke: #8e0717; stroke-width: 1.5; }
.ring { fill: none; stroke: #d3122a; stroke-width: 3; }
.tip { fill: #323f4b; } .shaft { fill: none; stroke: #323f4b; stroke-width: 5; }
.name { stroke: #ffffff; stroke-width: 4; paint-order: stroke; font-weight: bold; }
"""


def picture_names(blocked: Sequence[Mating]) -> list[str]:
    """A file name for each: numbered, so that no two are the same, with what of the label is safe
    in a name."""
    safe = ("".join(c if c.isalnum() or c in "-_." else "_" for c in m.label) for m in blocked)
    return [f"clash-{n:03d}-{name[:40]}.svg" for n, name in enumerate(safe, start=1)]


def pictures(folder: Path, matings: Matings, product: Product) -> dict[Path, bytes]:
    """The files to write: a picture of every blocked operation."""
    blocked = matings.of_kind("blocked")
    return {
        folder / name: draw(mating, matings, product).encode()
        for name, mating in zip(picture_names(blocked), blocked, strict=True)
    }


def draw(mating: Mating, matings: Matings, product: Product) -> str:
    """The picture of one blocked operation."""
    return _Picture(mating, matings, product).text()


class _Picture:
    """Draws it on a canvas. The parts `striking`, on its way, and `struck` clash after a `shift`
    (3,) [m] of the first from its place."""

    def __init__(self, mating: Mating, matings: Matings, product: Product) -> None:
        self.mating, self.parts, self.product = mating, matings.parts, product
        self.clash = mating.clashes[0]
        self.side, self.axis = mating.approach.sides[0], mating.approach.axis
        one, other = self.clash.parts
        ours = one in self.parts[mating.inputs[-1]]
        self.striking, self.struck = (one, other) if ours else (other, one)
        self.shift = np.zeros(3)
        self.shift[self.axis] = self.side * self.clash.shift
        self.canvas = Canvas()

    def text(self) -> str:
        """The document."""
        self._title()
        views = self._views()
        for view in views:
            with self.canvas.group(id=view.name.split()[-1]):
                self._view(view)
        y = views[-1].box[3] + FOOT - 62
        self.canvas.scale_bar((EDGE, y - 8), WIDTH / 6, 15, views[0].scale / 1e3)
        standing, coming = self.mating.inputs[0], self.mating.inputs[-1]
        entries = [("struck", "stands"), ("striking", "comes"), ("place", "its place")]
        entries += [("clash", "in both"), ("standing", shortened(standing))]
        entries += [("coming", shortened(coming))]
        below = self.canvas.legend(entries, (EDGE, y + 34), EDGE + WIDTH, UNIT)
        page = 0.0, 2 * EDGE + WIDTH, 0.0, below + 2
        return self.canvas.document(f"{self.mating.label}: blocked", page, STYLE)

    def _title(self) -> None:
        clash, more = self.clash, len(self.mating.clashes) - 1
        label, coming = shortened(self.mating.label), shortened(self.mating.inputs[-1])
        title = f"{label} is blocked: {coming} cannot come to its place"
        self.canvas.text((EDGE, 34), title, 24, "h")
        pair = f"{shortened(self.striking)} and {shortened(self.struck)}"
        words = f"{pair} pass through each other, {millimetres(clash.depth)} mm deep"
        words += f", {millimetres(clash.shift)} mm before the end"
        self.canvas.text((EDGE, 66), words, 17)
        if more:
            pairs = "another pair clashes" if more == 1 else f"{more} other pairs clash"
            self.canvas.text((EDGE, 89), f"{pairs} on the way", 17, "grey")

    def _views(self) -> list[PartView]:
        """Plan and side view, one below the other, of the box about the two parts, where they clash
        and finished; for what comes along y the sheet's up is -x."""
        solids = self.product.solids
        struck, striking = solids[self.struck], solids[self.striking]
        low = np.min([struck.low, striking.low, striking.low + self.shift], axis=0)
        high = np.max([struck.high, striking.high, striking.high + self.shift], axis=0)
        room = ROOM * float((high - low).max())
        corners = np.stack([low - room, high + room])
        x, y, z = np.eye(3)
        across, up = (x, y) if self.axis == 0 else (y, -x)
        frames = {"seen from above": [across, up], "seen from the side": [across, z]}
        flat = {name: corners @ np.stack(axes).T for name, axes in frames.items()}
        spans = [np.ptp(ends, axis=0) for ends in flat.values()]
        scale = float(min(WIDTH / spans[0][0], VIEWS / (spans[0][1] + spans[1][1])))
        found, top = [], HEAD
        for (name, axes), span in zip(frames.items(), spans, strict=True):
            beside = np.array([(WIDTH / scale - span[0]) / 2, 0.0])
            box = EDGE, EDGE + WIDTH, top, top + float(span[1]) * scale
            ends = flat[name].min(axis=0) - beside, flat[name].max(axis=0) + beside
            found.append(PartView(name, np.stack(axes), *ends, scale, box))
            top = box[3] + GAP
        return found

    def _view(self, view: PartView) -> None:
        """The parts, those farther away first, the two that clash on top, and how deep they are in
        each other."""
        self.canvas.rectangle(view.box, "view")
        solids, here = self.product.solids, np.zeros(3)
        struck = view.seen(self.product, self.struck)
        striking = view.seen(self.product, self.striking, self.shift)
        for number, style, shift in ((0, "standing", here), (-1, "coming", self.shift)):
            labels = self.parts[self.mating.inputs[number]]
            for name in sorted(labels, key=lambda n: view.nearness(solids[n])):
                if name not in (self.struck, self.striking):
                    view.area(self.canvas, view.seen(self.product, name, shift), style, name)
        view.area(self.canvas, struck, "struck", self.struck)
        view.area(self.canvas, striking, "striking", self.striking)
        view.area(self.canvas, view.seen(self.product, self.striking), "place")
        x, y = (view.box[0] + view.box[1]) / 2, (view.box[2] + view.box[3]) / 2
        overlap = self._overlap(view)
        if not overlap.is_empty:
            view.area(self.canvas, overlap, "clash")
            ((x, y),) = view.points(np.array(overlap.centroid.coords))
            left, low, right, high = overlap.bounds
            if max(right - left, high - low) * view.scale < SMALL:
                self.canvas.circle((x, y), SMALL, "ring")
        self.canvas.block((x - 2 * SMALL, x + 2 * SMALL, y - 2 * SMALL, y + 2 * SMALL))
        for label, mine, other in (
            (self.struck, struck, striking),
            (self.striking, striking, struck),
        ):
            alone = mine.difference(other)
            seen = (mine if alone.is_empty else alone).representative_point()
            (at,) = view.points(np.array(seen.coords))
            self.canvas.place(at, label, 17.0, 14.0, "name")
        self._approach(view)

    def _approach(self, view: PartView) -> None:
        """An arrow the way the last input comes, above the view."""
        left, right, y = view.box[0], view.box[1], view.box[2] - 18.0
        middle = (left + right) / 2
        ends = (middle + self.side * 65.0, y), (middle - self.side * 45.0, y)
        self.canvas.arrow(*ends, ("shaft", "tip"), (18.0, 10.0))
        self.canvas.text((left, y), view.name, 16, "grey")
        axis, sign = "xy"[self.axis], "+" if self.side > 0 else "-"
        self.canvas.text((right, y), f"along {axis}, from {sign}{axis}", 16, "grey", "end")

    def _overlap(self, view: PartView) -> Any:
        """What both parts take up, as it is seen [m]."""
        from shapely import MultiPoint, union_all

        common = (
            _common(mine + self.shift, other)
            for mine in bodies_of(self.product, self.striking)
            for other in bodies_of(self.product, self.struck)
        )
        seen = (corners @ view.axes.T for corners in common if corners is not None)
        return union_all([MultiPoint(corners).convex_hull for corners in seen])


def millimetres(length: float) -> str:
    """A length in millimetres, to a hundredth."""
    return f"{length * 1e3:.2f}"


def _common(one: Array, other: Array) -> Array | None:
    """The corners (n, 3) of what two convex bodies share; None if they do not overlap."""
    from scipy.optimize import linprog
    from scipy.spatial import ConvexHull, HalfspaceIntersection, QhullError

    if (one.max(axis=0) <= other.min(axis=0)).any() or (other.max(axis=0) <= one.min(axis=0)).any():
        return None
    try:
        spaces = np.concatenate([ConvexHull(body).equations for body in (one, other)])
        scale = 1e3
        table = np.column_stack([spaces[:, :3], np.ones(len(spaces))])
        bounds = [(None, None)] * 3 + [(0, None)]
        inner = linprog([0, 0, 0, -1], table, -spaces[:, 3] * scale, bounds=bounds)
        if inner.status != 0 or inner.x[3] < 1e-6:
            return None
        spaces[:, 3] *= scale
        return np.asarray(HalfspaceIntersection(spaces, inner.x[:3]).intersections) / scale
    except QhullError:
        return None
