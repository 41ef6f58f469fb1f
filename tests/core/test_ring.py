"""The ring plan: both robots of a tee reach all goals, without a collision (Theorem 15)."""

from __future__ import annotations

import numpy as np
import pytest

from tests import reservation
from tests.ring import ARRIVED, NO_WAY, Spots, Tee, TeeState
from tests.tee_runs import DT, TEE, run

SQUARES = [3 * one + other for one in range(3) for other in range(3) if one != other]
SHORT = Tee(np.array([0.6, 0.084, 0.35]), 0.08)
"""An arm 1 mm too short to stand by on."""


def test_squares_are_a_ring_and_fins_are_dead_ends() -> None:
    """From a square two crossings lead to further squares in which one robot has moved on, and the
    farthest of the six is three crossings away; a fin is one crossing from two squares."""
    first, count = TEE.plan
    steps = count.sum(axis=2)
    assert (first != NO_WAY).all()
    assert (np.diag(first) == ARRIVED).all()
    for cell in range(12):
        near = [other for other in SQUARES if steps[cell, other] == 1]
        assert len(near) == 2
    assert steps[np.ix_(SQUARES, SQUARES)].max() == 3


def test_every_pair_reaches_its_goals_and_none_collides() -> None:
    """Boxes and corners; straight lines as well."""
    for tee in (TEE, Tee(TEE.lengths, 0.08)):
        runs = run(300, tee)
        assert not runs.collided.any()
        assert not runs.missed.any()
        assert runs.least >= tee.apart - 1e-9
        assert runs.jump < 0.65 * DT + 1e-6


def test_disturbed_pairs_reach_their_goals() -> None:
    """30 % of ticks are forced braking, and goals change in motion."""
    runs = run(300, seed=1, disturbed=True)
    assert not runs.collided.any()
    assert not runs.missed.any()
    assert runs.jump < 0.65 * DT + 1e-6


def test_a_short_arm_cuts_the_ring() -> None:
    """What it still leads to is reached; half the goals are known to be out of reach before any
    robot moves."""
    assert (SHORT.plan[0] == NO_WAY).any()
    runs = run(300, SHORT)
    assert 90 < len(runs.missed) < 210
    assert not runs.missed.any()
    assert not runs.collided.any()


def test_without_reservations_robots_collide(monkeypatch: pytest.MonkeyPatch) -> None:
    """A planted fault: the plan alone."""
    monkeypatch.setattr(
        reservation, "admitted", lambda present, *_: np.ones(len(present), dtype=bool)
    )
    assert run(300).collided.mean() > 0.2


def test_without_the_plan_robots_block_each_other() -> None:
    """A planted fault: straight to the goals, under reservations alone."""
    runs = run(300, step=TEE.towards)
    assert not runs.collided.any()
    assert runs.missed.mean() > 0.3


def test_a_turn_in_motion_ends_at_rest_first() -> None:
    """A robot that is about to pass V to one arm, and is wanted on the other, stops before its
    line changes."""
    state = TeeState.at(Spots(np.array([[0, 2]]), np.array([[0.3, 0.3]])))
    limits = np.full((1, 2), 0.5), np.full((1, 2), 2.0)
    goals = Spots(np.array([[1, 2]]), np.array([[0.3, 0.3]]))
    tee = Tee(TEE.lengths, TEE.apart)
    while abs(state.x[0, 0]) > 0.05:
        state = tee.tick(state, goals, limits, DT)
    front, goals = state.front[0, 0], Spots(np.array([[2, 2]]), np.array([[0.3, 0.3]]))
    while state.v[0, 0] > 0.0:
        state = tee.towards(state, goals, limits, DT)
        assert state.front[0, 0] == front
    assert state.x[0, 0] == pytest.approx(0.0125, abs=0.01)
    assert tee.towards(state, goals, limits, DT).v[0, 0] < 0.0


@pytest.mark.slow
@pytest.mark.parametrize("tee", [TEE, Tee(TEE.lengths, 0.08)])
@pytest.mark.parametrize("disturbed", [False, True])
def test_ten_thousand_runs(tee: Tee, disturbed: bool) -> None:
    """The campaign."""
    runs = run(10_000, tee, seed=2, disturbed=disturbed)
    assert not runs.collided.any()
    assert not runs.missed.any()
    assert runs.least >= tee.apart - 1e-9
