"""Reservations: braking is exact, and robots without any plan never collide (Theorem 14)."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from factory.support.arrays import Array
from tests import reservation
from tests.reservation import admitted, braking, drive, gaps
from tests.tee_runs import adversary

LIMIT = st.floats(0.2, 20.0)
DELTA = np.array([[-0.06, 0.06, -0.08, 0.08]])


@settings(max_examples=100, deadline=None)
@given(st.floats(0.0, 3.0), LIMIT, st.floats(1e-3, 20e-3))
def test_a_tick_of_braking_leaves_the_stopping_point_as_it_is(
    v: float, a: float, dt: float
) -> None:
    """(v + v')/2 dt + beta(v') = beta(v), and beta is what ticks of braking add up to."""
    speed, way, limit = np.array([v]), 0.0, np.array([a])
    whole = braking(speed, limit, dt)
    while speed[0] > 0.0:
        slower = np.maximum(speed - limit * dt, 0.0)
        way += float((speed + slower)[0]) * dt / 2
        speed = slower
        assert way + braking(speed, limit, dt)[0] == pytest.approx(whole[0], abs=1e-9)
    assert way == pytest.approx(whole[0], abs=1e-9)


def test_gaps_are_those_of_the_nearest_boxes_along_the_wider_axis() -> None:
    """In the maximum norm, negative inside Δ."""
    one = np.array([[0.0, 0.1, 0.0, 0.0], [5.0, 5.0, 5.0, 5.0]])
    assert gaps(one, np.array([[0.3, 0.3, 0.1, 0.1]]), DELTA) == pytest.approx(0.14)
    assert gaps(one, np.array([[0.1, 0.2, 0.08, 0.1]]), DELTA) == pytest.approx(0.0)
    assert gaps(one, np.array([[0.05, 0.2, 0.05, 0.1]]), DELTA) == pytest.approx(-0.03)


def test_a_robot_at_the_very_distance_may_recede_but_not_approach() -> None:
    """Who comes no nearer is admitted even where rounding has put it into Δ."""
    present, other = np.array([[0.0, 0.0, 0.0, 0.0]]), np.array([[0.06 - 1e-9, 0.06, 0.0, 0.0]])
    assert admitted(present, np.array([[-0.1, 0.0, 0.0, 0.0]]), other, DELTA)
    assert not admitted(present, np.array([[0.0, 0.001, 0.0, 0.0]]), other, DELTA)


def line(robot: int, low: Array, high: Array) -> Array:
    """Robots that all move along one straight line."""
    zero = np.zeros_like(low)
    return np.stack([low, high, zero, zero], axis=1)[:, None]


def test_three_robots_on_a_line_close_up_and_stand() -> None:
    """Each stops short of the next, exactly as far as it has to be."""
    x, v = np.array([[0.0, 0.5, 1.0]]), np.zeros((1, 3))
    wanted, limit = np.array([[0.5, 0.4, -0.3]]), np.full((1, 3), 2.0)
    for _ in range(400):
        x, v = drive((x, v), wanted, limit, 0.01, line, DELTA)
        assert (np.diff(x) >= 0.06 - 1e-12).all()
    assert np.diff(x)[0] == pytest.approx([0.06, 0.06], abs=2e-4)
    assert v == pytest.approx(0.0)


def test_no_wish_makes_robots_collide() -> None:
    """A thousand adversaries for six seconds each."""
    assert not adversary(1000).collided.any()


def test_half_a_braking_distance_is_not_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    """The planted fault: the adversary sees it, which runs under the plan hardly do."""
    whole = reservation.braking
    monkeypatch.setattr(reservation, "braking", lambda v, a, dt: 0.5 * whole(v, a, dt))
    assert adversary(300).collided.mean() > 0.5
