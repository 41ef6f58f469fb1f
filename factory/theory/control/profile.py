"""Braking profiles and the times that follow from them.

A robot with speed limit v and acceleration limit a goes a distance d along a trapezoid of speed. In
the ideal world it has its speed at once and only brakes. A run goes by ticks (`governed.py`).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np

from factory.support.arrays import Array


def landing_speed(distance: Array, acceleration: Array, dt: float) -> Array:
    """The greatest speed (n,) [m/s] for the next tick from which a robot lands exactly at
    `distance` (n,) >= 0 [m], braking by at most a·dt a tick; sqrt(2 a d) as dt goes to 0.

    Braking from n·a·dt takes c·n(n+1), c = a·dt²/2, and in between linearly more; with d = c·w,
    n the integer part of sqrt(w + 1/4) - 1/2, this is inverted to a·dt/2 · (n + w/(n+1)).
    """
    half = acceleration * (dt / 2)
    w = distance / (half * dt)
    n = np.floor(np.sqrt(w + 0.25) - 0.5)
    w /= n + 1.0
    w += n
    w *= half
    return w


@dataclass(frozen=True, slots=True)
class SpeedProfile:
    """The trapezoids of a robot with a speed [m/s] and an acceleration limit [m/s²]."""

    speed: float = 0.5
    acceleration: float = 2.0

    def rest(self, distance: float, start: float = 0.0) -> float:
        """The least time [s] to come to rest `distance` [m] ahead from the speed `start` [m/s]."""
        a, peak = self.acceleration, self._peak(distance, start)
        if not peak:
            return 0.0
        cruise = max(distance - (2 * peak * peak - start * start) / (2 * a), 0.0)
        return (2 * peak - start) / a + cruise / peak

    def landing(self, distance: float) -> float:
        """The least time [s] to come to rest `distance` [m] ahead, from whatever speed: that of a
        robot in the ideal world, which has no ramp at the start."""
        return self.rest(distance, self.braking(distance))

    def braking(self, distance: float) -> float:
        """The greatest speed [m/s] from which a robot comes to rest in `distance` [m]."""
        return min(self.speed, sqrt(2.0 * self.acceleration * distance))

    def staged(self, distance: float, standoff: float, opens: float) -> float:
        """The time [s] at which a gated robot rests at its goal, `distance` [m] ahead, if its gate
        opens at `opens` [s]: it makes for its standoff, and goes on from where it then is, moving
        or not."""
        way, speed = self.gone(max(distance - standoff, 0.0), opens)
        return opens + self.rest(max(distance - way, 0.0), speed)

    def gone(self, distance: float, time: float) -> tuple[float, float]:
        """How far [m] a robot has come after `time` [s] of its way over `distance`, from rest, and
        its speed."""
        a, peak = self.acceleration, self._peak(distance, 0.0)
        left, gaining = self.rest(distance) - time, peak / a
        if left <= 0:
            return distance, 0.0
        if time < gaining:
            return a * time * time / 2, a * time
        if left < gaining:
            return distance - a * left * left / 2, a * left
        return peak * (time - gaining / 2), peak

    def _peak(self, distance: float, start: float) -> float:
        """The greatest speed on the way."""
        v, a = self.speed, self.acceleration
        return max(min(v, sqrt(a * distance + start * start / 2)), start)
