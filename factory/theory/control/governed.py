"""The governed references of a mode, tick by tick: in which tick a run sees an axis pass a place,
and in which the mode is over. One axis at a time, in scalars; `governor.py` moves all axes of a run
by the same rules."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import count
from math import ceil, copysign, floor, sqrt

import numpy as np

from factory.support.arrays import Array
from factory.theory.control.mode import ROUNDING, STILL, Limits, Mode
from factory.theory.control.obstacles import OPEN


@dataclass(frozen=True, slots=True)
class GovernedAxis:
    """How an axis moves.

    Attributes:
        speed: limit [m/s].
        acceleration: limit [m/s²].
        tick: period in which its reference is governed [s].
        lag: time by which its measured speed is behind its reference [s].
        instant: whether it has any speed at once, as in the ideal world.
    """

    speed: float
    acceleration: float
    tick: float
    lag: float = 0.0
    instant: bool = False

    def landing(self, distance: float) -> float:
        """`profile.landing_speed` for one axis."""
        half = self.acceleration * (self.tick / 2)
        w = distance / (half * self.tick)
        n = floor(sqrt(w + 0.25) - 0.5)
        return (n + w / (n + 1.0)) * half

    def way(self, distance: float) -> Trajectory:
        """The way to a goal `distance` [m] ahead, from rest to rest."""
        return _way(self, distance, (0.0,))

    def gated(self, distance: float, taus: Sequence[float]) -> Trajectory:
        """The same for an axis that stays `taus` [m] from its goal in each tick, the last of them
        from then on."""
        return _way(self, distance, tuple(taus))


@dataclass(frozen=True, slots=True)
class Trajectory:
    """The reference of an axis at ticks 0, 1, ... until it is at rest: its distance `left` to the
    goal [m], its `speed` towards it, and that `measured` [m/s]."""

    left: tuple[float, ...]
    speed: tuple[float, ...]
    measured: tuple[float, ...]

    def within(self, distance: float) -> int:
        """The first tick from which the axis is nearer to its goal than `distance` [m]."""
        return _first(self.left, distance)

    def rests(self, eps: float, still: float = STILL) -> int:
        """The first tick from which it is nearer than `eps` [m], and slower than `still` [m/s]."""
        return max(self.within(eps), _first(self.measured, still))

    def passes(self, left: float) -> int:
        """The first tick in which no more than `left` [m] of the way is left."""
        return next(n for n, one in enumerate(self.left) if one <= left + ROUNDING)

    def taus(self, eps: float, standoff: float, tick: float) -> list[float]:
        """The distance [m] that an axis gated by this one keeps from its goal in each tick
        (`obstacles.Gates`)."""
        taus = []
        for left, speed in zip(self.left, self.speed, strict=True):
            off = abs(left - speed * (tick / 2))
            z = min(max((off - OPEN * eps) / ((1 - OPEN) * eps), 0.0), 1.0)
            taus.append(standoff * z * z * z * (10.0 + z * (6.0 * z - 15.0)))
        return taus


def _first(values: Sequence[float], bound: float) -> int:
    """The first index from which on all values are below a bound in magnitude."""
    first = len(values)
    while first and abs(values[first - 1]) < bound:
        first -= 1
    return min(first, len(values) - 1)


@lru_cache(maxsize=4096)
def _way(drive: GovernedAxis, distance: float, taus: tuple[float, ...]) -> Trajectory:
    """`governor.follow` for one axis until it rests at its goal."""
    tick, step, most = drive.tick, drive.acceleration * drive.tick, drive.speed
    left, v = distance, 0.0
    lefts, speeds, measured = [left], [v], [v]
    for n in count():
        if n >= len(taus) - 1 and max(abs(left), abs(v), abs(measured[-1])) < ROUNDING:
            break
        tau = taus[min(n, len(taus) - 1)]
        if drive.instant:
            off = left - tau
            v1 = v = copysign(min(most, drive.landing(abs(off))), off)
        else:
            off = left - v * (tick / 2) - tau
            wanted = copysign(min(most, drive.landing(abs(off))), off)
            v1 = min(max(wanted, v - step), v + step)
        left -= (v + v1) * (tick / 2)
        lefts.append(left)
        measured.append(0.0 if drive.instant else v1 - drive.lag * (v1 - v) / tick)
        v = v1
        speeds.append(0.0 if drive.instant else v)
    return Trajectory(tuple(lefts), tuple(speeds), tuple(measured))


def trajectories(mode: Mode, x0: Array, limits: Limits, drive: GovernedAxis) -> list[Trajectory]:
    """The references of the axes of a mode from rest at `x0`, each under its `limits`; the rest of
    `drive` is that of all. Exact where the mode is `clear_from` x0."""
    distance = np.abs(x0 - mode.goals).tolist()
    speed, acceleration = limits.speed.tolist(), limits.acceleration.tolist()
    ways: dict[int, Trajectory] = {}
    for i in mode.order:
        axis = replace(drive, speed=speed[i], acceleration=acceleration[i])
        gate, standoff = int(mode.gate[i]), float(mode.standoff[i])
        if gate >= 0 and standoff:
            taus = ways[gate].taus(mode.eps, standoff, drive.tick)
            ways[i] = axis.gated(distance[i], taus)
        else:
            ways[i] = axis.way(distance[i])
    return [ways[i] for i in range(mode.size)]


def mode_ticks(mode: Mode, ways: Sequence[Trajectory], tick: float) -> int:
    """The number of ticks [s] of a mode whose axes go these `ways`: they are in the goal ball and
    STILL, and its clock, which counts the tick in which they come there, has run out."""
    clock = ceil(mode.dwell / tick - ROUNDING)
    if mode.is_still:
        return max(1, clock)
    there = max(1, *(way.within(mode.eps) for way in ways))
    return max(there + max(clock - 1, 0), *(way.rests(mode.eps) for way in ways))
