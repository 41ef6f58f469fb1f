"""A title at the beginning of a film: a card in the upper left corner that fades away."""

from __future__ import annotations

from factory.render.colours import FAINT, FLASH, INK, WHITE
from factory.render.ink import Ink, fitted, width
from factory.render.painter import Pixels

SHOWN, FADES = 3.5, 0.7
"""How long it is shown, and then fades [s]."""


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
