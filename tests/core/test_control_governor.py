"""The governor: exact landing under the limits, for any speed, acceleration and tick."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from factory.support.arrays import Array
from factory.theory.control.governor import follow, govern
from factory.theory.control.mode import Limits, Mode
from factory.theory.control.navigation import Bundle
from factory.theory.control.profile import SpeedProfile, landing_speed
from tests.navigation_functions import potential

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


@settings(max_examples=100, deadline=None)
@given(st.floats(1e-3, 5.0), st.floats(0.2, 20.0), TICKS)
def test_landing_speed_brakes_by_one_step_a_tick_and_lands(
    distance: float, acceleration: float, dt: float
) -> None:
    left, step = np.array([distance]), acceleration * dt
    before = landing_speed(left, np.array([acceleration]), dt)
    assert before <= np.sqrt(2 * acceleration * left)
    while left > 1e-12:
        left = np.maximum(left - before * dt, 0.0)
        after = landing_speed(left, np.array([acceleration]), dt)
        assert before - after <= step * (1 + 1e-9) + 1e-9
        before = after
    assert before <= 1e-6


def test_govern_takes_the_nearest_speed_the_acceleration_allows() -> None:
    x, v = np.zeros(3), np.array([0.0, 1.0, 0.5])
    wanted, limit = np.array([1.0, -1.0, 0.51]), np.full(3, 10.0)
    x1, v1, acceleration = govern(x, v, wanted, limit, 0.01)
    assert np.allclose(v1, [0.1, 0.9, 0.51])
    assert np.allclose(acceleration, [10.0, -10.0, 1.0])
    assert np.allclose(x1, [0.0005, 0.0095, 0.00505])


def test_limits_hold_along_governed_runs_of_many_modes() -> None:
    """Insertions with jittered limits: limits, domain, gate and goal, tick by tick."""
    rng, count, dt = np.random.default_rng(0), 100, 2e-3
    r = 0.06
    mode = Mode(
        goals=np.array([0.5, 2 * r]),
        lower=np.zeros(2),
        upper=np.array([1.5, 1.5]),
        eps=EPS,
        pairs=np.array([[0, 1]]),
        meet=np.array([[0.5 - 2 * r, 0.0]]),
        touch=np.array([r]),
        gate=np.array([-1, 0]),
        standoff=np.array([0.0, 0.3]),
    )
    limits = [Limits(rng.uniform(0.3, 1.0, 2), rng.uniform(1, 5, 2)) for _ in range(count)]
    bundle = Bundle.of([mode] * count, limits)
    x = np.ravel([rng.uniform(0.3, 1.5, count), rng.uniform(2 * r + 0.3, 1.5, count)], order="F")
    xs, vs, accelerations = run(bundle, x, dt, 9.0)
    assert (np.abs(vs) <= bundle.speed + 1e-12).all()
    assert (np.abs(accelerations) <= bundle.acceleration * (1 + 1e-9)).all()
    assert all(bundle.in_domain(x).all() for x in xs)
    assert bundle.at_goal(xs[-1]).all() and np.abs(vs[-1]).max() < 1e-9
    steps = np.diff([potential(bundle, x) for x in xs], axis=0)
    assert (steps <= 1e-12).all()


def test_planted_field_that_brakes_too_late_is_caught() -> None:
    """The governor brakes half as hard as the field assumes: the reference passes its target."""
    one = np.ones(2)
    bundle, dt = couriers(one, one, 2 * one), 2e-3
    x, v = 1.0 - bundle.goal, np.zeros(2)
    passed = False
    for _ in range(1000):
        x, v, _ = govern(x, v, bundle.field(x + v * (dt / 2), dt), bundle.acceleration / 2, dt)
        passed |= bool(x[0] > 1.0 + EPS)
    assert passed
