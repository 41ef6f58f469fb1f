"""Skins, which are only drawn: triangles with the normals of rounded edges, by few vertices.

A flat face keeps its normal up to its rim, and the bevel between two faces is one strip: shaded, it
is an edge as round as one of a hundred facets. Skins are kept: those of one make are one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from math import cos, pi, sin
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from factory.support.arrays import Array

Indices = NDArray[np.int64]

THICK = 1e-3
"""Thickness of the wall of what is open below [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Skin:
    """A surface of triangles.

    Attributes:
        at: vertices (n, 3) [m].
        normal: their normals (n, 3).
        face: three vertices of each triangle (k, 3), counterclockwise from outside.
    """

    at: Array
    normal: Array
    face: Indices

    def __add__(self, other: Skin) -> Skin:
        return Skin(
            np.concatenate([self.at, other.at]),
            np.concatenate([self.normal, other.normal]),
            np.concatenate([self.face, other.face + len(self.at)]),
        )

    def moved(self, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Skin:
        """The skin elsewhere."""
        return Skin(self.at + np.array([x, y, z]), self.normal, self.face)

    def turned(self, rotation: Array) -> Skin:
        """The skin turned by a rotation matrix (3, 3)."""
        return Skin(self.at @ rotation.T, self.normal @ rotation.T, self.face)

    def spun(self, angle: float) -> Skin:
        """The skin turned about the vertical by an angle [rad]."""
        c, s = cos(angle), sin(angle)
        return self.turned(np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]))

    def along(self, axis: Literal["x", "y"]) -> Skin:
        """The skin whose z becomes another axis: `x` (z, x, y) or `y` (y, z, x)."""
        order = {"x": [2, 0, 1], "y": [1, 2, 0]}[axis]
        return Skin(self.at[:, order], self.normal[:, order], self.face)


def _outward(at: Array, normal: Array, face: Indices) -> Skin:
    """The skin in which each triangle is turned as its normals are."""
    a, b, c = (at[face[:, k]] for k in range(3))
    up = np.einsum("ij,ij->i", np.cross(b - a, c - a), normal[face].sum(axis=1))
    return Skin(at, normal, np.where((up < 0)[:, None], face[:, ::-1], face))


def _strip(one: Indices, other: Indices) -> Indices:
    """The triangles between two closed rings of as many vertices."""
    nxt, beyond = np.roll(one, -1), np.roll(other, -1)
    return np.concatenate([np.stack([one, nxt, beyond], 1), np.stack([one, beyond, other], 1)])


def _fan(ring: Indices) -> Indices:
    """The triangles of a convex face."""
    first = np.full(len(ring) - 2, ring[0])
    return np.stack([first, ring[1:-1], ring[2:]], axis=1)


@cache
def rounded(x: float, y: float, z: float, bevel: float) -> Skin:
    """A box of these half sides with rounded edges: 24 vertices and 44 triangles."""
    half = np.array([x, y, z])
    bevel = min(bevel, 0.45 * float(half.min()))
    signs = np.array([[(n >> axis) & 1 for axis in range(3)] for n in range(8)]) * 2.0 - 1.0
    at, normal = np.empty((8, 3, 3)), np.zeros((8, 3, 3))
    for axis in range(3):
        at[:, axis] = signs * (half - bevel * (np.arange(3) != axis))
        normal[:, axis, axis] = signs[:, axis]
    faces = [[3 * corner, 3 * corner + 1, 3 * corner + 2] for corner in range(8)]

    def quad(*corners: tuple[int, int]) -> None:
        i, j, k, n = (3 * corner + axis for corner, axis in corners)
        faces.extend(([i, j, k], [i, k, n]))

    for axis in range(3):
        p, q = (axis + 1) % 3, (axis + 2) % 3
        along, one, other = 1 << axis, 1 << p, 1 << q
        for base in (0, along):
            quad(*((base + k, axis) for k in (0, one, one + other, other)))
        for base in (0, one, other, one + other):  # the edges along this axis
            quad((base, p), (base, q), (base + along, q), (base + along, p))
    return _outward(at.reshape(-1, 3), normal.reshape(-1, 3), np.array(faces))


@dataclass(frozen=True, slots=True)
class RoundRectangle:
    """A rectangle with round corners: its half sides and their radius [m]."""

    wide: float
    deep: float
    radius: float

    def points(self, steps: int = 5) -> tuple[Array, Array]:
        """Points and normals (n, 2), counterclockwise."""
        radius = min(self.radius, self.wide, self.deep)
        turns = (np.arange(4)[:, None] + np.linspace(0.0, 1.0, steps + 1)).ravel() * pi / 2
        normal = np.stack([np.cos(turns), np.sin(turns)], axis=1)
        corner = np.repeat([(1, 1), (-1, 1), (-1, -1), (1, -1)], steps + 1, axis=0)
        return corner * (self.wide - radius, self.deep - radius) + radius * normal, normal


@cache
def slab(edge: RoundRectangle, low: float, high: float, bevel: float = 0.0) -> Skin:
    """What stands on an outline from a height to another, its rims rounded by `bevel`."""
    points, normals = edge.points()
    bevel = min(bevel, 0.45 * (high - low))
    inner, n = points - bevel * normals, len(points)
    rings = (inner, low, -1.0), (points, low + bevel, 0.0), (points, high - bevel, 0.0)
    below, one, other, above = np.arange(4 * n).reshape(4, n)
    faces = [_strip(below, one), _strip(one, other), _strip(other, above), _fan(below), _fan(above)]
    return _outward(*_rings((*rings, (inner, high, 1.0)), normals), np.concatenate(faces))


@cache
def hood(edge: RoundRectangle, low: float, high: float, bevel: float) -> Skin:
    """The same open below, with an inside."""
    points, normals = edge.points()
    bevel = min(bevel, 0.45 * (high - low))
    n = len(points)
    outside = (points, low, 0.0), (points, high - bevel, 0.0), (points - bevel * normals, high, 1.0)
    one, other, above = np.arange(3 * n).reshape(3, n)
    faces = np.concatenate([_strip(one, other), _strip(other, above), _fan(above)])
    outer = _outward(*_rings(outside, normals), faces)
    wall, ceiling = points - THICK * normals, high - THICK
    within = (points, low, -1.0), (wall, low, -1.0), (wall, ceiling, -1.0)
    one, other, above = np.arange(3 * n).reshape(3, n)
    rim = _outward(*_rings(within, normals), np.concatenate([_strip(one, other), _fan(above)]))
    one, other = np.arange(2 * n).reshape(2, n)
    sides = _rings(((wall, low, 0.0), (wall, ceiling, 0.0)), -normals)
    return outer + rim + _outward(*sides, _strip(one, other))


def _rings(rows: Sequence[tuple[Array, float, float]], normals: Array) -> tuple[Array, Array]:
    """Vertices and normals of rings: points, a height, and 1 or -1 where the normals are vertical,
    0 where they are those of the outline."""
    at = [np.column_stack([points, np.full(len(points), z)]) for points, z, _ in rows]
    sideways = np.column_stack([normals, np.zeros(len(normals))])
    normal = [
        np.tile([0.0, 0.0, up], (len(points), 1)) if up else sideways for points, _, up in rows
    ]
    return np.concatenate(at), np.concatenate(normal)


@cache
def spindle(profile: tuple[tuple[float, float], ...], steps: int = 28) -> Skin:
    """What a row of radii and heights (r, z), from below, makes when it goes round the z axis;
    sharp at each of its corners."""
    turn = 2 * pi * np.arange(steps) / steps
    u, v = np.cos(turn), np.sin(turn)
    at, normal, faces = list[Array](), list[Array](), list[Indices]()
    for number, ((r, z), (s, w)) in enumerate(pairwise(profile)):
        across, up = np.array([w - z, r - s]) / max(np.hypot(w - z, r - s), 1e-12)
        for radius, height in ((r, z), (s, w)):
            at.append(np.stack([radius * u, radius * v, np.full(steps, height)], axis=1))
            normal.append(np.stack([across * u, across * v, np.full(steps, up)], axis=1))
        one, other = np.arange(2 * steps).reshape(2, steps) + 2 * steps * number
        faces.append(_strip(one, other))
    return _outward(np.concatenate(at), np.concatenate(normal), np.concatenate(faces))


@cache
def extrusion(section: tuple[tuple[float, float], ...], half: float) -> Skin:
    """A profile along x from -half to half: a closed section (y, z), counterclockwise, sharp at its
    corners, closed at its ends."""
    points = np.asarray(section, float)
    beyond = np.roll(points, -1, axis=0)
    way = beyond - points
    out = np.stack([way[:, 1], -way[:, 0]], axis=1) / np.linalg.norm(way, axis=1)[:, None]
    corners = np.stack([points, points, beyond, beyond], axis=1).reshape(-1, 2)
    ahead = np.tile([-half, half, half, -half], len(points))
    first = 4 * np.arange(len(points))[:, None]
    sides = Skin(
        np.column_stack([ahead, corners]),
        np.column_stack([np.zeros(len(corners)), np.repeat(out, 4, axis=0)]),
        np.concatenate([first + corner for corner in np.array([[0, 1, 2], [0, 2, 3]])]),
    )
    made = _outward(sides.at, sides.normal, sides.face)
    for end in (-1.0, 1.0):
        made = made + _cap(points, end * half, end)
    return made


def _cap(points: Array, x: float, out: float) -> Skin:
    """The end of a profile."""
    from manifold3d import triangulate

    at = np.column_stack([np.full(len(points), x), points])
    face = np.asarray(triangulate([points]), np.int64)
    return _outward(at, np.tile([out, 0.0, 0.0], (len(at), 1)), face)
