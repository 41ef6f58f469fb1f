"""Where a suction pad takes a part from above: on its upper surface, as near as can be to the
vertical through its centre of mass.

A part leaves sideways from under its pad. So nothing of it that comes by under the pad is higher
than the place where the pad is.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from factory.geometry.meshes import Array
from factory.geometry.solids import Solid, rotation

GAP = 1e-4
"""A pad is this much above what it takes [m]."""

WIDEST = 0.008
"""Radius of the largest pad [m]."""

NARROWEST = 1e-5
"""Radius of the smallest [m]."""

SHARE = 0.25
"""Radius of a pad as a share of the part's least extent in plan, where that is less."""

PLACES = 9
"""So many places along each side of a part are looked at."""

EVEN = GAP / 2
"""What is higher by less is not higher [m]."""

Corner = Array
"""A corner of a rectangle in plan (2,) [m]."""


@dataclass(frozen=True, slots=True)
class PadPlace:
    """The middle of a pad's lower face (3,), in the frame of the product, and its radius [m]."""

    at: Array = field(repr=False)
    radius: float


def pad_place(
    solid: Solid, heading: tuple[float, float], taken: tuple[Corner, Corner] | None = None
) -> PadPlace:
    """The place on a part for a pad from under which the part leaves with a heading, a direction
    of the world along an axis; it stays out of the rectangle that is `taken`, and is smaller where
    it has to be. Of places that are alike the one nearest to the centre of mass; best is one under
    whose middle there is something, too."""
    low, high, ahead = solid.low[:2], solid.high[:2], np.array(heading)
    widest = max(min(WIDEST, SHARE * float((high - low).min())), NARROWEST)
    faces, drawn = _pieces(solid), drawn_triangles(solid)
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
        top = min(height_in(faces, *under), float(solid.high[2]))  # of a ball what is round it
        way = np.minimum(under[0], np.where(ahead > 0, low, under[0]))
        end = np.maximum(under[1], np.where(ahead < 0, high, under[1]))
        if height_in(faces, way, end) > top + EVEN or not np.isfinite(top):
            continue
        empty = top - height_in(drawn, place - radius / 4, place + radius / 4)
        off = top - height_in(drawn, *under), min(empty, radius) if empty > EVEN else 0.0
        if off[0] < EVEN and not off[1]:
            return _at(place, top, radius)
        if off < worst:
            best, worst = _at(place, top, radius), off
    if best is None:  # of a part that is nowhere level the highest place
        return _at(places[0] if len(places) else centre, float(solid.high[2]), radius)
    return best


def _grid(solid: Solid, radius: float) -> Array:
    """Middles (n, 2) of pads within a part in plan, the nearest to its centre of mass first."""
    low, high = solid.low[:2], solid.high[:2]
    room = np.maximum((high - low) / 2 - radius, 0.0)
    shares = np.linspace(-1.0, 1.0, PLACES)
    grid = np.stack(np.meshgrid(shares, shares), axis=-1).reshape(-1, 2)
    centre = np.clip(solid.centre[:2], (low + high) / 2 - room, (low + high) / 2 + room)
    places = np.concatenate([[centre], (low + high) / 2 + grid * room])
    order = np.argsort(np.linalg.norm(places - solid.centre[:2], axis=1), kind="stable")
    return np.asarray(places[order])


def _at(place: Corner, top: float, radius: float) -> PadPlace:
    return PadPlace(np.array([*place, top + GAP]), radius)


def height_in(triangles: Array, low: Corner, high: Corner) -> float:
    """The greatest height of triangles (n, 3, 3) over a rectangle in plan, -inf where there is
    none: over a corner of it, at one of theirs, or where an edge crosses a side."""
    kept = (triangles[:, :, :2].min(axis=1) <= high) & (triangles[:, :, :2].max(axis=1) >= low)
    found = triangles[kept.all(axis=1)]
    if not len(found):
        return -np.inf
    points = [found.reshape(-1, 3), _over_corners(found, low, high)]
    begin, way = found.reshape(-1, 3), (np.roll(found, -1, axis=1) - found).reshape(-1, 3)
    for axis in (0, 1):
        for side in (low[axis], high[axis]):
            with np.errstate(divide="ignore", invalid="ignore"):
                share = (side - begin[:, axis]) / way[:, axis]
            crosses = (share >= 0) & (share <= 1)
            at = begin[crosses] + share[crosses, None] * way[crosses]
            at[:, axis] = side
            points.append(at)
    every = np.concatenate(points)
    inside = ((every[:, :2] >= low) & (every[:, :2] <= high)).all(axis=1)
    return float(every[inside, 2].max(initial=-np.inf))


def _over_corners(triangles: Array, low: Corner, high: Corner) -> Array:
    """The points (n, 3) of triangles over the corners of a rectangle."""
    a, u, v = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    flat = np.abs(area) > 1e-18
    a, u, v, area = a[flat], u[flat], v[flat], area[flat]
    found = []
    for x in (low[0], high[0]):
        for y in (low[1], high[1]):
            dx, dy = x - a[:, 0], y - a[:, 1]
            s = (dx * v[:, 1] - dy * v[:, 0]) / area
            t = (u[:, 0] * dy - u[:, 1] * dx) / area
            over = (s >= 0) & (t >= 0) & (s + t <= 1)
            z = (a[:, 2] + s * u[:, 2] + t * v[:, 2])[over]
            found.append(np.column_stack([np.full(len(z), x), np.full(len(z), y), z]))
    return np.concatenate(found)


def _pieces(solid: Solid) -> Array:
    """The triangles (n, 3, 3) of what collides."""
    return np.concatenate([_hull(piece) for piece in solid.pieces])


def _hull(points: Array) -> Array:
    """The triangles (n, 3, 3) of the convex hull of points (k, 3); of what is too thin for that the
    two that are its box from above."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull = ConvexHull(points, qhull_options="QbB Pp Qt")
    except QhullError:
        (x, y, _), (far, wide, top) = points.min(axis=0), points.max(axis=0)
        corners = np.array([[x, y, top], [far, y, top], [far, wide, top], [x, wide, top]])
        return corners[[[0, 1, 2], [0, 2, 3]]]
    return np.asarray(hull.points[hull.simplices])


def drawn_triangles(solid: Solid) -> Array:
    """The triangles (n, 3, 3) of what is drawn."""
    if solid.mesh is None:
        return _pieces(solid)
    vertices = solid.mesh.vertices @ rotation(solid.quaternion).T + solid.position
    return vertices[solid.mesh.faces]
