"""The sight of a camera: as near as it can be with a set of points inside the frame.

For a direction of sight and an aspect ratio that position has a closed form, so what is looked at
fills a picture of any shape."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, radians, sin, tan

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FIELD = 24.0
"""Angle of view across the shorter side of a picture [degrees]: narrow, for little perspective."""


@dataclass(frozen=True, slots=True)
class Framing:
    """What of a picture may be used: `aspect` = width / height, and the margins as fractions of
    height; `field`: the angle of view across the shorter side [degrees]."""

    aspect: float
    below: float = 0.03
    above: float = 0.03
    beside: float = 0.03
    field: float = FIELD


@dataclass(frozen=True, slots=True)
class View:
    """A camera: its `position` (3,), its `axes` (3, 3) right, up and ahead, the tangents of half
    its angles of view, the `distance` to the middle of what it looks at, and half the depth of that
    [m]."""

    position: Array
    axes: Array
    wide: float
    tall: float
    distance: float
    depth: float

    @property
    def range(self) -> tuple[float, float]:
        """From where to where something is drawn [m]: tightly, or shadows get speckles. Twice as
        far as the floor at the upper edge of the picture, since the sky is drawn nearer than the
        far end."""
        far = float(self.position[2]) / max(self.dip, 0.06)
        near = max(0.1 * self.distance, 0.7 * (self.distance - self.depth))
        return near, 2 * max(far, self.distance + self.depth)

    @property
    def dip(self) -> float:
        """How steeply the upper edge of the picture looks down: its descent on a way of 1 ahead."""
        return float(-self.axes[2][2] - self.tall * self.axes[1][2])

    @property
    def has_sky(self) -> bool:
        """Whether the end of the floor may be seen, which is 20 times as large as the factory."""
        return self.dip < 0.3


def towards(azimuth: float, elevation: float) -> Array:
    """Axes (3, 3), rows right, up and ahead, of a camera that stands at an azimuth and an elevation
    [degrees] from what it looks at."""
    a, e = radians(azimuth), radians(elevation)
    right = (-sin(a), cos(a), 0.0)
    up = (-sin(e) * cos(a), -sin(e) * sin(a), cos(e))
    ahead = (-cos(e) * cos(a), -cos(e) * sin(a), -sin(e))
    return np.array([right, up, ahead])


def fit(points: Array, axes: Array, framing: Framing) -> View:
    """The nearest view along `axes` that has all points (n, 3) in the frame.

    The positions (a, c) from which points (r, f) are seen between two rays of tangents s and t are
    a wedge, -(f - c) s <= r - a <= (f - c) t, that opens backwards from its tip."""
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
    """Tangents of half the angle of view upwards, and of what may be used of it beside, below and
    above."""
    tall = tan(radians(framing.field / 2)) / min(1.0, framing.aspect)
    side = tall * (framing.aspect - 2 * framing.beside)
    return tall, side, tall * (1 - 2 * framing.below), tall * (1 - 2 * framing.above)
