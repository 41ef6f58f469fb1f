"""Ink on a picture, and its colours: boxes with round corners, and words, smooth at any fraction of
a pixel.

One shape is enough for the panels beside a film: with corners as round as it is tall a box is a
disc or a capsule, very thin it is a line.
"""

from __future__ import annotations

import re
from functools import cache, lru_cache

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

__all__ = [
    "GROUND",
    "INK",
    "Colour",
    "Ink",
    "Pixels",
    "fitted",
    "width",
]

Pixels = NDArray[np.uint8]
"""A picture (height, width, 3)."""

Colour = tuple[int, int, int]
"""Red, green and blue, from 0 to 255."""

Coverage = NDArray[np.float32]

GROUND, INK, FAINT, LINE = (243, 243, 245), (38, 44, 54), (112, 121, 134), (205, 209, 215)
"""The ground, a shade lighter than the floor in the pictures; words, lesser words, lines."""

EDGE, FLASH = (222, 224, 229), (232, 60, 48)
"""Between the picture and the panels; what fires, and the present."""

WHITE = (255, 255, 255)


def pale(colour: Colour, share: float = 0.78) -> Colour:
    """A colour thinned with white."""
    return blended(colour, WHITE, share)


class Ink:
    """Draws on the pixels (height, width, 3) that it is given; x to the right, y downwards [px]."""

    def __init__(self, pixels: Pixels) -> None:
        self.pixels = pixels

    def box(
        self,
        left: float,
        top: float,
        right: float,
        bottom: float,
        colour: Colour,
        alpha: float = 1.0,
        radius: float = 0.0,
        line: float = 0.0,
    ) -> None:
        """A filled box, or with `line` only its edge, so wide and inside."""
        x, y = self._pixels_of(left, top, right, bottom)
        if not (x.size and y.size) or alpha <= 0.0:
            return
        covered = _covered(x, y, left, top, right, bottom, radius)
        if line:
            inner = left + line, top + line, right - line, bottom - line
            covered = covered - _covered(x, y, *inner, max(0.0, radius - line))
        self._blend(int(x[0]), int(y[0]), covered * np.float32(alpha), colour)

    def hatched(
        self, left: float, top: float, right: float, bottom: float, colour: Colour, pitch: float
    ) -> None:
        """A hatched box: its edge and stripes that rise to the right, at a pitch."""
        x, y = self._pixels_of(left, top, right, bottom)
        if not (x.size and y.size):
            return
        covered, line = _covered(x, y, left, top, right, bottom, 0.0), max(1.0, pitch / 5)
        inner = _covered(x, y, left + line, top + line, right - line, bottom - line, 0.0)
        phase = (x[None] - np.float32(right) + y[:, None]) % np.float32(pitch)
        stripes = np.clip(np.abs(phase - pitch / 2) - (pitch / 2 - line), 0, 1)
        striped = np.asarray(covered - inner * (1 - stripes), np.float32)
        self._blend(int(x[0]), int(y[0]), striped, colour)

    def _pixels_of(
        self, left: float, top: float, right: float, bottom: float
    ) -> tuple[Coverage, Coverage]:
        """The columns and rows of the picture that a box touches; none of an empty box."""
        if right <= left or bottom <= top:
            return np.empty(0, np.float32), np.empty(0, np.float32)
        x1 = min(self.pixels.shape[1], int(right) + 2)
        y1 = min(self.pixels.shape[0], int(bottom) + 2)
        x0, y0 = max(0, int(left) - 1), max(0, int(top) - 1)
        return np.arange(x0, x1, dtype=np.float32), np.arange(y0, y1, dtype=np.float32)

    def disc(self, x: float, y: float, radius: float, colour: Colour, alpha: float = 1.0) -> None:
        """A disc."""
        self.box(x - radius, y - radius, x + radius, y + radius, colour, alpha, radius)

    def words(
        self,
        x: float,
        y: float,
        text: str,
        points: int,
        colour: Colour,
        anchor: str = "l",
        alpha: float = 1.0,
    ) -> None:
        """A line of text whose middle is at height y; `anchor`: x is its left (l), middle (m) or
        right (r)."""
        if not text or alpha <= 0.0:
            return
        mask = _mask(text, points)
        left = x - {"l": 0.0, "m": 0.5, "r": 1.0}[anchor] * (mask.shape[1] - 1)
        x0, share = int(np.floor(left)), np.float32(left - np.floor(left))
        if share:
            mask = mask * (1 - share) + np.roll(mask, 1, axis=1) * share
        y0 = round(y - mask.shape[0] / 2)
        cut_x, cut_y = max(0, -x0), max(0, -y0)
        mask = mask[cut_y : self.pixels.shape[0] - y0, cut_x : self.pixels.shape[1] - x0]
        if mask.size:
            self._blend(x0 + cut_x, y0 + cut_y, mask * np.float32(alpha), colour)

    def _blend(self, x: int, y: int, covered: Coverage, colour: Colour) -> None:
        window = self.pixels[y : y + covered.shape[0], x : x + covered.shape[1]]
        share = covered[..., None]
        window[:] = window + share * (np.array(colour, np.float32) - window) + np.float32(0.5)


def width(text: str, points: int) -> int:
    """Width of a line of text [px]."""
    return _mask(text, points).shape[1] - 1 if text else 0


ENDING = re.compile(r"(?<=\w\w\w)([/_.-]\w{1,5}|\d{1,3})$")
"""The end of a label that has others beside it."""


def fitted(text: str, points: int, room: float) -> str:
    """A text, shortened to fit; "" if less than three letters or two fifths of it fit. What tells
    a label from its like is kept: the number of `box/3` and `peg12`, the end of `axle_left`."""
    if width(text, points) <= room:
        return text
    match = ENDING.search(text)
    head, tail = (text[: match.start()], match[0]) if match else (text, "")
    for length in range(len(head) - 1, max(2, int(0.4 * len(head))), -1):
        shorter = f"{head[:length].rstrip()}…{tail}"
        if width(shorter, points) <= room:
            return shorter
    return ""


def blended(one: Colour, other: Colour, share: float) -> Colour:
    """A colour between two."""
    red, green, blue = (round(a + share * (b - a)) for a, b in zip(one, other, strict=True))
    return red, green, blue


def _covered(
    x: Coverage, y: Coverage, left: float, top: float, right: float, bottom: float, radius: float
) -> Coverage:
    """The share of each pixel that a box covers: exact for sharp corners, by the distance from its
    edge for round ones."""
    if radius < 0.5:
        across = np.clip(np.minimum(x + 1, right) - np.maximum(x, left), 0, 1)
        down = np.clip(np.minimum(y + 1, bottom) - np.maximum(y, top), 0, 1)
        return np.asarray(down[:, None] * across, np.float32)
    r = min(radius, (right - left) / 2, (bottom - top) / 2)
    u = np.abs(x + 0.5 - (left + right) / 2) - ((right - left) / 2 - r)
    v = np.abs(y + 0.5 - (top + bottom) / 2)[:, None] - ((bottom - top) / 2 - r)
    outside = np.hypot(np.maximum(u, 0), np.maximum(v, 0)) + np.minimum(np.maximum(u, v), 0)
    return np.asarray(np.clip(r + 0.5 - outside, 0, 1), np.float32)


FINE = 4
"""Words are drawn so many times as large and reduced, so that letters stand evenly."""


@cache
def _font(points: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(points)


@lru_cache(4096)
def _mask(text: str, points: int) -> Coverage:
    """Coverage of a line of text, with one more column on the right."""
    font = _font(FINE * points)
    reach = ImageDraw.Draw(Image.new("L", (1, 1))).textlength(text, font)
    size = int(np.ceil(reach / FINE)) + 1, round(1.5 * points)
    picture = Image.new("L", (FINE * size[0], FINE * size[1]))
    ImageDraw.Draw(picture).text((0, picture.height / 2), text, 255, font, "lm")
    return np.asarray(picture.reduce(FINE), np.float32) / np.float32(255)
