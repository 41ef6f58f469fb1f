"""The governor: the reference that follows a mode's field within the acceleration limit."""

from __future__ import annotations

import numpy as np

from factory.support.arrays import Array
from factory.theory.control.mode import ROUNDING
from factory.theory.control.navigation import Bundle
from factory.theory.control.profile import landing_speed


def govern(
    x: Array, v: Array, wanted: Array, acceleration: Array, dt: float
) -> tuple[Array, Array, Array]:
    """One tick at the constant acceleration that comes nearest to the `wanted` speed [m/s].

    Returns position, speed and acceleration (n,) each: v1 = wanted clipped to v ± a·dt,
    x1 = x + (v + v1)/2 · dt.
    """
    step = acceleration * dt
    v1 = np.minimum(np.maximum(wanted, v - step), v + step)
    return x + (v + v1) * (dt / 2), v1, (v1 - v) / dt


def follow(bundle: Bundle, x: Array, v: Array, dt: float) -> tuple[Array, Array, Array]:
    """One governed tick of the bundle's field: half a tick's drift, the field there, half a tick's
    drift.

    The field's profile lands exactly from where it is asked for, so the reference never passes its
    target, and reaches it at rest, if it started at rest or slow enough to stop: half the tick at
    v and half at v1 take d = (v + v1)/2 · dt, and landing_speed(d - v·dt/2) leaves the rest of the
    way to braking by a·dt a tick.
    """
    return govern(x, v, bundle.field(x + v * (dt / 2), dt), bundle.acceleration, dt)


def towards(
    goals: Array, x: Array, v: Array, limits: tuple[Array, Array], tick: float
) -> tuple[Array, Array, Array]:
    """A tick [s] of n axes that go to their goals [m] as fast as their limits, speeds [m/s] and
    accelerations [m/s²], allow, and rest there: positions, speeds and accelerations."""
    most, acceleration = limits
    left = goals - (x + v * (tick / 2))
    wanted = np.minimum(landing_speed(np.abs(left), acceleration, tick), most)
    x1, v1, a = govern(x, v, np.copysign(wanted, left), acceleration, tick)
    there = (np.abs(x1 - goals) < ROUNDING) & (np.abs(v1) < ROUNDING)
    return np.where(there, goals, x1), np.where(there, 0.0, v1), a
