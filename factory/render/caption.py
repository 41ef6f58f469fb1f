"""The line under a picture: the product, the units made, the time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from factory.render.painter import Pixels

INK, HALO = (38, 44, 54), (250, 250, 251)

SMALLEST = 100
"""Pictures lower than this many pixels have no caption."""


@dataclass(frozen=True, slots=True)
class Words:
    """What a caption says."""

    product: str
    made: int
    units: int
    seconds: float

    @property
    def count(self) -> str:
        """`2 of 3 units`"""
        return f"{self.made} of {self.units} unit{'' if self.units == 1 else 's'}"


class Caption:
    """Draws captions on pictures of one size, in a strip of `share` of the height kept free for
    it."""

    def __init__(self, size: tuple[int, int]) -> None:
        self.width, height = size
        self.points = max(11, round(0.030 * min(height, self.width * 9 / 16)))
        self.strip = round(2.4 * self.points) if height >= SMALLEST else 0
        self.share = self.strip / height
        self.font = ImageFont.load_default(self.points)

    def draw(self, pixels: Pixels, words: Words) -> Pixels:
        """The picture with its caption."""
        if not self.strip:
            return pixels
        below = Image.fromarray(pixels[-self.strip :])
        draw = ImageDraw.Draw(below)
        edge, middle = round(1.2 * self.points), self.strip // 2
        time = f"{words.seconds:.1f} s"
        room = self.width - 2 * edge - draw.textlength(f"{words.count}   000.0 s", self.font)
        self._write(draw, (edge, middle), _shortened(words.product, draw, self.font, room), "lm")
        right = self.width - edge
        self._write(draw, (right, middle), time, "rm")
        left = right - round(draw.textlength("0000.0 s", self.font)) - self.points
        self._write(draw, (left, middle), words.count, "rm")
        found = pixels.copy()
        found[-self.strip :] = np.asarray(below)
        return found

    def _write(
        self, draw: ImageDraw.ImageDraw, at: tuple[int, int], text: str, anchor: str
    ) -> None:
        halo = max(1, self.points // 9)
        draw.text(at, text, INK, self.font, anchor, stroke_width=halo, stroke_fill=HALO)


def _shortened(
    text: str,
    draw: ImageDraw.ImageDraw,
    font: ImageFont.FreeTypeFont | ImageFont.ImageFont,
    room: float,
) -> str:
    """The beginning of a text that fits."""
    if draw.textlength(text, font) <= room:
        return text
    while text and draw.textlength(f"{text}…", font) > room:
        text = text[:-1]
    return f"{text}…" if text else ""
