"""Smooth edges in a picture of one sample a pixel: of bodies, and of shadows, which multisampling
leaves as stairs since they lie inside a face.

Fast approximate antialiasing (T. Lottes, 2009): along a step in brightness the nearer end of the
stair is sought, and a pixel takes as much of the colour beyond the step as the stair covers of it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from factory.support.pictures.ink import Pixels

__all__ = ["smooth"]

SHARE, LEAST = 12, 6
"""Steps in brightness are smoothed that are more than the brighter side over this, and so large at
least."""

REACH = 10
"""Pixels along a step in which its end is sought, either way."""

SINGLE = 0.45
"""How much of what is a pixel wide is spread to its neighbours."""

Places = NDArray[np.intp]
Brightness = NDArray[np.floating[Any]]


def smooth(pixels: Pixels) -> Pixels:
    """The picture (height, width, 3) with smooth edges."""
    tall, wide = pixels.shape[:2]
    if min(tall, wide) < 3:
        return pixels
    flat = pixels.reshape(-1, 3)
    bright = _bright(pixels)
    at = _edges(bright)
    light = bright.ravel()
    around = (0, -wide, wide, -1, 1, -wide - 1, -wide + 1, wide - 1, wide + 1)
    here, north, south, west, east, *corners = (light[at + k].astype(np.float32) for k in around)
    lying = _curvature(here, north, south, west, east, corners)
    along = np.where(lying, 1, wide)
    one, other = np.where(lying, north, west), np.where(lying, south, east)
    first = np.abs(one - here) >= np.abs(other - here)
    across = np.where(lying, wide, 1) * np.where(first, -1, 1)
    beyond = np.where(first, one, other)
    share = _covered(light, at, along, across, (here + beyond) / 2, np.abs(beyond - here) / 4)
    mean = (2 * (north + south + west + east) + sum(corners)) / 12
    spread = np.abs(mean - here) / np.maximum(_range(here, north, south, west, east), 1.0)
    spread = np.clip(spread, 0.0, 1.0)
    share = np.maximum(share, SINGLE * (spread * spread * (3 - 2 * spread)) ** 2)[:, None]
    blended = flat.copy()
    blended[at] = (1 - share) * flat[at] + share * flat[at + across] + np.float32(0.5)
    return np.asarray(blended.reshape(pixels.shape), np.uint8)


def _bright(pixels: Pixels) -> NDArray[np.uint8]:
    """The brightness (height, width) of pixels, from 0 to 255."""
    red, green, blue = (pixels[:, :, k] >> shift for k, shift in enumerate((2, 1, 2)))
    return np.asarray(red + green + blue, np.uint8)


def _edges(bright: NDArray[np.uint8]) -> Places:
    """The pixels, counted row by row, beside which the brightness steps; none at the rim."""
    least, most = bright.copy(), bright.copy()
    for here, beside in (
        (np.s_[1:], np.s_[:-1]),
        (np.s_[:-1], np.s_[1:]),
        (np.s_[:, 1:], np.s_[:, :-1]),
        (np.s_[:, :-1], np.s_[:, 1:]),
    ):
        np.minimum(least[here], bright[beside], out=least[here])
        np.maximum(most[here], bright[beside], out=most[here])
    step = most - least
    stepped = (step > most // SHARE) & (step >= LEAST)
    stepped[[0, -1]] = stepped[:, [0, -1]] = False
    return np.flatnonzero(stepped)


def _range(*rows: Brightness) -> Brightness:
    stacked = np.stack(rows)
    return np.asarray(stacked.max(axis=0) - stacked.min(axis=0))


def _curvature(
    here: Brightness,
    north: Brightness,
    south: Brightness,
    west: Brightness,
    east: Brightness,
    corners: list[Brightness],
) -> NDArray[np.bool_]:
    """Whether the step at each pixel lies rather than stands."""
    northwest, northeast, southwest, southeast = corners
    lying = np.abs(northwest - 2 * west + southwest) + 2 * np.abs(north - 2 * here + south)
    lying += np.abs(northeast - 2 * east + southeast)
    standing = np.abs(northwest - 2 * north + northeast) + 2 * np.abs(west - 2 * here + east)
    standing += np.abs(southwest - 2 * south + southeast)
    return np.asarray(lying >= standing)


def _covered(
    light: NDArray[np.uint8],
    at: Places,
    along: Places,
    across: Places,
    middle: Brightness,
    enough: Brightness,
) -> Brightness:
    """How much of each pixel lies beyond the step at it, by the distance to the nearer end of its
    stair: where the mean of both sides departs from its `middle` here by `enough`."""
    distances, departures = list[Brightness](), list[Brightness]()
    last = len(light) - 1
    for way in (-1, 1):
        distance = np.full(len(at), REACH, np.float32)
        departure = np.zeros(len(at), np.float32)
        going = np.arange(len(at))
        for step in range(1, REACH + 1):
            place = np.clip(at[going] + way * step * along[going], 0, last)
            other = np.clip(place + across[going], 0, last)
            off = (light[place].astype(np.float32) + light[other]) / 2 - middle[going]
            departure[going] = off
            ended = np.abs(off) >= enough[going]
            distance[going[ended]] = step
            going = going[~ended]
        distances.append(distance)
        departures.append(departure)
    nearer = distances[0] <= distances[1]
    ends = np.where(nearer, departures[0], departures[1])
    inside = (ends < 0) != (light[at] < middle)
    share = 0.5 - np.minimum(*distances) / (distances[0] + distances[1])
    return np.where(inside, share, 0.0).astype(np.float32)
