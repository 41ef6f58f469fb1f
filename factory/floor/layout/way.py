"""Ways: the curves that robots follow on the floor, straight or with rounded corners.

A way is an axis-parallel polyline whose corners are parabolas. Its coordinate is the length of the
polyline, so every control law stays scalar. A corner of `rounding` δ reaches from δ before it to δ
after it; there the way is w = e²/4δ inside the polyline, along the difference of its two
directions, with e the distance to the nearer end of the corner. So it is C¹; its first derivative
is never longer than 1, and its second is constant, at most 1/2δ on each axis. A robot of speed v
thus goes round a corner of δ = v²/2a at full speed with an acceleration of a on each axis, and of
no more than 2a while it brakes there.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import ceil
from typing import Protocol

import numpy as np

from factory.support.arrays import Array, Index

FAR = 1e9
"""Where a corner is that a way does not have [m]."""


@dataclass(frozen=True, slots=True)
class Bend:
    """Two corners of a way: at the coordinate `at` it leaves its line, and goes on beside it,
    `across` further along the second axis [m]; but where it ends before."""

    at: float
    across: float

    @property
    def end(self) -> float:
        """The coordinate of the second corner [m]."""
        return self.at + abs(self.across)


@dataclass(frozen=True, slots=True, eq=False)
class Ways:
    """Some ways (n,) from the origin, which begin and end along the first axis, piece by piece:
    straight and round in turn, each with a constant second derivative.

    Attributes:
        ends: coordinates of the ends of pieces, from -FAR to FAR, padded with FAR for ways with
            fewer pieces (n, 2c + 2).
        middle: where straight pieces begin, and the corners of round ones (n, 2c + 1).
        terms: place, first and second derivative there (n, 2c + 1, 3, d).
        rounding: (n,) [m].
    """

    ends: Array
    middle: Array
    terms: Array
    rounding: Array

    @property
    def dimension(self) -> int:
        """d: that of the space that they are in."""
        return int(self.terms.shape[-1])

    @classmethod
    def of(cls, bends: Sequence[Sequence[Bend]], rounding: Sequence[float]) -> Ways:
        """Those with these bends."""
        count = 2 * max((len(row) for row in bends), default=0)
        corner = np.full((len(bends), count), FAR)
        way = np.zeros((len(bends), count + 1, 2))
        way[:, :, 0] = 1.0
        for number, row in enumerate(bends):
            for step, bend in enumerate(row):
                corner[number, 2 * step : 2 * step + 2] = bend.at, bend.end
                way[number, 2 * step + 1] = 0.0, np.copysign(1.0, bend.across)
        curved = [radius if row else 1.0 for row, radius in zip(bends, rounding, strict=True)]
        radius = np.array(curved, float)
        start = np.concatenate([np.zeros((len(bends), 1)), corner], axis=1)
        legs = np.diff(start, axis=1)[:, :, None] * way[:, :-1]
        point = np.concatenate([np.zeros((len(bends), 1, 2)), np.cumsum(legs, axis=1)], axis=1)
        terms = np.zeros((len(bends), 2 * count + 1, 3, 2))
        terms[:, ::2, 0], terms[:, ::2, 1] = point, way
        turn, reach = np.diff(way, axis=1), radius[:, None]
        terms[:, 1::2, 0] = point[:, 1:] + turn * reach[..., None] / 4
        terms[:, 1::2, 1] = (way[:, :-1] + way[:, 1:]) / 2
        terms[:, 1::2, 2] = turn / (2 * reach[..., None])
        middle = np.insert(start, np.arange(1, count + 1), corner, axis=1)
        ends = np.full((len(bends), 2 * count + 2), FAR)
        ends[:, 0], ends[:, 1:-1:2], ends[:, 2:-1:2] = -FAR, corner - reach, corner + reach
        return cls(ends, middle, terms, radius)

    @classmethod
    def bent(cls, ways: Iterable[BentWay]) -> Ways:
        """Those of bent ways."""
        rows = [*ways]
        return cls.of([row for row, _ in rows], [rounding for _, rounding in rows])

    def at(self, rows: Index, x: Array) -> tuple[Array, Array, Array]:
        """Places, first and second derivatives (..., m, 2) of the ways `rows` (m,) at coordinates
        (..., m) [m]."""
        piece = (x[..., None] > self.ends[rows, 1:-1]).sum(axis=-1)
        off, terms = (x - self.middle[rows, piece])[..., None], self.terms[rows, piece]
        place, first, second = terms[..., 0, :], terms[..., 1, :], terms[..., 2, :]
        gain = off * second
        return place + off * (first + gain / 2), first + gain, second

    def nearest(self, places: Array) -> tuple[Array, Array]:
        """The coordinates (n,) of the points of the ways that are nearest to places (n, 2) [m], and
        first derivatives (n, 2) there; before the first corner and after the last, of their lines.

        On a round piece the coordinate is u δ from the corner, where u³ + p u = q. That has one
        solution if p > 0, which it is for a place that is not far inside the corner.
        """
        place, first, second = self.terms.transpose(2, 0, 1, 3)
        apart, reach = places[:, None] - place, self.rounding[:, None]
        off = np.einsum("npj,npj->np", apart, first)
        lift = np.einsum("npj,npj->np", apart[:, 1::2], second[:, 1::2])
        half = np.sqrt(np.maximum(2.0 - 4.0 * lift, 0.25) / 3.0)
        turned = np.arcsinh(2.0 * off[:, 1::2] / (reach * half**3))
        off[:, 1::2] = 2.0 * reach * half * np.sinh(turned / 3.0)
        low, high = self.ends[:, :-1] - self.middle, self.ends[:, 1:] - self.middle
        off = np.minimum(np.maximum(off, low), high)
        left = apart - off[..., None] * (first + off[..., None] / 2 * second)
        best = np.arange(len(places)), np.einsum("npj,npj->np", left, left).argmin(axis=1)
        return self.middle[best] + off[best], first[best] + off[best][:, None] * second[best]

    def along(
        self, rows: Index, places: Array, velocities: Array, near: Array
    ) -> tuple[Array, Array]:
        """The coordinates (n,) of the points that are nearest to places (n, d), and the speeds (n,)
        along the ways of velocities (n, d). `rows` (n,) are all ways; what is `near` is not
        needed."""
        x, first = self.nearest(places)
        return x, (velocities * first).sum(axis=-1) / (first**2).sum(axis=-1)

    def apart(self, places: Array) -> Array:
        """Distances (n,) of places (n, 2) from the ways [m]."""
        x, _ = self.nearest(places)
        return np.asarray(np.linalg.norm(self.at(np.arange(len(x)), x)[0] - places, axis=1))

    def force(
        self, rows: Index, motion: tuple[Array, Array, Array], mass: Array, load: Array
    ) -> Array:
        """The forces (..., m, d) of drives along each axis that move masses (m,), with their loads
        (m,) [kg], along the ways `rows` (m,): at coordinates (..., m), speeds and accelerations
        [N]."""
        x, v, a = motion
        _, first, second = self.at(rows, x)
        gain = first * a[..., None] + second * (v**2)[..., None]
        return np.asarray((mass + load)[:, None] * gain)

    def pieces(self, row: int, low: float, high: float) -> Iterator[Array]:
        """A way between two coordinates [m] piece by piece: the two ends of a straight one, the
        three control points of half a corner. Each lies in the hull of its points (k, 2)."""
        every = sorted([*self.ends[row].tolist(), *self.middle[row, 1::2].tolist()])
        cuts = [low, *(cut for cut in every if low < cut < high), high]
        middle, half = np.add(cuts[:-1], cuts[1:]) / 2, np.diff(cuts)[:, None] / 2
        place, first, second = self.at(np.full(len(middle), row), middle)
        lift = second * half**2 / 2
        begin, turn, end = place - first * half + lift, place - lift, place + first * half + lift
        for number, bent in enumerate((second != 0.0).any(axis=1)):
            points = (begin, turn, end) if bent else (begin, end)
            yield np.stack([side[number] for side in points])


BentWay = tuple[tuple[Bend, ...], float]
"""The bends of a guidepath, and their rounding [m]."""

BendRows = tuple[tuple[int, float, tuple[tuple[float, float], ...]], ...]
"""Bent ways as they are kept in a file: a number, the rounding, where each bend is and how far
across it leads."""


class KeptWays(Protocol):
    """What keeps bent ways in a file."""

    @property
    def bends(self) -> BendRows:
        """The ways."""


def rows_of(ways: Mapping[int, BentWay]) -> BendRows:
    """Bent ways by number, as they are kept."""
    return tuple(
        (number, rounding, tuple((bend.at, bend.across) for bend in row))
        for number, (row, rounding) in ways.items()
    )


def kept_in(table: KeptWays) -> dict[int, BentWay]:
    """The bent ways that a table keeps, by number."""
    return {n: (tuple(Bend(*bend) for bend in row), far) for n, far, row in table.bends}


@lru_cache(maxsize=4096)
def way_of(bends: tuple[Bend, ...], rounding: float) -> Ways:
    """One way with these bends."""
    return Ways.of([bends], [rounding])


def rounding_for(speed: float, acceleration: float) -> float:
    """The rounding of corners that are passed at a speed [m/s] with an acceleration [m/s²] on each
    axis [whole mm]."""
    return ceil(speed**2 / (2 * acceleration) * 1000 - 1e-6) / 1000
