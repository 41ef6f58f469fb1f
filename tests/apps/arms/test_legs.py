"""Legs are clear or say what blocked them; the configurations of a circuit are the best."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise, product

import numpy as np
import pytest

from factory.api import Array, Index
from factory.apps.arms.chain import SerialChain
from factory.apps.arms.circuit import EVERY_JOINT, candidates, circuit, free_candidates
from factory.apps.arms.inverse import solutions
from factory.apps.arms.legs import NoWay, transfer
from tests.arm_models import ball, down, nothing, retreat, shipped, straight_line

LEFT, RIGHT = np.array([0.2, 0.38, 0.15]), np.array([0.2, -0.38, 0.15])
UP = ([np.linspace(0.0, 0.085, 25)[:, None] * [0.0, 0.0, 1.0]],) * 2


def visit(chain: SerialChain, place: Array) -> Array:
    """A straight line (25, n) of configurations up from a place, elbow up."""
    (q,) = solutions(chain, place[None], down(0.0)[None])
    high = chain.frames(q)[0][:, 3, 2]
    start = q[[int(high.argmax())]]
    return np.asarray(straight_line(chain, start, retreat(chain, start), 0.085)[0][0])


def limits(chain: SerialChain) -> tuple[Array, Array]:
    return chain.limits.low, chain.limits.high


def test_where_there_is_no_way_the_pair_that_blocked_is_named() -> None:
    """A wall of a joint's positions, whatever the others are; pair 3 is nearest in it."""
    chain = shipped("six")
    a, b = visit(chain, LEFT)[-1], visit(chain, RIGHT)[-1]
    wall = (a[0] + b[0]) / 2

    def clearance(q: Array) -> tuple[Array, Index]:
        margin = np.abs(q[:, 0] - wall) - 0.05
        return margin, np.where(np.abs(q[:, 0] - wall) < 0.04, 3, 1)

    blocked = transfer(a, b, clearance, limits(chain), rounds=60)
    assert isinstance(blocked, NoWay)
    assert blocked.pair == 3 and 0.02 < blocked.depth <= 0.056 + 1e-9 and blocked.count > 5
    narrow = replace(chain, limits=replace(chain.limits, low=np.minimum(a, b)))
    assert isinstance(transfer(a, b, clearance, limits(narrow), rounds=20), NoWay)


def poses(place: Array, count: int) -> tuple[Array, Array]:
    """One place in several turns about the vertical."""
    turns = np.stack([down(yaw) for yaw in 2 * np.pi * np.arange(count) / count])
    return np.tile(place, (count, 1)), turns


def test_free_candidates_pair_any_branches() -> None:
    """They have those on one branch, and others; each is at both poses, and clear."""
    chain = shipped("six")
    near = np.array([0.0, 0.3, 1.9, -0.6, -1.57, 0.0])
    takes, puts = poses(LEFT, 2), poses(RIGHT, 2)
    same = candidates(chain, takes, puts, nothing, near, UP)
    free = free_candidates(chain, takes, puts, nothing, near, UP)
    assert free.blocked is None and len(free.pairs) > len(same.pairs)
    for k, (place, turn) in enumerate((takes, puts)):
        at, now = chain.tool(free.pairs[:, k])
        assert np.abs(at - place[free.grips]).max() < 1e-8
        assert np.abs(now - turn[free.grips]).max() < 1e-8
    none = free_candidates(chain, takes, puts, ball(chain, RIGHT, 0.3), near, UP)
    assert len(none.pairs) == 0 and none.reached == 2 and none.blocked is not None


@pytest.mark.parametrize("seed", [3])
def test_the_circuit_is_the_best_of_all(seed: int) -> None:
    rng = np.random.default_rng(seed)
    options = [
        rng.normal(size=(int(rng.integers(1, 5)), 2, 3)) for _ in range(int(rng.integers(1, 5)))
    ]
    speed = rng.uniform(0.5, 2.0, 3)

    def cost(choice: tuple[int, ...]) -> float:
        rows = [options[k][j] for k, j in enumerate(choice)]
        stops = [q for pair in rows for q in pair]
        times = [np.abs(b - a) / speed for a, b in pairwise([*stops, stops[0]])]
        return float(sum(t.max() + EVERY_JOINT * t.sum() for t in times))

    best = min(product(*(range(len(pairs)) for pairs in options)), key=cost)
    assert cost(tuple(circuit(options, speed))) == pytest.approx(cost(best), rel=1e-12)
