"""Braking profiles and the times that follow from them.

A robot with speed limit v and acceleration limit a goes a distance d along a trapezoid of speed. In
the ideal world it has its speed at once and only brakes.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import Literal

import numpy as np

from factory.control.mode import Array, Limits, Mode

World = Literal["ideal", "mujoco"]


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

    def staged(
        self, distance: float, standoff: float, opens: float, instant: bool = False
    ) -> float:
        """The time [s] at which a gated robot rests at its goal, `distance` [m] ahead, if its gate
        opens at `opens` [s]: it makes for its standoff, and goes on from where it then is, moving
        or not. `instant`: it has any speed at once."""
        stage = max(distance - standoff, 0.0)
        way, speed = self.gone(stage, opens, self.braking(stage) if instant else 0.0)
        left = max(distance - way, 0.0)
        return opens + self.rest(left, self.braking(left) if instant else speed)

    def gone(self, distance: float, time: float, start: float = 0.0) -> tuple[float, float]:
        """How far [m] a robot has come after `time` [s] of its way over `distance`, and its
        speed."""
        a, peak = self.acceleration, self._peak(distance, start)
        left, gaining = self.rest(distance, start) - time, (peak - start) / a
        if left <= 0:
            return distance, 0.0
        if time < gaining:
            return start * time + a * time * time / 2, start + a * time
        if left < peak / a:
            return distance - a * left * left / 2, a * left
        return peak * (time - gaining / 2) + start * gaining / 2, peak

    def passes(self, distance: float, way: float) -> float:
        """The time [s] at which a robot passes `way` [m] on its way over `distance`, from rest to
        rest."""
        a, peak = self.acceleration, self._peak(distance, 0.0)
        left, ramp = distance - way, peak * peak / (2 * a)
        if way <= ramp:
            return sqrt(2 * way / a)
        if left <= ramp:
            return self.rest(distance) - sqrt(2 * left / a)
        return (way + ramp) / peak

    def _peak(self, distance: float, start: float) -> float:
        """The greatest speed on the way."""
        v, a = self.speed, self.acceleration
        return max(min(v, sqrt(a * distance + start * start / 2)), start)


def mode_time(mode: Mode, x0: Array, limits: Limits, world: World = "mujoco") -> float:
    """The time [s] a mode takes from rest at `x0` until it is at its goal, dwell included.

    In the ideal world that is when the last robot enters the goal ball, in mujoco when the last
    reference comes to rest. Exact to two ticks where the mode is `clear_from` x0, and one more for
    each further robot that waits for one that waits.
    """
    if mode.is_still:
        return mode.dwell
    distance, instant = np.abs(x0 - mode.goals).tolist(), world == "ideal"
    rested, entered = [0.0] * mode.size, [0.0] * mode.size
    for i in mode.order:
        profile = SpeedProfile(float(limits.speed[i]), float(limits.acceleration[i]))
        gate = mode.gate[i]
        opens, standoff = (entered[gate], float(mode.standoff[i])) if gate >= 0 else (0.0, 0.0)
        rested[i] = profile.staged(distance[i], standoff, opens, instant)
        entered[i] = max(rested[i] - profile.landing(mode.eps), 0.0)
    return max(entered if instant else rested) + mode.dwell
