"""The governor: the reference that follows a mode's field within the acceleration limit."""

from __future__ import annotations

import numpy as np

from factory.control.mode import Array
from factory.control.navigation import Bundle


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
