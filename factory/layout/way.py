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

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import ceil

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.intp]

FAR = 1e9
"""Where a corner is that a way does not have [m]."""

NEWTON = 4
"""Steps in which the nearest point of a corner is found: the error is below a nanometre."""


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
    """Some ways (n,) from the origin, which begin and end along the first axis.

    `corner` (n, c): coordinates of their corners, FAR for none; `start` (n, c + 1), `point`
    (n, c + 1, 2) and `way` (n, c + 1, 2): coordinate and place where each leg begins, and its
    direction; `rounding` (n,) [m].
    """

    corner: Array
    start: Array
    point: Array
    way: Array
    rounding: Array

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
        start = np.concatenate([np.zeros((len(bends), 1)), corner], axis=1)
        legs = np.diff(start, axis=1)[:, :, None] * way[:, :-1]
        point = np.concatenate([np.zeros((len(bends), 1, 2)), np.cumsum(legs, axis=1)], axis=1)
        curved = [radius if row else 1.0 for row, radius in zip(bends, rounding, strict=True)]
        return cls(corner, start, point, way, np.array(curved, float))

    def at(self, rows: Index, x: Array) -> tuple[Array, Array, Array]:
        """Places, first and second derivatives (..., m, 2) of the ways `rows` (m,) at coordinates
        (..., m) [m]."""
        leg = (x[..., None] > self.corner[rows]).sum(axis=-1)
        place = self.point[rows, leg] + self.way[rows, leg] * (x - self.start[rows, leg])[..., None]
        round_ = self.rounding[rows][:, None]
        off = x[..., None] - self.corner[rows]
        inside = np.maximum(round_ - np.abs(off), 0.0)
        turn = self.way[rows, 1:] - self.way[rows, :-1]
        share = inside / (2 * round_)
        place = place + np.einsum("...mc,mcj->...mj", inside * share / 2, turn)
        slope = np.where(off > 0.0, -share, share)
        first = self.way[rows, leg] + np.einsum("...mc,mcj->...mj", slope, turn)
        bent = np.where(inside > 0.0, 1.0 / (2 * round_), 0.0)
        return place, first, np.einsum("...mc,mcj->...mj", bent, turn)

    def nearest(self, places: Array) -> Array:
        """The coordinates (n,) of the points of the ways that are nearest to places (n, 2) [m];
        before the first corner and after the last, those of their lines."""
        rows = np.arange(len(places))
        ahead = np.einsum("nlj,nlj->nl", places[:, None] - self.point, self.way)
        low, high = np.zeros_like(self.start), np.full_like(self.start, FAR)
        low[:, 0], high[:, :-1] = -FAR, np.diff(self.start, axis=1)
        ahead = np.clip(ahead, low, high)
        off = places[:, None] - self.point - ahead[..., None] * self.way
        leg = (off**2).sum(axis=-1).argmin(axis=1)
        x = self.start[rows, leg] + ahead[rows, leg]
        for _ in range(NEWTON):
            place, first, second = self.at(rows, x)
            apart = places - place
            slope = (first**2).sum(axis=-1) - (apart * second).sum(axis=-1)
            x = x + (apart * first).sum(axis=-1) / np.maximum(slope, 0.25)
        return np.asarray(x)

    def pieces(self, row: int, low: float, high: float) -> Iterator[Array]:
        """A way between two coordinates [m] piece by piece: the two ends of a straight one, the
        three control points of a parabola. Each piece lies in the hull of its points (k, 2)."""
        corners = self.corner[row][self.corner[row] < FAR]
        ends = (corners[:, None] + self.rounding[row] * np.array([-1.0, 0.0, 1.0])).ravel()
        cuts = [low, *(cut for cut in ends.tolist() if low < cut < high), high]
        middle, half = np.add(cuts[:-1], cuts[1:]) / 2, np.diff(cuts)[:, None] / 2
        place, first, second = self.at(np.full(len(middle), row), middle)
        lift = second * half**2 / 2
        begin, turn, end = place - first * half + lift, place - lift, place + first * half + lift
        for number, bent in enumerate((second != 0.0).any(axis=1)):
            points = (begin, turn, end) if bent else (begin, end)
            yield np.stack([side[number] for side in points])


@lru_cache(maxsize=4096)
def way_of(bends: tuple[Bend, ...], rounding: float) -> Ways:
    """One way with these bends."""
    return Ways.of([bends], [rounding])


def rounding_for(speed: float, acceleration: float) -> float:
    """The rounding of corners that are passed at a speed [m/s] with an acceleration [m/s²] on each
    axis [whole mm]."""
    return ceil(speed**2 / (2 * acceleration) * 1000 - 1e-6) / 1000
