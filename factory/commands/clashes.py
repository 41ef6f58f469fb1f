"""Pictures of blocked operations as SVG: from above and from the side, where two parts are deepest
in each other.

The way the last input comes goes across the sheet in both views. Nothing outside the file is
referred to, and the same product gives the same bytes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import floor, log10
from pathlib import Path
from typing import Any

import numpy as np

from factory.compiler.mating import Mating, Matings
from factory.geometry.meshes import Array
from factory.geometry.solids import Product
from factory.layout.layout import Point2
from factory.layout.lettering import Lettering
from factory.layout.svg import circle, clean, line, number, polygon, rectangle, shortened, text

WIDTH, VIEWS, EDGE, HEAD, GAP, FOOT = 900.0, 640.0, 50.0, 150.0, 74.0, 92.0
"""Of the sheet: the width of a view and height of both together, the margin, the room for
the title, between the views and below them."""

ROOM = 0.2
"""Around what clashes at least so much of its length is shown."""

SMALL = 14.0
"""A clash that is drawn smaller than this gets a ring around it."""

STYLE = """
text { font-family: 'DejaVu Sans', 'Helvetica Neue', Arial, sans-serif; fill: #1f2933; }
.paper { fill: #ffffff; } .view { fill: #fbfbfa; stroke: #cbd2d9; stroke-width: 1.5; }
path { stroke-linejoin: round; fill-rule: evenodd; }
.standing { fill: #cfd9e6; stroke: #8795a8; stroke-width: 1; fill-opacity: 0.55; }
.coming { fill: #fae3b0; stroke: #c9a24d; stroke-width: 1; fill-opacity: 0.55; }
.struck { fill: #6f9fd8; stroke: #274f82; stroke-width: 2; fill-opacity: 0.7; }
.striking { fill: #f2a73d; stroke: #8f5a0c; stroke-width: 2; fill-opacity: 0.7; }
.place { fill: none; stroke: #8f5a0c; stroke-width: 1.6; stroke-dasharray: 6 4; }
.clash { fill: #d3122a; stroke: #8e0717; stroke-width: 1.5; }
.ring { fill: none; stroke: #d3122a; stroke-width: 3; }
.arrow { fill: #323f4b; } .shaft { fill: none; stroke: #323f4b; stroke-width: 5; }
.h { font-weight: bold; } .grey { fill: #52606d; }
.name { stroke: #ffffff; stroke-width: 4; paint-order: stroke; font-weight: bold; }
.black { fill: #1f2933; stroke: #1f2933; } .white { fill: #ffffff; stroke: #1f2933; }
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
    return "".join(f"{element}\n" for element in _Picture(mating, matings, product).elements())


@dataclass(frozen=True, slots=True)
class _View:
    """A projection (3, 2) onto the sheet, what it shows, (low, high) of what is in view [m], and
    where its upper left corner is on the sheet."""

    name: str
    axes: Array
    low: Array
    high: Array
    corner: Point2

    def points(self, flat: Array, scale: float) -> list[Point2]:
        """Projected points (n, 2) on the sheet."""
        x = self.corner[0] + (flat[:, 0] - self.low[0]) * scale
        y = self.corner[1] + (self.high[1] - flat[:, 1]) * scale
        return list(zip(x.tolist(), y.tolist(), strict=True))


class _Picture:
    """The elements of the drawing. In the frame of a view the approach is horizontal."""

    def __init__(self, mating: Mating, matings: Matings, product: Product) -> None:
        self.mating, self.product, self.clash = mating, product, mating.clashes[0]
        self.side, self.axis = mating.approach.sides[0], mating.approach.axis
        self.standing = matings.parts[mating.inputs[0]]
        self.coming = matings.parts[mating.inputs[-1]]
        one, other = self.clash.parts
        self.striking, self.struck = (one, other) if one in set(self.coming) else (other, one)
        self.shift = np.zeros(3)
        self.shift[self.axis] = self.side * self.clash.shift
        self.letters = Lettering()

    def elements(self) -> Iterator[str]:
        """The document."""
        height = max(v.corner[1] + self._size(v)[1] for v in self.views) + FOOT
        width = 2 * EDGE + WIDTH
        yield '<?xml version="1.0" encoding="UTF-8"?>'
        yield (
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}"'
            f' viewBox="0 0 {number(width)} {number(height)}">'
        )
        yield f"<title>{clean(self.mating.label)}: blocked</title>"
        yield f"<style>{STYLE}</style>"
        yield rectangle((0, width, 0, height), "paper")
        yield from self._title()
        for view in self.views:
            yield f'<g id="{view.name.split()[-1]}">'
            yield from self._view(view)
            yield "</g>"
        yield from self._foot(height)
        yield "</svg>"

    # --- the two views ---------------------------------------------------------------------------

    @cached_property
    def frames(self) -> tuple[tuple[str, Array], ...]:
        """Plan and side view; coming along y, the sheet's up is -x."""
        x, y, z = np.eye(3)
        if self.axis == 0:
            return ("seen from above", np.stack([x, y])), ("seen from the side", np.stack([x, z]))
        return ("seen from above", np.stack([y, -x])), ("seen from the side", np.stack([y, z]))

    @cached_property
    def window(self) -> tuple[Array, Array]:
        """The box (3,), (3,) that is shown: about the two parts, where they clash and finished."""
        solids = self.product.solids
        struck, striking = solids[self.struck], solids[self.striking]
        low = np.min([struck.low, striking.low, striking.low + self.shift], axis=0)
        high = np.max([struck.high, striking.high, striking.high + self.shift], axis=0)
        room = ROOM * float((high - low).max())
        return low - room, high + room

    @cached_property
    def scale(self) -> float:
        """Units of the sheet for a metre."""
        spans = [
            np.ptp(np.stack([axes @ w for w in self.window]), axis=0) for _, axes in self.frames
        ]
        return float(min(WIDTH / spans[0][0], VIEWS / (spans[0][1] + spans[1][1])))

    @cached_property
    def views(self) -> list[_View]:
        """Both, one below the other."""
        found, top = [], HEAD
        for name, axes in self.frames:
            ends = np.stack([axes @ w for w in self.window])
            low, high = ends.min(axis=0), ends.max(axis=0)
            beside = (WIDTH / self.scale - (high[0] - low[0])) / 2
            wide = np.array([beside, 0.0])
            view = _View(name, axes, low - wide, high + wide, (EDGE, top))
            found.append(view)
            top += self._size(view)[1] + GAP
        return found

    def _size(self, view: _View) -> Point2:
        width, height = (view.high - view.low) * self.scale
        return float(width), float(height)

    def _view(self, view: _View) -> Iterator[str]:
        """The parts, the two that clash on top, and how deep they are in each other."""
        (x, y), (width, height) = view.corner, self._size(view)
        yield rectangle((x, x + width, y, y + height), "view")
        for label in self._drawn(view, self.standing, self.struck):
            yield from self._part(view, label, "standing")
        for label in self._drawn(view, self.coming, self.striking):
            yield from self._part(view, label, "coming")
        yield from self._part(view, self.struck, "struck")
        yield from self._part(view, self.striking, "striking")
        yield from self._outline(view, self._flat(view, self.striking, np.zeros(3)), "place")
        at = view.corner[0] + width / 2, view.corner[1] + height / 2
        overlap = self._overlap(view)
        yield from self._outline(view, overlap, "clash")
        if not overlap.is_empty:
            middle = np.array([[overlap.centroid.x, overlap.centroid.y]])
            at = view.points(middle, self.scale)[0]
            left, low, right, high = overlap.bounds
            if max(right - left, high - low) * self.scale < SMALL:
                yield circle(at, SMALL, "ring")
        yield from self._lettering(view, at)
        yield from self._approach(view)

    def _drawn(self, view: _View, labels: Sequence[str], but: str) -> list[str]:
        """The parts to draw, those farther away first."""
        depth = np.cross(view.axes[0], view.axes[1])
        solids = self.product.solids
        ordered = sorted(
            labels, key=lambda name: float(depth @ (solids[name].low + solids[name].high))
        )
        return [name for name in ordered if name != but]

    def _part(self, view: _View, label: str, style: str) -> Iterator[str]:
        moved = self.shift if style in ("coming", "striking") else np.zeros(3)
        yield from self._outline(view, self._flat(view, label, moved), style, label)

    def _flat(self, view: _View, label: str, shift: Array) -> Any:
        """A part as it is seen (shapely geometry) [m]."""
        from shapely import MultiPoint, union_all

        bodies = _bodies(self.product, label)
        return union_all([MultiPoint((body + shift) @ view.axes.T).convex_hull for body in bodies])

    def _overlap(self, view: _View) -> Any:
        """What both parts take up, as it is seen [m]."""
        from shapely import MultiPoint, union_all

        common = []
        for mine in _bodies(self.product, self.striking):
            for other in _bodies(self.product, self.struck):
                corners = _common(mine + self.shift, other)
                if corners is not None:
                    common.append(MultiPoint(corners @ view.axes.T).convex_hull)
        return union_all(common)

    def _outline(self, view: _View, shape: Any, style: str, name: str = "") -> Iterator[str]:
        """A geometry as one path, as far as it is in view."""
        from shapely import box

        seen = shape.intersection(box(*view.low, *view.high))
        rings = [
            "M"
            + "L".join(f"{number(x)} {number(y)}" for x, y in view.points(ring, self.scale))
            + "Z"
            for ring in _rings(seen)
        ]
        title = f"><title>{clean(name)}</title></path>" if name else "/>"
        if rings:
            yield f'<path class="{style}" d="{"".join(rings)}"{title}'

    # --- words and signs -------------------------------------------------------------------------

    def _lettering(self, view: _View, at: Point2) -> Iterator[str]:
        """The names of the two parts, each at what is seen of it alone."""
        x, y = at
        self.letters.block((x - 2 * SMALL, x + 2 * SMALL, y - 2 * SMALL, y + 2 * SMALL))
        struck = self._flat(view, self.struck, np.zeros(3))
        striking = self._flat(view, self.striking, self.shift)
        for label, mine, other in (
            (self.struck, struck, striking),
            (self.striking, striking, struck),
        ):
            alone = mine.difference(other)
            place = (mine if alone.is_empty else alone).representative_point()
            middle = view.points(np.array([[place.x, place.y]]), self.scale)[0]
            yield self.letters.place(middle, label, 17.0, 14.0, "name")

    def _approach(self, view: _View) -> Iterator[str]:
        """An arrow the way the last input comes, above the view."""
        (x, y), (width, _) = view.corner, self._size(view)
        tip = x + width / 2 - self.side * 45.0
        tail, at = tip + self.side * 110.0, y - 18.0
        yield line("shaft", (tail, at), (tip + self.side * 12, at))
        head = tip + self.side * 18
        yield polygon(((tip, at), (head, at - 10), (head, at + 10)), "arrow")
        yield text((x, at), view.name, 16, "grey")
        words = f"along {'xy'[self.axis]}, from {'+' if self.side > 0 else '-'}{'xy'[self.axis]}"
        yield text((x + width, at), words, 16, "grey", "end")

    def _title(self) -> Iterator[str]:
        clash, more = self.clash, len(self.mating.clashes) - 1
        label, coming = shortened(self.mating.label), shortened(self.mating.inputs[-1])
        yield text((EDGE, 34), f"{label} is blocked: {coming} cannot come to its place", 24, "h")
        pair = f"{shortened(self.striking)} and {shortened(self.struck)}"
        words = f"{pair} pass through each other, {millimetres(clash.depth)} mm deep"
        yield text((EDGE, 66), f"{words}, {millimetres(clash.shift)} mm before the end", 17)
        if more:
            pairs = "another pair clashes" if more == 1 else f"{more} other pairs clash"
            yield text((EDGE, 89), f"{pairs} on the way", 17, "grey")

    def _foot(self, height: float) -> Iterator[str]:
        """A scale bar and the legend."""
        y = height - 62.0
        step = _round_length(WIDTH / 6 / self.scale)
        for n in range(2):
            start = EDGE + n * step / 2 * self.scale
            yield rectangle(
                (start, start + step / 2 * self.scale, y - 4, y + 4), ("black", "white")[n]
            )
        yield text((EDGE + step * self.scale + 10, y), f"{step * 1e3:g} mm", 16)
        x, y = EDGE, height - 28.0
        for style, words in (
            ("struck", "stands"),
            ("striking", "comes"),
            ("place", "its place"),
            ("clash", "in both"),
            ("standing", shortened(self.mating.inputs[0])),
            ("coming", shortened(self.mating.inputs[-1])),
        ):
            yield rectangle((x, x + 18, y - 8, y + 8), style)
            yield text((x + 26, y), words, 15)
            x += 54 + 9.4 * len(words)


def millimetres(length: float) -> str:
    """A length in millimetres, to a hundredth."""
    return f"{length * 1e3:.2f}"


def _bodies(product: Product, label: str) -> tuple[Array, ...]:
    solid = product.solids[label]
    return solid.pieces or (solid.corners,)


def _rings(shape: Any) -> Iterator[Array]:
    """The rings (n, 2) of all polygons of a geometry."""
    from shapely import get_coordinates, get_parts

    for area in get_parts(shape):
        if area.geom_type == "Polygon" and not area.is_empty:
            for ring in (area.exterior, *area.interiors):
                yield get_coordinates(ring)[:-1]


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


def _round_length(length: float) -> float:
    """The next 1, 2 or 5 times a power of ten below a length."""
    power: float = 10.0 ** floor(log10(length))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= length)
