"""The governor: exact landing under the limits, for any speed, acceleration and tick."""

from __future__ import annotations

import numpy as np

from factory.support.arrays import Array
from factory.theory.control.governor import follow, govern
from factory.theory.control.mode import Limits, Mode
from factory.theory.control.navigation import Bundle
from tests.navigation_functions import potential

EPS = 2e-4


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
