"""Words on a picture: a caption below (product, units made, time), notices of failures above it,
and at the start of a film a title in the upper left corner, which fades out."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from factory.film.history import History
from factory.film.ink import (
    AMBER,
    DEAD,
    FAINT,
    FLASH,
    INK,
    WHITE,
    Colour,
    Ink,
    Pixels,
    fitted,
    width,
)
from factory.theory.nets.verdict import listing

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
        captioned = pixels.copy()
        captioned[-self.strip :] = np.asarray(below)
        return captioned


def strength(time: float) -> float:
    """Opacity of the title at a time."""
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


TOLD, VANISHES = 4.0, 0.6
"""How long a notice of a failure is shown, and how long it then fades [s]."""

MOST = 3
"""Maximum number of notices at once; the latest are shown."""


def draw_notices(pixels: Pixels, history: History, time: float, caption: Caption) -> None:
    """Draw notices of recent failures on a picture, in place, from its caption upwards."""
    if not caption.strip:
        return
    points, ink = caption.points, Ink(pixels)
    edge, bottom = 1.2 * points, pixels.shape[0] - caption.strip - 0.4 * points
    for words, colour, alpha in _notices(history, time):
        words = fitted(words, points, pixels.shape[1] - 2 * edge - 2 * points)
        right, top = edge + width(words, points) + 1.6 * points, bottom - 1.9 * points
        ink.box(edge, top, right, bottom, WHITE, 0.86 * alpha, 0.3 * points)
        ink.box(edge, top, edge + max(3.0, 0.3 * points), bottom, colour, alpha)
        ink.words(edge + points, (top + bottom) / 2, words, points, INK, "l", alpha)
        bottom = top - 0.4 * points


def _notices(history: History, time: float) -> Iterator[tuple[str, Colour, float]]:
    """Words, their colour and their opacity, the lowest first."""
    dead, robots = history.dead(time), history.factory.robots
    if stands := sorted(history.stands(time) - dead):
        names = listing(robots[robot].name for robot in stands)
        yield f"{names} stand{'s' if len(stands) == 1 else ''} still", AMBER, 1.0
    failed = history.failed(time - TOLD - VANISHES, time)
    announced = {one.robot for one in failed if one.is_death}
    if silent := [
        robots[robot].name for robot in sorted(dead) if robots[robot].name not in announced
    ]:
        yield f"{listing(silent)} {'is' if len(silent) == 1 else 'are'} dead", DEAD, 1.0
    for death in history.deaths():
        if death.end < time < death.end + TOLD + VANISHES:
            alpha = min(1.0, (death.end + TOLD + VANISHES - time) / VANISHES)
            yield death.then, DEAD, alpha
    for failing in failed[: -MOST - 1 : -1]:
        alpha = min(1.0, (failing.t + TOLD + VANISHES - time) / VANISHES)
        yield str(failing), FLASH, alpha
