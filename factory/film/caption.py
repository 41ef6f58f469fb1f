"""Words on a picture: a caption below (product, units made, time), notices of failures above it,
and at the start of a film a title in the upper left corner, which fades out."""

from __future__ import annotations

from collections.abc import Iterator

from factory.film.colours import AMBER, DEAD
from factory.film.history import History
from factory.support.errors import listing
from factory.support.pictures.ink import (
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
from factory.support.texts import counted

BAR = 0.82
"""Opacity of the bars that words stand on."""

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

    def draw(self, pixels: Pixels, product: str, made: int, units: int, time: float) -> Pixels:
        """The picture with its caption; `made` of the `units` by a time [s]."""
        if not self.strip:
            return pixels
        captioned, points = pixels.copy(), self.points
        ink, middle = Ink(captioned), len(pixels) - self.strip / 2
        count, edge = f"{made} of {counted(units, 'unit')}", 0.7 * points
        digit, unit = width("0", points), width(". s", points)
        figures = 5 * digit + unit
        right = self.width - 2 * edge
        between = right - figures - 1.2 * points
        name = fitted(product, points, between - width(count, points) - 3.2 * points)
        for start, end in (
            (edge, 3 * edge + width(name, points)),
            (between - width(count, points) - edge, right + edge),
        ):
            top, bottom = middle - 0.85 * points, middle + 0.85 * points
            ink.box(start, top, end, bottom, WHITE, BAR, 0.35 * points)
        ink.words(2 * edge, middle, name, points, INK)
        ink.words(between, middle, count, points, INK, "r")
        ink.words(right, middle, "s", points, INK, "r")
        whole, tenth = f"{time:.1f}".split(".")
        at = right - width(" s", points) - digit / 2
        ink.words(at, middle, tenth, points, INK, "m")
        at -= digit / 2 + width(".", points)
        ink.words(at, middle, ".", points, INK)
        for place, figure in enumerate(reversed(whole)):
            ink.words(at - (place + 0.5) * digit, middle, figure, points, INK, "m")
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
