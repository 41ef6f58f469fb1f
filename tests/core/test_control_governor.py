"""The governor: exact landing under the limits, for any speed, acceleration and tick."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from factory.support.arrays import Array
from factory.theory.control.governor import follow
from factory.theory.control.mode import Limits, Mode
from factory.theory.control.navigation import Bundle
from factory.theory.control.profile import SpeedProfile

EPS = 2e-4
TICKS = st.floats(1e-3, 20e-3)


def couriers(distance: Array, speed: Array, acceleration: Array) -> Bundle:
    """Robots that each go its `distance`, every other one down its guidepath, the rest up."""
    goals = np.where(np.arange(distance.size) % 2, 0.0, distance)
    mode = Mode(goals, np.zeros(distance.size), distance, EPS)
    return Bundle.of([mode], [Limits(speed, acceleration)])


def run(bundle: Bundle, x: Array, dt: float, seconds: float) -> tuple[Array, Array, Array]:
    """The governed x, v and acceleration (ticks, n) from rest at x."""
    v, path = np.zeros_like(x), []
    for _ in range(int(seconds / dt) + 3):
        x, v, acceleration = follow(bundle, x, v, dt)
        path.append((x, v, acceleration))
    xs, vs, accelerations = (np.array(column) for column in zip(*path, strict=True))
    return xs, vs, accelerations


@settings(max_examples=20, deadline=None)
@given(TICKS, st.integers(0, 2**32 - 1))
def test_lands_at_rest_without_overshoot_in_the_trapezoid_time(dt: float, seed: int) -> None:
    """Forty robots, 1 mm to 5 m each, with limits of their own."""
    rng, noise, count = np.random.default_rng(seed), 1e-9, 40
    speed, acceleration = rng.uniform(0.05, 3.0, count), rng.uniform(0.2, 20.0, count)
    distance = np.minimum(10 ** rng.uniform(-3.0, np.log10(5.0), count), 15.0 * speed)
    bundle = couriers(distance, speed, acceleration)
    each = zip(distance.tolist(), speed.tolist(), acceleration.tolist(), strict=True)
    ideal = np.array([SpeedProfile(v, a).rest(way) for way, v, a in each])
    xs, vs, accelerations = run(bundle, distance - bundle.goal, dt, ideal.max())
    left = np.abs(bundle.goal - xs)
    assert (np.diff(left, axis=0) <= noise).all()
    assert ((xs >= -noise) & (xs <= distance + noise)).all()
    assert (np.abs(vs) <= speed + noise).all()
    assert (np.abs(accelerations) <= acceleration * (1 + noise)).all()
    rested = (left <= EPS / 10) & (np.abs(vs) <= noise)
    assert rested[-1].all()
    took = (np.argmax(rested, axis=0) + 1) * dt
    assert (took <= ideal + 2 * dt).all()
    assert (took >= ideal - dt).all()
