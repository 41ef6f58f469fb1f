"""Cameras and their views: a view is as near as it can be with a set of points inside the frame.

For a direction of sight and an aspect ratio that position has a closed form, so the factory fills a
picture of any shape."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import cos, radians, sin, tan
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from factory.support.errors import Diagnostic, InputError, did_you_mean

Array = NDArray[np.float64]

Standing = Literal["overview", "orbit", "top", "product"]
"""`overview`: the whole factory, aslant; `orbit`: the same from all sides in turn; `top`: from
above; `product`: follows the product that is furthest on its way."""

CAMERAS: tuple[Standing, ...] = get_args(Standing)

PART = "part:"

Camera = str
"""One of CAMERAS, or `part:LABEL`, which follows that part from its feeder to the dropoff."""

TURN = 8.0
"""How fast `orbit` goes round [degrees/s]."""

FIELD = 24.0
"""Angle of view across the shorter side of the picture [degrees]: narrow, for little
perspective."""


@dataclass(frozen=True, slots=True)
class Framing:
    """What of a picture may be used: `aspect` = width / height, and the margins as fractions of
    height."""

    aspect: float
    below: float = 0.03
    above: float = 0.03
    beside: float = 0.03


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
        up, ahead = self.axes[1][2], self.axes[2][2]
        far = float(self.position[2]) / max(-ahead - self.tall * up, 0.06)
        near = max(0.1 * self.distance, 0.7 * (self.distance - self.depth))
        return near, 2 * max(far, self.distance + self.depth)


def camera_named(name: str, parts: Sequence[str] | None = None) -> Camera:
    """Raises InputError (BadValue) for a name that no camera has, and for a part that is none of
    `parts`, if these are known."""
    head, colon, label = name.partition(":")
    if not colon and name in CAMERAS:
        return name
    if head + colon == PART and (parts is None or label in parts):
        return name
    if head + colon == PART and parts is not None:
        hint = did_you_mean(label, parts, "parts")
        raise InputError(Diagnostic("BadValue", f"there is no part '{label}'", None, hint))
    hint = did_you_mean(name, (*CAMERAS, "part:LABEL"), "cameras")
    raise InputError(Diagnostic("BadValue", f"there is no camera '{name}'", None, hint))


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
    tall, side, low, high = _tangents(framing)
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


def _tangents(framing: Framing) -> tuple[float, float, float, float]:
    """Tangents of half the angle of view upwards, and of what may be used of it beside, below and
    above."""
    tall = tan(radians(FIELD / 2)) / min(1.0, framing.aspect)
    side = tall * (framing.aspect - 2 * framing.beside)
    return tall, side, tall * (1 - 2 * framing.below), tall * (1 - 2 * framing.above)


def overview(points: Array, framing: Framing) -> View:
    """From the south, aslant, or from where the factory fills the picture better by a tenth; an
    upright picture may see a long factory lengthwise, and from higher up."""
    wide = framing.aspect >= 1
    azimuths = (-62.0, -118.0, -28.0, -152.0) if wide else (-62.0, -118.0, -8.0, -172.0)
    best, *others = (fit(points, towards(a, 40.0 if wide else 52.0), framing) for a in azimuths)
    for view in others:
        if view.distance < 0.9 * best.distance:
            best = view
    return best


def orbit(points: Array, framing: Framing) -> Callable[[float], View]:
    """The view at each time [s] from a camera that goes round at an even height and distance, the
    nearest from which everything is in the frame all the way."""
    elevation = 36.0 if framing.aspect >= 1 else 50.0
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    tall, side, low, high = _tangents(framing)
    away = 0.0
    for azimuth in range(0, 360, 5):
        r, u, f = towards(azimuth, elevation) @ (points - middle).T
        nearest = np.maximum(np.abs(r) / side, np.maximum(u / high, -u / low)) - f
        away = max(away, float(nearest.max()))
    depth = float(np.linalg.norm(points - middle, axis=1).max())

    def view(time: float) -> View:
        axes = towards(-62.0 + TURN * time, elevation)
        return View(middle - away * axes[2], axes, tall * framing.aspect, tall, away, depth)

    return view


def from_above(points: Array, framing: Framing) -> View:
    """Straight down, north up, or turned by a quarter where that fills the picture better."""
    upright, turned = (fit(points, towards(a, 90.0), framing) for a in (-90.0, 180.0))
    return turned if turned.distance < 0.9 * upright.distance else upright
