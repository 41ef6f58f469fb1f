"""The curves of all legs of a cell, with the torques that the drives need along them.

The coordinate of a leg is that of its robot's axis: it grows from where the robot places, at the
robot's reach, to where it takes its parts. A leg that brings a part is followed backwards.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from factory.apps.arms.chain import SerialChain
from factory.apps.arms.dynamics import scalar_law
from factory.apps.arms.joint_way import JointWay
from factory.support.arrays import Array, Index

SAMPLES = 600
"""Number of places on a leg at which torques are computed; between them they are interpolated."""


@dataclass(frozen=True, eq=False)
class Leg:
    """A leg of a robot.

    Attributes:
        chain: the arm.
        way: the curve in joint space.
        reach: the axis's coordinate where the robot places [m].
        brings: whether the robot brings a part on it.
        center: centre of mass of a part in the tool's frame (3,) [m].
        damping: of the joints (n,) [N m s/rad, N s/m].
    """

    chain: SerialChain
    way: JointWay
    reach: float
    brings: bool
    center: Array
    damping: Array

    def along(self, x: Array) -> Array:
        """Coordinates of the way at coordinates of the axis [m]."""
        off = x - self.reach
        return self.way.length - off if self.brings else off

    def on_axis(self, s: float) -> float:
        """The coordinate of the axis at one of the way [m]."""
        return self.reach + (self.way.length - s if self.brings else s)

    @property
    def sign(self) -> float:
        """Derivative of the way's coordinate by that of the axis."""
        return -1.0 if self.brings else 1.0

    def at(self, x: Array) -> tuple[Array, Array, Array]:
        """Configurations and their derivatives by the axis's coordinate (..., n)."""
        place, first, second = self.way.at(self.along(x))
        return place, self.sign * first, second

    @cached_property
    def laws(self) -> Array:
        """α, β and γ of the arm alone, and what each kilogram of a part adds to them
        (SAMPLES, 2, 3, n)."""
        g, first, second = self.way.at(np.linspace(0.0, self.way.length, SAMPLES))
        loaded = self.chain.with_payload(1.0, self.center, np.zeros((3, 3)))
        empty = np.stack(scalar_law(self.chain, g, first, second), axis=1)
        full = np.stack(scalar_law(loaded, g, first, second), axis=1)
        return np.stack([empty, full - empty], axis=1)

    def force(self, x: Array, v: Array, a: Array, load: float) -> Array:
        """Torques of the drives (..., n) at coordinates, speeds and accelerations (...)."""
        at = np.clip(self.along(x) / self.way.length, 0.0, 1.0) * (SAMPLES - 1)
        low = np.minimum(at.astype(int), SAMPLES - 2)
        share = (at - low)[..., None, None, None]
        law = (1 - share) * self.laws[low] + share * self.laws[low + 1]
        law = law[..., 0, :, :] + load * law[..., 1, :, :]
        rate, gain = (self.sign * v)[..., None], (self.sign * a)[..., None]
        first = self.way.at(self.along(x))[1]
        drag = self.damping * first * rate
        return np.asarray(law[..., 0, :] * gain + law[..., 1, :] * rate**2 + law[..., 2, :] + drag)


@dataclass(frozen=True, eq=False)
class LegTable:
    """The legs of a cell, by rows: the curves that its arms follow."""

    legs: Sequence[Leg]

    @property
    def dimension(self) -> int:
        """Number of joints of an arm."""
        return len(self.legs[0].chain)

    def at(self, rows: Index, x: Array) -> tuple[Array, Array, Array]:
        """Places, first and second derivatives (..., m, n) of legs (m,) at coordinates (..., m)
        [m]."""
        points = [self.legs[row].at(x[..., k]) for k, row in enumerate(rows.tolist())]
        g, first, second = (np.stack(each, axis=-2) for each in zip(*points, strict=True))
        return g, first, second

    def along(
        self, rows: Index, places: Array, velocities: Array, near: Array
    ) -> tuple[Array, Array]:
        """Coordinates (m,) [m] of the points of legs that are nearest to configurations (m, n), and
        speeds (m,) along the legs of velocities of the joints (m, n)."""
        x, v = np.empty(len(rows)), np.empty(len(rows))
        for k, row in enumerate(rows.tolist()):
            leg = self.legs[row]
            s, speed = leg.way.along(
                places[k : k + 1], velocities[k : k + 1], leg.along(near[k : k + 1])
            )
            x[k] = leg.on_axis(float(s[0]))
            v[k] = leg.sign * speed[0]
        return x, v

    def force(
        self, rows: Index, motion: tuple[Array, Array, Array], mass: Array, load: Array
    ) -> Array:
        """Torques (..., m, n) of the drives along legs (m,) at coordinates (..., m), speeds and
        accelerations, with payloads (m,) [kg]."""
        x, v, a = motion
        torques = [
            self.legs[row].force(x[..., k], v[..., k], a[..., k], float(load[k]))
            for k, row in enumerate(rows.tolist())
        ]
        return np.stack(torques, axis=-2)


GRID = 200
"""Number of places on a leg from which the nearest is sought."""


TOGETHER = 1e-3
"""Ways that are nearer to each other run together [rad, m]."""


@dataclass(frozen=True, eq=False)
class SoughtLegs:
    """The legs of arms of which it is not known which they follow: each is on the nearest.

    Attributes:
        legs: those of each arm.
    """

    legs: Sequence[Sequence[Leg]]

    @property
    def dimension(self) -> int:
        """Number of joints of an arm."""
        return len(self.legs[0][0].chain)

    @cached_property
    def _grids(self) -> list[tuple[Array, Array]]:
        """Configurations (legs, GRID, n) of each arm's legs, and where on these (legs, GRID)
        [m]."""
        grids = []
        for legs in self.legs:
            s = np.stack([np.linspace(0.0, leg.way.length, GRID) for leg in legs])
            configurations = [leg.way.at(at)[0] for leg, at in zip(legs, s, strict=True)]
            grids.append((np.stack(configurations), s))
        return grids

    def nearest(self, places: Array) -> tuple[Array, Array]:
        """Coordinates (b,) [m] of the points of the arms' legs that are nearest to configurations
        (b, n), and first derivatives there (b, n)."""
        x, first = np.empty(len(places)), np.empty_like(places)
        for arm, q in enumerate(places):
            leg, near, _ = self._nearest(arm, q)
            x[arm] = leg.on_axis(near)
            first[arm] = leg.at(x[arm : arm + 1])[1][0]
        return x, first

    def apart(self, places: Array) -> Array:
        """Distances (b,) of configurations (b, n) from the arms' legs [rad, m]."""
        return np.array([self._nearest(arm, q)[2] for arm, q in enumerate(places)])

    def _nearest(self, arm: int, q: Array) -> tuple[Leg, float, float]:
        """The leg of an arm that is nearest to a configuration (n,), the coordinate of its way
        there [m], and how far it is [rad, m]: of those that have a place of the grid so near that
        they may be. Where some run together it is on that with the nearest place of the grid, which
        the ends of legs are."""
        (grid, s), legs = self._grids[arm], self.legs[arm]
        off = np.linalg.norm(grid - q, axis=-1)
        at, least = off.argmin(axis=1), off.min(axis=1)
        sought = list[tuple[float, int, float]]()
        for row in np.flatnonzero(least <= least.min() + self._gaps[arm] / 2).tolist():
            (near,), (apart,) = legs[row].way.nearest(q[None], s[row, at[row], None])
            sought.append((float(apart), row, float(near)))
        nearest = min(sought)[0]
        together = (one for one in sought if one[0] < nearest + TOGETHER)
        _, row, near = min(together, key=lambda one: least[one[1]])
        return legs[row], near, nearest

    @cached_property
    def _gaps(self) -> list[float]:
        """The greatest distances of neighbours in these grids [rad, m]."""
        return [float(np.linalg.norm(np.diff(g, axis=1), axis=-1).max()) for g, _ in self._grids]
