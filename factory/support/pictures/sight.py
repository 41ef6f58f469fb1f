"""The position of a camera: as near as possible with a set of points inside the frame.

For a direction of sight and an aspect ratio it has a closed form, so the subject fills a picture of
any shape."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, radians, sin, tan

import numpy as np

from factory.support.arrays import Array

__all__ = ["Framing", "View", "fit", "towards"]

FIELD = 24.0
"""The angle of view across the shorter side of a picture [degrees]: narrow, for little
perspective."""


@dataclass(frozen=True, slots=True)
class Framing:
    """The usable area of a picture: `aspect` = width / height, and the margins as fractions of the
    height; `field`: the angle of view across the shorter side [degrees]."""

    aspect: float
    below: float = 0.03
    above: float = 0.03
    beside: float = 0.03
    field: float = FIELD


@dataclass(frozen=True, slots=True)
class View:
    """A camera: its `position` (3,), its `axes` (3, 3) right, up and ahead, the tangents of half
    its angles of view, the `distance` to the middle of the subject, and half the extent of the
    subject along the line of sight (`depth`) [m]."""

    position: Array
    axes: Array
    wide: float
    tall: float
    distance: float
    depth: float

    @property
    def range(self) -> tuple[float, float]:
        """The near and far clipping distances [m]: tight, because otherwise shadows get speckles.
        The far one is twice the distance of the floor at the upper edge of the picture, because the
        sky is drawn nearer than the far end."""
        far = float(self.position[2]) / max(self.dip, 0.06)
        near = max(0.1 * self.distance, 0.7 * (self.distance - self.depth))
        return near, 2 * max(far, self.distance + self.depth)

    @property
    def dip(self) -> float:
        """The downward slope of the line of sight at the upper edge of the picture."""
        return float(-self.axes[2][2] - self.tall * self.axes[1][2])

    @property
    def has_sky(self) -> bool:
        """Whether the end of the floor, which is 20 times as large as the factory, may be
        visible."""
        return self.dip < 0.3


def towards(azimuth: float, elevation: float) -> Array:
    """The axes (3, 3), rows right, up and ahead, of a camera at an azimuth and an elevation
    [degrees] from its subject."""
    a, e = radians(azimuth), radians(elevation)
    right = (-sin(a), cos(a), 0.0)
    up = (-sin(e) * cos(a), -sin(e) * sin(a), cos(e))
    ahead = (-cos(e) * cos(a), -cos(e) * sin(a), -sin(e))
    return np.array([right, up, ahead])


def fit(points: Array, axes: Array, framing: Framing) -> View:
    """The nearest view along `axes` that has all points (n, 3) in the frame.

    The positions (a, c) from which points (r, f) are between two rays of tangents s and t form a
    wedge, -(f - c) s <= r - a <= (f - c) t, that opens backwards from its tip."""
    tall, side, low, high = tangents(framing)
    r, u, f = axes @ points.T
    wedges = [
        (float((x - f * t).max()), float((x + f * s).min()), s, t)
        for x, s, t in ((r, side, side), (u, low, high))
    ]
    c = min((right - left) / (s + t) for left, right, s, t in wedges)
    a, b = ((left + c * t + right - c * s) / 2 for left, right, s, t in wedges)
    middle, depth = float(f.min() + f.max()) / 2, float(f.max() - f.min()) / 2
    position = axes.T @ np.array([a, b, c])
    return View(position, axes, tall * framing.aspect, tall, middle - c, depth)


def tangents(framing: Framing) -> tuple[float, float, float, float]:
    """The tangents of half the angle of view upwards, and of its usable part beside, below and
    above."""
    tall = tan(radians(framing.field / 2)) / min(1.0, framing.aspect)
    side = tall * (framing.aspect - 2 * framing.beside)
    return tall, side, tall * (1 - 2 * framing.below), tall * (1 - 2 * framing.above)
