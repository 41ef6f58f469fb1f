"""What goes wrong, in words on a picture: for some seconds what failed and what is done about it,
and which robots stand."""

from __future__ import annotations

from collections.abc import Iterator

from factory.nets.verdict import listing
from factory.render.caption import Caption
from factory.render.colours import AMBER, DEAD, FLASH, INK, WHITE
from factory.render.history import History
from factory.render.ink import Colour, Ink, Pixels, fitted, width

SHOWN, FADES = 4.0, 0.6
"""How long a failure is told, and then fades [s]."""

MOST = 3
"""At most so many failures are told at once, the latest."""


def draw_notices(pixels: Pixels, history: History, time: float, caption: Caption) -> None:
    """Put what has failed lately on a picture, in place, from its caption upwards."""
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
    """Words, their colour and how much of them is to be seen, the lowest first."""
    dead, robots = history.dead(time), history.factory.robots
    if stands := sorted(history.stands(time) - dead):
        names = listing(robots[robot].name for robot in stands)
        yield f"{names} stand{'s' if len(stands) == 1 else ''} still", AMBER, 1.0
    failed = history.failed(time - SHOWN - FADES, time)
    told = {one.robot for one in failed if one.is_death}
    if silent := [robots[robot].name for robot in sorted(dead) if robots[robot].name not in told]:
        yield f"{listing(silent)} {'is' if len(silent) == 1 else 'are'} dead", DEAD, 1.0
    for death in history.deaths():
        if death.end < time < death.end + SHOWN + FADES:
            alpha = min(1.0, (death.end + SHOWN + FADES - time) / FADES)
            yield death.then, DEAD, alpha
    for failing in failed[: -MOST - 1 : -1]:
        alpha = min(1.0, (failing.t + SHOWN + FADES - time) / FADES)
        yield str(failing), FLASH, alpha
