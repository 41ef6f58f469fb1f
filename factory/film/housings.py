"""Housings as they are drawn: magazines of feeders, and the shed of the outfeed with its door.

White shells, windows of graphite glass in their long sides, and their contents' names.
"""

from __future__ import annotations

from functools import cache
from math import cos, pi

import numpy as np

from factory.film.lettering import height, lettering
from factory.film.outfits import OUT, Half, Layer, Outfit, together
from factory.film.skins import RoundRectangle, Skin, hood, slab
from factory.floor.layout.dimensions import PLAY, WALL

CORNER = 3 * (WALL + PLAY)
"""Radius of a housing's corners [m]: what is inside, so far from its sides, does not stand out."""

LEAST, LID_LEAST = 2.5e-3, 6e-3
"""Height of words at least, or they are left out; on a lid, or they are on the sides [m]."""

MOST = 0.020
"""Height of words on a lid at most [m]."""

MARGIN = 8e-3
"""Between a window and the edges of its side [m]."""

PANE = 3e-4
"""Bevel of a window [m]."""


@cache
def magazine(half: Half, label: str, seen: float) -> Outfit:
    """A feeder's housing of these half sides, open below, about its middle. What is on its lid can
    be read from an azimuth `seen` in its frame [rad]."""
    x, y, z = half
    radius = min(CORNER, 0.35 * min(x, y))
    shell = hood(RoundRectangle(x, y, radius), -z, z, min(2.5e-3, 0.3 * z))
    return Layer("skin", shell, "housing"), *_faces(half, label, radius, seen)


@cache
def shed(half: Half, product: str, seen: float) -> Outfit:
    """The outfeed's shed, open towards -x, about its middle."""
    x, y, z = half
    radius = min(CORNER, 0.2 * y)
    shell = hood(RoundRectangle(y, z, radius), -x, x, 3e-3).along("x")
    edge = RoundRectangle(max(0.6 * y, y - 0.018), max(0.3 * z, z - 0.018), 6e-3)
    rear = slab(edge, -OUT, OUT, PANE).along("x").moved(x=x)
    faces = _faces(half, product, radius + 6e-3, seen)
    return Layer("skin", shell, "housing"), Layer("rear", rear, "glass"), *faces


@cache
def door(half: Half) -> Outfit:
    """A plate across x with a window."""
    x, y, z = half
    plate = slab(RoundRectangle(y, z, min(4e-3, 0.3 * z)), -x, x, 0.4 * x).along("x")
    inset = min(9e-3, 0.2 * y, 0.2 * z)
    pane = slab(RoundRectangle(y - inset, 0.3 * z, 3e-3), -x - PANE, x + PANE, 2e-4).along("x")
    return Layer("skin", plate, "housing"), Layer("pane", pane, "glass")


def _faces(half: Half, label: str, radius: float, seen: float) -> Outfit:
    """Windows in the long sides of a box, and words on its lid or, where they are too long for it,
    above the windows."""
    along = half[0] >= half[1]
    wide, deep = (half[0], half[1]) if along else (half[1], half[0])
    label = label.upper()
    title = _title(half, label, radius, seen)
    room = 2 * (wide - radius - 3e-3)
    tall = 0.0 if title else height(label, room, min(0.6 * half[2], 0.016))
    tall = tall if tall >= LEAST else 0.0
    band = tall + 0.012 if tall else MARGIN
    pane = half[2] - (band + MARGIN) / 2
    glass, ink = list[Skin](), [] if title is None else [title]
    glazed = pane > 5e-3 and wide - radius > 8e-3
    if glazed:
        edge = RoundRectangle(wide - radius - 2e-3, pane, min(5e-3, pane / 2))
        skin = slab(edge, -OUT, OUT, PANE).moved(y=pane + MARGIN - half[2])
        glass = _on_both_sides(skin, deep, along)
    if tall and (text := lettering(label, tall)) is not None:
        up = half[2] - band / 2 - 1e-3 if glazed else 0.0
        skin = text.skin.moved(x=text.wide / 2 - wide + radius + 3e-3, y=up)
        ink = _on_both_sides(skin, deep + 4e-4, along)
    layers = (("window", glass, "glass"), ("name", ink, "ink"))
    return tuple(Layer(what, together(skins), of) for what, skins, of in layers if skins)


def _title(half: Half, label: str, radius: float, seen: float) -> Skin | None:
    """The words on a lid, at its left and its lower edge as the camera sees it; None where there is
    too little room."""
    turns = [n * pi / 2 for n in range(4)]
    if max(half[:2]) > 1.25 * min(half[:2]):
        turns = [turn for turn in turns if (abs(cos(turn)) > 0.5) == (half[0] > half[1])]
    turn = max(turns, key=lambda turn: cos(turn - pi / 2 - seen))
    wide, deep = half[:2] if abs(cos(turn)) > 0.5 else (half[1], half[0])
    edge = max(3e-3, 0.6 * radius)
    tall = height(label, 2 * (wide - edge), min(0.6 * deep, MOST))
    text = lettering(label, tall) if tall >= LID_LEAST else None
    if text is None:
        return None
    begun = text.skin.moved(text.wide / 2 - wide + edge, tall / 2 - deep + edge, half[2] + 3e-4)
    return begun.spun(turn)


UPRIGHT = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""Stands what lies in the plane z = 0 up, to be read from -y."""


def _on_both_sides(skin: Skin, deep: float, along: bool) -> list[Skin]:
    """What is flat in the plane z = 0, upright on both long sides of a box, which are so far from
    its middle, to be read from outside."""
    standing = skin.turned(UPRIGHT).moved(y=-deep)
    first = 0.0 if along else pi / 2
    return [standing.spun(first), standing.spun(first + pi)]
