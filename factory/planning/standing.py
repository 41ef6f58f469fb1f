"""Whether what stands on the floor would tip: its centre of mass beyond what it stands on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from factory.geometry.meshes import Array
from factory.planning.parts import PlacedPart

LEVEL = 5e-4
"""What is no higher than this above the lowest point [m], or LOW of the height, stands on the
floor."""

LOW = 1e-2


def overhang(parts: Sequence[PlacedPart], up: Array) -> float:
    """How far the centre of mass of some parts is outside the polygon on which they stand where a
    direction (3,) of the product is up [m]; less than 0 inside it."""
    mass = np.array([part.solid.mass for part in parts])
    centre = mass @ np.array([part.solid.centre for part in parts]) / mass.sum()
    points = np.concatenate([part.vertices for part in parts])
    heights = points @ up
    level = min(LEVEL, LOW * float(np.ptp(heights)))
    across = np.linalg.svd(up[None])[2][1:]
    return outside((points[heights <= heights.min() + level]) @ across.T, centre @ across.T)


def outside(points: Array, at: Array) -> float:
    """How far a point (2,) is outside the convex hull of points (n, 2) [m]; less than 0 in it."""
    from shapely import MultiPoint, Point

    hull, point = MultiPoint(points).convex_hull, Point(at)
    return float(hull.distance(point) or -hull.boundary.distance(point))
