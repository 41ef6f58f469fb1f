"""Lettering: words in capitals of strokes, as flat skins for plates and housings."""

from __future__ import annotations

import unicodedata
from dataclasses import dataclass
from functools import cache

import numpy as np

from factory.film.skins import Indices, Skin
from factory.support.arrays import Array

GLYPHS = {
    "A": "00,24,40 11,31",
    "B": "00,04,34,43,32,02 32,41,30,00",
    "C": "43,34,14,03,01,10,30,41",
    "D": "00,04,24,43,41,20,00",
    "E": "44,04,00,40 02,32",
    "F": "44,04,00 02,32",
    "G": "43,34,14,03,01,10,30,41,42,22",
    "H": "00,04 40,44 02,42",
    "I": "04,00",
    "J": "34,31,20,10,01",
    "K": "00,04 44,02,40",
    "L": "04,00,40",
    "M": "00,04,22,44,40",
    "N": "00,04,40,44",
    "O": "10,01,03,14,34,43,41,30,10",
    "P": "00,04,34,43,32,02",
    "Q": "10,01,03,14,34,43,41,30,10 21,40",
    "R": "00,04,34,43,32,02 22,40",
    "S": "43,34,14,03,12,32,41,30,10,01",
    "T": "04,44 24,20",
    "U": "04,01,10,30,41,44",
    "V": "04,20,44",
    "W": "04,10,22,30,44",
    "X": "00,44 04,40",
    "Y": "04,22,44 22,20",
    "Z": "04,44,00,40",
    "r": "00,03 01,13,23",
    "0": "10,01,03,14,34,43,41,30,10",
    "1": "13,24,20",
    "2": "03,14,34,43,42,00,40",
    "3": "03,14,34,43,32,22 32,41,30,10,01",
    "4": "30,34,01,41",
    "5": "44,04,02,32,41,30,10,01",
    "6": "43,34,14,03,01,10,30,41,32,02",
    "7": "04,44,10",
    "8": "12,03,14,34,43,32,12,01,10,30,41,32,12",
    "9": "01,10,30,41,43,34,14,03,12,42",
    "-": "12,32",
    "_": "00,40",
    ".": "10,11",
    "+": "12,32 21,23",
    "/": "00,44",
    ":": "10,11 13,14",
    "#": "10,14 30,34 01,41 03,43",
}
"""Letters and digits by their strokes: corners on a grid of 4 by 4 units, x and y of each."""

NARROW = 0.8
"""Width of a unit of the grid as a share of its height."""

GAP = 1.3
"""Between two letters, in units of the grid; a space is one more."""

WEIGHT = 0.17
"""Width of a stroke as a share of the height of a letter."""

BLUNT = 0.5
"""Corners are rounded whose sides have at least this cosine, so that chamfers become arcs."""

MITRE = 0.45
"""Sharp corners stand out no further than a stroke's half width over this."""


@dataclass(frozen=True, slots=True)
class Lettering:
    """Flat letters in the plane z = 0, their middle at the origin, and their width [m]."""

    skin: Skin
    wide: float


@cache
def lettering(text: str, tall: float) -> Lettering | None:
    """The letters of a text at a height [m]; None where there are none. Accents are left out."""
    unit, right = tall / 4, 0.0
    at, faces, corners = list[Array](), list[Indices](), 0
    for letter in unicodedata.normalize("NFKD", text):
        strokes = _strokes(letter)
        if not strokes:
            right += GAP * unit * letter.isspace()
            continue
        across = np.concatenate([line for line, _ in strokes])[:, 0]
        for line, closed in strokes:
            strip = _strip(unit * (line - (across.min(), 0.0)), WEIGHT * tall / 2, closed)
            faces.append(corners + _quads(len(line), closed))
            at.append(strip + np.array([right, 0.0]))
            corners += len(strip)
        right += unit * (float(np.ptp(across)) + GAP)
    if not at:
        return None
    wide = right - GAP * unit
    flat = np.concatenate(at) - (wide / 2, tall / 2)
    points, up = np.column_stack([flat, np.zeros(corners)]), np.tile([0.0, 0.0, 1.0], (corners, 1))
    return Lettering(Skin(points, up, np.concatenate(faces)), wide)


def height(text: str, wide: float, most: float) -> float:
    """The height of a text that is to be no wider and no higher than this [m], 0 for no text."""
    sample = lettering(text, 1.0)
    return min(most, wide / max(sample.wide, 1e-6)) if sample else 0.0


@cache
def _strokes(letter: str) -> tuple[tuple[Array, bool], ...]:
    """The strokes of a letter: points (n, 2) on the grid, and whether the last leads to the
    first."""
    lines = list[tuple[Array, bool]]()
    for stroke in (GLYPHS.get(letter) or GLYPHS.get(letter.upper(), "")).split():
        corners = [(NARROW * int(at[0]), float(at[1])) for at in stroke.split(",")]
        closed = corners[0] == corners[-1]
        line = np.array(corners[:-1] if closed else corners)
        lines.append((_smooth(_smooth(line, closed), closed), closed))
    return tuple(lines)


def _sides(line: Array, closed: bool) -> tuple[Array, Array]:
    """The ways (n, 2) to each point of a line and on from it; at an open end they are one."""
    before, after = line - np.roll(line, 1, axis=0), np.roll(line, -1, axis=0) - line
    if not closed:
        before[0], after[-1] = after[0], before[-1]
    return before, after


def _smooth(line: Array, closed: bool) -> Array:
    """A line whose blunt corners are cut at a quarter of their sides."""
    rows = list[Array]()
    for point, before, after in zip(line, *_sides(line, closed), strict=True):
        cosine = before @ after / (np.linalg.norm(before) * np.linalg.norm(after))
        cut = BLUNT <= cosine < 1 - 1e-9
        rows += [point - before / 4, point + after / 4] if cut else [point]
    return np.array(rows)


def _strip(line: Array, half: float, closed: bool) -> Array:
    """The edges (2 n, 2) of a stroke along a line, left and right of each point in turn; open ends
    stand out by half its width."""
    ways = [way / np.linalg.norm(way, axis=1)[:, None] for way in _sides(line, closed)]
    middle = ways[0] + ways[1]
    middle /= np.maximum(np.linalg.norm(middle, axis=1)[:, None], 1e-9)
    cosine = np.einsum("ij,ij->i", middle, ways[0])
    out = np.stack([-middle[:, 1], middle[:, 0]], axis=1)
    out *= half / np.maximum(cosine, MITRE)[:, None]
    if not closed:
        line = line.copy()
        line[[0, -1]] += half * np.array([-middle[0], middle[-1]])
    return np.stack([line + out, line - out], axis=1).reshape(-1, 2)


def _quads(count: int, closed: bool) -> Indices:
    """The triangles of a strip of so many pairs of points, counterclockwise."""
    first = 2 * np.arange(count if closed else count - 1)
    after = (first + 2) % (2 * count)
    one, other = np.stack([first, first + 1, after + 1], 1), np.stack([first, after + 1, after], 1)
    return np.concatenate([one, other])
