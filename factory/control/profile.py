"""Braking profiles and the times that follow from them.

A robot with speed limit v and acceleration limit a goes a distance d along a trapezoid of speed. In
the ideal world it has its speed at once and only brakes.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from factory.control.mode import Array, Limits, Mode

Reals = float | Array
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


def travel_time(distance: Reals, v: Reals, a: Reals, start: Reals) -> Array:
    """The least time [s] to come to rest `distance` [m] ahead from the speed `start` [m/s]."""
    return np.asarray(sum(_phases(distance, v, a, start)[:3]))


def trapezoid_time(distance: Reals, v: Reals, a: Reals) -> Array:
    """The least time [s] from rest to rest over `distance` [m]."""
    return travel_time(distance, v, a, 0.0)


def ideal_time(distance: Reals, v: Reals, a: Reals) -> Array:
    """The time [s] to rest over `distance` [m] where ẋ = F exactly: no ramp at the start."""
    return travel_time(distance, v, a, _instant(distance, v, a))


def travelled(
    distance: Reals, v: Reals, a: Reals, start: Reals, time: Reals
) -> tuple[Array, Array]:
    """How far [m] a robot has come after `time` [s] of its way over `distance`, and its speed."""
    gaining, cruising, braking, peak = _phases(distance, v, a, start)
    left = np.maximum(time, 0.0)
    g = np.minimum(left, gaining)
    c = np.clip(left - gaining, 0.0, cruising)
    b = np.clip(left - gaining - cruising, 0.0, braking)
    way = g * (start + a * g / 2) + peak * c + b * (peak - a * b / 2)
    return np.asarray(way), np.asarray(start + a * g - a * b)


def staged_time(
    distance: Reals,
    standoff: Reals,
    opens: Reals,
    v: Reals,
    a: Reals,
    world: World = "mujoco",
) -> Array:
    """The time [s] at which a gated robot rests at its goal, `distance` [m] ahead, if its gate
    opens at `opens` [s]: it makes for its standoff, and goes on from where it then is, moving or
    not."""
    stage = np.maximum(np.asarray(distance) - standoff, 0.0)
    instant = world == "ideal"
    way, speed = travelled(stage, v, a, _instant(stage, v, a) if instant else 0.0, opens)
    rest = np.maximum(distance - way, 0.0)
    return opens + travel_time(rest, v, a, _instant(rest, v, a) if instant else speed)


def mode_time(mode: Mode, x0: Array, limits: Limits, world: World = "mujoco") -> float:
    """The time [s] a mode takes from rest at `x0` until it is at its goal, dwell included.

    In the ideal world that is when the last robot enters the goal ball, in mujoco when the last
    reference comes to rest. Exact to two ticks where the mode is `clear_from` x0, and one more for
    each further robot that waits for one that waits.
    """
    if mode.is_still:
        return mode.dwell
    distance = np.abs(x0 - mode.goals)
    tail = ideal_time(mode.eps, limits.speed, limits.acceleration)
    rested, entered = np.zeros(mode.size), np.zeros(mode.size)
    for i in mode.order:
        v, a, gate = limits.speed[i], limits.acceleration[i], mode.gate[i]
        opens = entered[gate] if gate >= 0 else 0.0
        standoff = mode.standoff[i] if gate >= 0 else 0.0
        rested[i] = staged_time(distance[i], standoff, opens, v, a, world)
        entered[i] = max(rested[i] - tail[i], 0.0)
    return float(np.max(entered if world == "ideal" else rested)) + mode.dwell


def _instant(distance: Reals, v: Reals, a: Reals) -> Array:
    """The speed of the ideal world: at once as fast as the limit or the braking profile allows."""
    return np.asarray(np.minimum(v, np.sqrt(2.0 * a * np.asarray(distance))))


def _phases(distance: Reals, v: Reals, a: Reals, start: Reals) -> tuple[Array, Array, Array, Array]:
    """The times spent gaining speed, cruising and braking, and the peak speed."""
    distance, v, a, start = np.broadcast_arrays(distance, v, a, start)
    peak = np.maximum(np.minimum(v, np.sqrt(a * distance + start**2 / 2)), start)
    cruise = np.maximum(distance - (2 * peak**2 - start**2) / (2 * a), 0.0)
    time = np.divide(cruise, peak, out=np.zeros_like(peak), where=peak > 0)
    return (peak - start) / a, time, peak / a, peak
