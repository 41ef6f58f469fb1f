"""The words on a picture: a caption below (product, units made, time), and at the beginning of a
film a title in the upper left corner, which fades away."""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from factory.render.colours import FAINT, FLASH, INK, WHITE
from factory.render.ink import Ink, Pixels, fitted, width

HALO = (250, 250, 251)

SMALLEST = 100
"""Pictures lower than this many pixels have no caption."""

SHOWN, FADES = 3.5, 0.7
"""How long a title is shown, and then fades [s]."""


class Caption:
    """Draws captions on pictures of one size, in a strip of `share` of the height kept free for
    it."""

    def __init__(self, size: tuple[int, int]) -> None:
        self.width, height = size
        self.points = max(11, round(0.030 * min(height, self.width * 9 / 16)))
        self.strip = round(2.4 * self.points) if height >= SMALLEST else 0
        self.share = self.strip / height
        self.font = ImageFont.load_default(self.points)

    def draw(self, pixels: Pixels, product: str, made: int, units: int, time: float) -> Pixels:
        """The picture with its caption; `made` of the `units` by a time [s]."""
        if not self.strip:
            return pixels
        below = Image.fromarray(pixels[-self.strip :])
        draw, halo = ImageDraw.Draw(below), max(1, self.points // 9)
        count = f"{made} of {units} unit{'' if units == 1 else 's'}"
        edge, middle = round(1.2 * self.points), self.strip // 2
        right = self.width - edge
        left = right - round(draw.textlength("0000.0 s", self.font)) - self.points
        room = self.width - 2 * edge - draw.textlength(f"{count}   000.0 s", self.font)
        name = fitted(product, self.points, room)
        for x, words, anchor in (
            (edge, name, "lm"),
            (right, f"{time:.1f} s", "rm"),
            (left, count, "rm"),
        ):
            at = x, middle
            draw.text(at, words, INK, self.font, anchor, stroke_width=halo, stroke_fill=HALO)
        found = pixels.copy()
        found[-self.strip :] = np.asarray(below)
        return found


def strength(time: float) -> float:
    """How much of the title is to be seen at a time."""
    share = min(max((SHOWN + FADES - time) / FADES, 0.0), 1.0)
    return share * share * (3 - 2 * share)


def draw_title(pixels: Pixels, title: str, detail: str, time: float) -> None:
    """Put the title on a picture, in place."""
    alpha = strength(time)
    height, room = pixels.shape[0], 0.9 * pixels.shape[1]
    points, small = max(14, round(height / 22)), max(10, round(height / 44))
    while points > small and width(title, points) > room - 3 * small:
        points -= 1
    title = fitted(title, points, room - 3 * small)
    wide = max(width(title, points), width(detail, small)) + 2.4 * small
    edge, ink = 1.4 * small, Ink(pixels)
    tall = 1.5 * points + (1.6 * small if detail else 0) + small
    ink.box(edge, edge, edge + wide, edge + tall, WHITE, 0.86 * alpha, 0.4 * small)
    ink.box(edge, edge, edge + max(3, small / 3.5), edge + tall, FLASH, alpha)
    left, top = edge + 1.2 * small, edge + 0.5 * small
    ink.words(left, top + 0.75 * points, title, points, INK, "l", alpha)
    ink.words(left, top + 1.5 * points + 0.8 * small, detail, small, FAINT, "l", alpha)
