"""The ring plan: both robots of a tee reach all goals, without a collision (Theorem 15)."""

from __future__ import annotations

import numpy as np
import pytest

from tests.ring import ARRIVED, NO_WAY, Tee
from tests.tee_runs import TEE, run

SQUARES = [3 * one + other for one in range(3) for other in range(3) if one != other]


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


@pytest.mark.slow
@pytest.mark.parametrize("tee", [TEE, Tee(TEE.lengths, 0.08)])
@pytest.mark.parametrize("disturbed", [False, True])
def test_ten_thousand_runs(tee: Tee, disturbed: bool) -> None:
    """The campaign."""
    runs = run(10_000, tee, seed=2, disturbed=disturbed)
    assert not runs.collided.any()
    assert not runs.missed.any()
    assert runs.least >= tee.apart - 1e-9
