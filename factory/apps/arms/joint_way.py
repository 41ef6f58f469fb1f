"""Ways of arms: C² cubic splines g: [0, L] -> R^n from a coordinate x [m] to configurations.

Property (∗): an arm that follows x with |ẋ| <= V and |ẍ| <= A keeps every joint within its limits.
It holds if |g'_j| V <= v_j and |g"_j| V² + |g'_j| A <= a_j for each joint j. On a piece of a cubic
spline g" is linear and g' lies in the hull of three control values, so both are bounded exactly,
piece by piece, on the spline that is followed.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from factory.apps.arms.chain import JointLimits
from factory.support.arrays import Array, Index

SETTLED = 1e-10
"""A step of Newton's method that is shorter is the last [m]."""

CLOSE = 0.02
"""The nearest coordinate is sought in steps no longer than this [m]."""


@dataclass(frozen=True, slots=True)
class WayLimits:
    """The limits within which a way's coordinate and the tool move.

    Attributes:
        speed: V, of the coordinate [m/s].
        acceleration: A, of the coordinate [m/s²].
        tool_speed: of the tool on transfers [m/s].
        end_speed: of the tool within `end_zone` of the ends [m/s].
        end_zone: length of the slow part of straight ends [m].
        tool_gain: acceleration of the tool as it leaves that part [m/s²].
    """

    speed: float = 0.5
    acceleration: float = 2.0
    tool_speed: float = 1.0
    end_speed: float = 0.25
    end_zone: float = 0.03
    tool_gain: float = 3.0


@dataclass(frozen=True, eq=False)
class JointWay:
    """A C² cubic spline through knots, its third derivative continuous at the second knot and at
    the last but one (not-a-knot).

    Attributes:
        knots: coordinates of the knots (k,), from 0 to the length, k >= 4 [m].
        places: configurations there (k, n) [rad, m].
        off: coordinate at which the straight beginning ends [m].
        hover: coordinate at which the straight end begins [m].

    Raises ValueError where the knots do not ascend from 0, or are fewer than 4.
    """

    knots: Array
    places: Array
    off: float = 0.0
    hover: float = 0.0

    def __post_init__(self) -> None:
        ascends = len(self.knots) >= 4 and self.knots[0] == 0.0 and (np.diff(self.knots) > 0).all()
        if not ascends or len(self.places) != len(self.knots):
            raise ValueError(f"{len(self.knots)} knots for {len(self.places)} configurations")

    @property
    def length(self) -> float:
        """L [m]."""
        return float(self.knots[-1])

    @cached_property
    def terms(self) -> Array:
        """g and its first, second and third derivative at the beginnings of pieces
        (k - 1, 4, n)."""
        step, slope = np.diff(self.knots)[:, None], _slopes(self.knots, self.places)
        secant = np.diff(self.places, axis=0) / step
        bend = (slope[:-1] + slope[1:] - 2 * secant) / step
        second = 2 * ((secant - slope[:-1]) / step - bend)
        return np.stack([self.places[:-1], slope[:-1], second, 6 * bend / step], axis=1)

    def at(self, x: Array) -> tuple[Array, Array, Array]:
        """Configurations g, first and second derivatives g' and g" (..., n).

        Args:
            x: coordinates (...), taken as the nearer end where they are beyond it [m].
        """
        inside = np.clip(x, 0.0, self.length)
        piece = np.clip(np.searchsorted(self.knots, inside, "right") - 1, 0, len(self.knots) - 2)
        return self._on(piece, inside)

    def _on(self, piece: Index, x: Array) -> tuple[Array, Array, Array]:
        """g, g' and g" of pieces at coordinates."""
        off = (x - self.knots[piece])[..., None]
        terms = self.terms[piece]
        g, first, second, third = (terms[..., k, :] for k in range(4))
        bend = second + off * third
        slope = first + off * (second + bend) / 2
        return g + off * (first + off * (second / 2 + off * third / 6)), slope, bend

    def bounds(self, x: Array | None = None) -> tuple[Array, Array]:
        """The least upper bounds that control values give on |g'| and |g"| of each joint between
        consecutive coordinates (m - 1, n).

        Args:
            x: coordinates in ascending order (m,), at first the knots [m].
        """
        ends = self.knots if x is None else x
        inner = self.knots[(self.knots > ends[0]) & (self.knots < ends[-1])]
        cuts = np.union1d(ends, inner)
        piece = np.searchsorted(self.knots, (cuts[:-1] + cuts[1:]) / 2, "right") - 1
        _, begin, bend = self._on(piece, cuts[:-1])
        _, end, bent = self._on(piece, cuts[1:])
        middle = begin + bend * np.diff(cuts)[:, None] / 2
        first = np.abs([begin, middle, end]).max(axis=0)
        second = np.abs([bend, bent]).max(axis=0)
        begins = np.searchsorted(cuts, ends[:-1])
        return np.maximum.reduceat(first, begins), np.maximum.reduceat(second, begins)

    def shares(self, limits: JointLimits, pace: WayLimits) -> tuple[Array, Array]:
        """Greatest shares (n,) of its speed and of its acceleration that each joint uses; (∗) holds
        if none is above 1.

        Args:
            limits: those of the joints.
            pace: limits of the coordinate.
        """
        first, second = self.bounds()
        speed = first * pace.speed / limits.speed
        push = second * pace.speed**2 + first * pace.acceleration
        return speed.max(axis=0), (push / limits.acceleration).max(axis=0)

    def stretch(self, share: float) -> JointWay:
        """The same curve on a longer coordinate.

        Args:
            share: by which all coordinates are multiplied.
        """
        return JointWay(self.knots * share, self.places, self.off * share, self.hover * share)

    def nearest(self, places: Array, near: Array, rounds: int = 12) -> tuple[Array, Array]:
        """Coordinates (m,) [m] of the points that are nearest to configurations, and the distances
        from them (m,) [rad, m]: by Newton's method from a coordinate close by, since a way may pass
        a configuration twice.

        Args:
            places: configurations (m, n) [rad, m].
            near: coordinates close to those sought (m,) [m].
            rounds: greatest number of steps.
        """
        x = np.clip(near, 0.0, self.length)
        for _ in range(rounds):
            g, first, second = self.at(x)
            apart, square = g - places, (first * first).sum(axis=-1)
            bowl = square + (apart * second).sum(axis=-1)
            step = (apart * first).sum(axis=-1) / np.where(bowl > square / 4, bowl, square + 1e-300)
            x, before = np.clip(x - np.clip(step, -CLOSE, CLOSE), 0.0, self.length), x
            if np.abs(x - before).max(initial=0.0) < SETTLED:
                break
        return x, np.linalg.norm(self.at(x)[0] - places, axis=-1)

    def along(self, places: Array, velocities: Array, near: Array) -> tuple[Array, Array]:
        """Coordinates (m,) [m] of the points that are nearest to configurations, and the speeds
        (m,) along the way [m/s].

        Args:
            places: configurations (m, n) [rad, m].
            velocities: of the joints (m, n) [rad/s, m/s].
            near: coordinates close to those sought (m,) [m].
        """
        x, _ = self.nearest(places, near)
        first = self.at(x)[1]
        return x, (velocities * first).sum(axis=-1) / (first * first).sum(axis=-1)


def _slopes(x: Array, y: Array) -> Array:
    """First derivatives (k, n) at the knots of the C² spline with not-a-knot ends."""
    step = np.diff(x)
    secant = np.diff(y, axis=0) / step[:, None]
    matrix, right = np.zeros((len(x), len(x))), np.zeros_like(y)
    inner = np.arange(1, len(x) - 1)
    matrix[inner, inner - 1], matrix[inner, inner + 1] = step[1:], step[:-1]
    matrix[inner, inner] = 2 * (step[:-1] + step[1:])
    right[1:-1] = 3 * (step[1:, None] * secant[:-1] + step[:-1, None] * secant[1:])
    for row, a, b in ((0, 0, 1), (-1, -1, -2)):
        both = step[a] + step[b]
        matrix[row, row], matrix[row, b] = step[b], both
        right[row] = (step[a] + 2 * both) * step[b] * secant[a] + step[a] ** 2 * secant[b]
        right[row] /= both
    return np.asarray(np.linalg.solve(matrix, right), float)
