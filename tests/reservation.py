"""Reservations: the floor that a robot needs to come to rest, and the rule that keeps robots apart.

The reservation J of a robot on a way g is g([x, x + beta(v)]), beta(v) the distance in which it
comes to rest, braking by a·dt a tick. Robots update one after another in a tick. A robot takes a
speed only if the reservation that it then needs is clear of those of all others, as they are, or
comes no nearer to them than its present one; else it brakes by a·dt, and its reservation shrinks.

Theorem 14: if all reservations are clear at first, no configuration is ever in Δ, whatever fields,
markings, speeds and order of updates. Each case keeps reservations clear, and a robot stays in its
own during a tick. That takes no mode, no net and no agreement between robots. It does not make
progress by itself; on a tee `tests.ring` does.

Ways are pieces along the axes of the floor, so a reservation is boxes (p, 4): xlo, xhi, ylo, yhi
[m]. Robots do not turn, so Δ is a set of displacements: robots at p and q are in Δ where p - q is
inside one of the boxes `delta` (k, 4); on the border they are clear.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from factory.support.arrays import Array, Truth

EXACT = 1e-12
"""Distances [m] that differ by less are the same: sums of the same lengths."""

Reserve = Callable[[int, Array, Array], Array]
"""The boxes (n, p, 4) of the way of a robot (index) between two of its coordinates (n,) [m], the
lower one first."""


def braking(speed: Array, acceleration: Array, dt: float) -> Array:
    """beta (n,) [m]: the distance to rest from a speed (n,) >= 0 [m/s], braking by a·dt a tick and
    in the last one by what is left; exact, so a tick of braking leaves the stopping point as it
    is."""
    step = acceleration * dt
    left = np.maximum(speed - np.floor(speed / step + EXACT) * step, 0.0)
    return np.asarray((speed**2 - left**2) / (2.0 * acceleration) + left * (dt / 2))


def stopping(x: Array, v: Array, acceleration: Array, dt: float) -> Array:
    """Where robots at `x` [m] with velocities `v` [m/s] come to rest when they brake (n,) [m]."""
    return np.asarray(x + np.copysign(braking(np.abs(v), acceleration, dt), v))


def gaps(one: Array, other: Array, delta: Array) -> Array:
    """Least distance (...,) [m] from Δ, in the maximum norm, of displacements between points of
    boxes (..., p, 4) and of others (..., q, 4); negative by how deep they reach into it."""
    here, there = one[..., :, None, None, :], other[..., None, :, None, :]
    beyond = here[..., 0::2] - there[..., 1::2] - delta[..., 1::2]
    before = delta[..., 0::2] - here[..., 1::2] + there[..., 0::2]
    return np.asarray(np.maximum(beyond, before).max(axis=-1).min(axis=(-3, -2, -1)))


def admitted(present: Array, wished: Array, other: Array, delta: Array) -> Truth:
    """Whether robots may have the reservations that they wish for (n, p, 4) in place of their
    present ones, beside those of another (n, q, 4)."""
    gap = gaps(wished, other, delta)
    return np.asarray((gap >= 0.0) | (gap >= gaps(present, other, delta) - EXACT))


def drive(
    state: tuple[Array, Array],
    wanted: Array,
    acceleration: Array,
    dt: float,
    reserve: Reserve,
    delta: Array,
) -> tuple[Array, Array]:
    """One tick [s] of k robots, n times at once, under reservations.

    `state`: coordinates [m] and velocities [m/s] along their ways, (n, k) each; `wanted`: the
    velocities that they want (n, k), limited here to v ± a·dt, and to rest before a reversal.
    Gives the next state. A robot that may not have what it wants keeps its velocity, if that is
    less, or brakes.
    """
    x, v = state[0].copy(), state[1].copy()
    step = acceleration * dt
    slower = np.copysign(np.maximum(np.abs(v) - step, 0.0), v)
    limited = np.clip(wanted, v - step, v + step)
    limited = np.where(limited * v < 0.0, 0.0, limited)
    kept = np.where(np.abs(limited) > np.abs(v), v, slower)
    stop, robots = stopping(x, v, acceleration, dt), range(x.shape[1])
    taken = [_between(reserve, i, x[:, i], stop[:, i]) for i in robots]
    for i in robots:
        begin, speed, a = x[:, i].copy(), slower[:, i], acceleration[:, i]
        for wish in (kept[:, i], limited[:, i]):
            end = begin + (v[:, i] + wish) * (dt / 2)
            needed = _between(reserve, i, begin, stopping(end, wish, a, dt))
            others = (taken[j] for j in robots if j != i)
            clear = [admitted(taken[i], needed, other, delta) for other in others]
            speed = np.where(np.all(clear, axis=0), wish, speed)
        x[:, i] = begin + (v[:, i] + speed) * (dt / 2)
        v[:, i] = speed
        taken[i] = _between(reserve, i, x[:, i], stopping(x[:, i], speed, a, dt))
    return x, v


def _between(reserve: Reserve, robot: int, one: Array, other: Array) -> Array:
    return reserve(robot, np.minimum(one, other), np.maximum(one, other))
