"""The place of a suction pad on a part: on its upper surface, as near as possible to the vertical
through its centre of mass.

A part leaves sideways from under its pad, so no point of it that passes under the pad may be higher
than the pad's place.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from factory.floor.geometry.pieces import BOX_FACES, is_box
from factory.floor.geometry.solids import Solid
from factory.support.arrays import Array
from factory.support.rotations import rotation

WIDEST = 0.008
"""Radius of the largest pad [m]."""

NARROWEST = 1e-5
"""Radius of the smallest [m]."""

SHARE = 0.25
"""The largest radius of a pad as a share of the part's least extent in plan."""

PLACES = 9
"""The number of candidate places along each side of a part."""

HIGHEST = 128
"""Of the triangles over a place so many are looked at at a time, those that reach highest first."""

Corner = Array
"""A corner of a rectangle in plan (2,) [m]."""


@dataclass(frozen=True, slots=True)
class PadPlace:
    """Where a suction pad is on a part.

    Attributes:
        GAP: the gap between a pad and the part [m].
        at: the middle of the pad's lower face (3,), in the frame of the product [m].
        radius: its radius [m].
        level: whether the part is level under all of it.
    """

    GAP: ClassVar[float] = 1e-4

    at: Array = field(repr=False)
    radius: float
    level: bool = False

    @classmethod
    def on(
        cls,
        solid: Solid,
        heading: tuple[float, float],
        taken: tuple[Corner, Corner] | None = None,
        largest: float = WIDEST,
        share: float = SHARE,
        terrains: Terrains | None = None,
    ) -> PadPlace:
        """The place on a part that leaves with a heading, a horizontal direction along an axis.

        Args:
            solid: the part.
            heading: where it leaves to.
            taken: opposite corners of a rectangle in plan that the pad stays out of.
            largest: the pad's radius [m], if there is room.
            share: the largest radius as a share of the part's least extent in plan.
            terrains: those of the part, where they are known.

        Among equal places the one nearest to the centre of mass is chosen; places with material
        under the middle are preferred.
        """
        low, high, ahead = solid.low[:2], solid.high[:2], np.array(heading)
        widest = max(min(largest, share * float((high - low).min())), NARROWEST)
        faces, drawn = terrains or terrains_of(solid)
        for radius in (widest, widest / 2, widest / 4):
            places = _grid(solid, radius)
            centre = places[0]
            if taken is not None:
                out = (places + radius <= taken[0]) | (places - radius >= taken[1])
                places = places[out.any(axis=1)]
            if len(places):
                break
        best, worst = None, (np.inf, np.inf)
        for place in places:
            under = place - radius, place + radius
            top = min(faces.height_in(*under), float(solid.high[2]))  # of a ball what is round it
            way = np.minimum(under[0], np.where(ahead > 0, low, under[0]))
            end = np.maximum(under[1], np.where(ahead < 0, high, under[1]))
            if faces.height_in(way, end) > top + EVEN or not np.isfinite(top):
                continue
            empty = top - drawn.height_in(place - radius / 4, place + radius / 4)
            off = top - drawn.height_in(*under), min(empty, radius) if empty > EVEN else 0.0
            if off[0] < EVEN and not off[1]:
                return cls._at(place, top, radius, level=True)
            if off < worst:
                best, worst = cls._at(place, top, radius), off
        if best is None:  # of a part that is nowhere level the highest place
            return cls._at(places[0] if len(places) else centre, float(solid.high[2]), radius)
        return best

    @classmethod
    def _at(cls, place: Corner, top: float, radius: float, level: bool = False) -> PadPlace:
        return cls(np.array([*place, top + cls.GAP]), radius, level)


EVEN = PadPlace.GAP / 2
"""The tolerance for equal heights [m]."""


def _grid(solid: Solid, radius: float) -> Array:
    """Candidate middles (n, 2) of pads within a part in plan, the nearest to its centre of mass
    first."""
    low, high = solid.low[:2], solid.high[:2]
    room = np.maximum((high - low) / 2 - radius, 0.0)
    shares = np.linspace(-1.0, 1.0, PLACES)
    grid = np.stack(np.meshgrid(shares, shares), axis=-1).reshape(-1, 2)
    centre = np.clip(solid.centre[:2], (low + high) / 2 - room, (low + high) / 2 + room)
    places = np.concatenate([[centre], (low + high) / 2 + grid * room])
    order = np.argsort(np.linalg.norm(places - solid.centre[:2], axis=1), kind="stable")
    return np.asarray(places[order])


@dataclass(frozen=True, slots=True)
class Terrain:
    """Triangles (n, 3, 3), those that reach highest first, with their greatest heights `tops` (n,)
    and their boxes in plan, `low` and `high` (2, n) [m]."""

    triangles: Array
    tops: Array
    low: Array
    high: Array

    @classmethod
    def of(cls, triangles: Array) -> Terrain:
        """The terrain of triangles (n, 3, 3)."""
        tops = triangles[..., 2].max(axis=1)
        order = np.argsort(-tops, kind="stable")
        one, two, three = triangles[order, :, :2].transpose(1, 2, 0)
        low, high = (ends(ends(one, two), three) for ends in (np.minimum, np.maximum))
        return cls(triangles[order], tops[order], low, high)

    def height_in(self, low: Corner, high: Corner) -> float:
        """The greatest height over a rectangle in plan, -inf if nothing is there."""
        kept = (self.low[0] <= high[0]) & (self.high[0] >= low[0])
        kept &= self.low[1] <= high[1]
        kept &= self.high[1] >= low[1]
        height, near = -np.inf, np.flatnonzero(kept)
        while len(near) and self.tops[near[0]] > height:
            height = max(height, _height_in(self.triangles[near[:HIGHEST]], low, high))
            near = near[HIGHEST:]
        return height


Terrains = tuple[Terrain, Terrain]
"""Those of the convex bodies of a part, and of the part as it is drawn."""


def terrains_of(solid: Solid) -> Terrains:
    """The terrains of a part."""
    return Terrain.of(_pieces(solid)), Terrain.of(drawn_triangles(solid))


def _height_in(near: Array, low: Corner, high: Corner) -> float:
    """The greatest height of triangles (n, 3, 3) over a rectangle in plan, -inf if there are none:
    at their corners and, of those that reach higher than these, at the corners of the rectangle and
    where edges cross its sides."""
    x, y, z = near.reshape(-1, 3).T
    inside = (x >= low[0]) & (x <= high[0]) & (y >= low[1]) & (y <= high[1])
    top = float(z[inside].max(initial=-np.inf))
    near = near[near[..., 2].max(axis=1) > top]
    if not len(near):
        return top
    begin, way = near.reshape(-1, 3), (np.roll(near, -1, axis=1) - near).reshape(-1, 3)
    at, along, sides = begin.T[:, None], way.T[:, None], np.stack([low, high], axis=1)[..., None]
    with np.errstate(divide="ignore", invalid="ignore"):
        for axis, across in ((0, 1), (1, 0)):
            share = (sides[axis] - at[axis]) / along[axis]
            place, height = at[across] + share * along[across], at[2] + share * along[2]
            crosses = (share >= 0) & (share <= 1)
            crosses &= (place >= low[across]) & (place <= high[across])
            top = float(height[crosses].max(initial=top))
    return _over_corners(near, low, high, top)


def _over_corners(triangles: Array, low: Corner, high: Corner, least: float) -> float:
    """The greatest height of triangles (n, 3, 3) over the corners of a rectangle, at least
    `least`."""
    a, u, v = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    flat = np.abs(area) > 1e-18
    a, u, v, area = a[flat], u[flat], v[flat], area[flat]
    corners = np.array([low, (low[0], high[1]), (high[0], low[1]), high])[..., None]
    dx, dy = corners[:, 0] - a[:, 0], corners[:, 1] - a[:, 1]
    s = (dx * v[:, 1] - dy * v[:, 0]) / area
    t = (u[:, 0] * dy - u[:, 1] * dx) / area
    over = (s >= 0) & (t >= 0) & (s + t <= 1)
    return float((a[:, 2] + s * u[:, 2] + t * v[:, 2])[over].max(initial=least))


def _pieces(solid: Solid) -> Array:
    """The triangles (n, 3, 3) of the convex bodies of a part."""
    return np.concatenate([_hull(piece) for piece in solid.pieces])


def _hull(points: Array) -> Array:
    """The triangles (n, 3, 3) of the convex hull of points (k, 3); if they are coplanar, the two
    triangles of the top of their box."""
    if is_box(points):
        return np.asarray(points[BOX_FACES])
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull = ConvexHull(points, qhull_options="QbB Pp Qt")
    except QhullError:
        (x, y, _), (far, wide, top) = points.min(axis=0), points.max(axis=0)
        corners = np.array([[x, y, top], [far, y, top], [far, wide, top], [x, wide, top]])
        return corners[[[0, 1, 2], [0, 2, 3]]]
    return np.asarray(hull.points[hull.simplices])


def drawn_triangles(solid: Solid) -> Array:
    """The triangles (n, 3, 3) of a part as drawn."""
    if solid.mesh is None:
        return _pieces(solid)
    vertices = solid.mesh.vertices @ rotation(solid.quaternion).T + solid.position
    return vertices[solid.mesh.faces]
