"""The faces of convex bodies by location: which of them lines along an axis meet first.

How far a point is from a face along an axis is linear in the point, so the distance to the nearest
of many faces is their lower envelope. Over a rectangle a face is no part of it where another is
nearer even at its worst corner. Rectangles are divided in quarters when points are looked at there,
and what is left of the faces over each is kept.
"""

from __future__ import annotations

from functools import cached_property
from itertools import product

import numpy as np

from factory.support.arrays import Array, Index, Truth

FLAT = 1e-9
"""A face whose normal has a smaller share along a line is parallel to it."""

MANY = 1 << 16
"""The most pairs of points and faces whose room is computed for each pair."""

DEEP = 10
"""So often rectangles are divided in quarters."""


class Faces:
    """Some faces of a body as seen along an axis: the shares of their outward normals `across`
    (2, f) it and, without sign, `along` (f,) it, 1 where they are parallel to it, and how far they
    reach along their normals, `offsets` (f,) [m]."""

    def __init__(self, along: Array, across: Array, offsets: Array) -> None:
        self.along, self.across, self.offsets = along, across, offsets

    def __len__(self) -> int:
        return len(self.offsets)

    @cached_property
    def steep(self) -> Array:
        """The share of each normal across the axis (f,)."""
        return np.asarray(np.hypot(*self.across))

    def room(self, at: Array) -> Array:
        """How far points (n, 2) across the axis, at its origin, are inside of each (n, f) [m]:
        along the axis or, where the face is parallel to it, across."""
        return np.asarray((self.offsets - products(at, self.across)) / self.along)

    def room_of(self, at: Array, radius: Array) -> Array:
        """The same for the points of discs about points (n, 2), of radii (n,) [m], that are the
        furthest inside of each (n, f)."""
        rising = radius[:, None] * self.steep
        return np.asarray((self.offsets - products(at, self.across) + rising) / self.along)

    def among(self, which: Index | Truth) -> Faces:
        """A selection of faces."""
        return Faces(self.along[which], self.across[:, which], self.offsets[which])

    def nearest(self, at: Array, radius: Array) -> Index:
        """For each of some discs (n,) about points (n, 2) the number of the face of least room. Of
        many discs and faces the discs are divided in halves."""
        if len(at) * len(self) <= MANY or len(at) == 1:
            return np.asarray(self.room_of(at, radius).argmin(axis=1))
        measures = np.column_stack([at, radius])
        low, high = measures.min(axis=0), measures.max(axis=0)
        ends = np.array([*product(*zip(low, high, strict=True))])
        kept = np.flatnonzero(_least_somewhere(self.room_of(ends[:, :2], ends[:, 2])))
        number, some = np.empty(len(at), np.intp), self.among(kept)
        order = np.argsort(measures[:, (high - low).argmax()], kind="stable")
        for half in np.array_split(order, 2):
            number[half] = kept[some.nearest(at[half], radius[half])]
        return number


class Envelope:
    """The least room of points in a rectangle from `low` to `high` (2,) across an axis [m], inside
    of `faces`; `deep`: so often it may still be divided."""

    def __init__(self, faces: Faces, low: Array, high: Array, deep: int = DEEP) -> None:
        self._low, self._middle, self._high = low, (low + high) / 2, high
        self._faces, self._deep = faces, deep
        self._quarters: dict[int, Envelope] = {}

    def least(self, at: Array) -> Array:
        """The least room (n,) of points (n, 2); infinite without faces."""
        if len(at) * len(self._faces) <= MANY or not self._deep:
            return np.asarray(self._faces.room(at).min(axis=1, initial=np.inf))
        room, right = np.empty(len(at)), at > self._middle
        number = right[:, 0] + 2 * right[:, 1]
        for quarter in range(4):
            mine = np.flatnonzero(number == quarter)
            if len(mine):
                room[mine] = self._quarter(quarter).least(at[mine])
        return room

    def _quarter(self, number: int) -> Envelope:
        if number not in self._quarters:
            right = np.array([number & 1, number >> 1], bool)
            low = np.where(right, self._middle, self._low)
            high = np.where(right, self._high, self._middle)
            corners = np.array([*product(*zip(low, high, strict=True))])
            faces = self._faces.among(_least_somewhere(self._faces.room(corners)))
            self._quarters[number] = Envelope(faces, low, high, self._deep - 1)
        return self._quarters[number]


def products(rows: Array, columns: Array) -> Array:
    """The product of matrices (n, k), (k, m), in which each value is rounded as in any larger one:
    those of a single row or column are added up in another order."""
    if 1 not in (len(rows), columns.shape[1]):
        return np.asarray(rows @ columns)
    twice = np.concatenate([rows, rows]) @ np.concatenate([columns, columns], axis=1)
    return np.asarray(twice[: len(rows), : columns.shape[1]])


def _least_somewhere(rooms: Array) -> Truth:
    """Which faces may have the least room in a region, by that at its corners (c, f)."""
    return np.asarray(rooms.min(axis=0) <= rooms.max(axis=0).min(initial=np.inf) + FLAT)
