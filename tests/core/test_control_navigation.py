"""Navigation functions: gradient, the only critical point, convergence inside the domain."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations

import numpy as np
import pytest

from factory.support.arrays import Array
from factory.theory.control.mode import Limits, Mode
from factory.theory.control.navigation import Bundle
from tests.navigation_functions import gradient as gradient_of
from tests.navigation_functions import potential

R, EPS, DT = 0.06, 1e-3, 1e-3


def mate(lengths: Array, ahead: float = 2 * R, eps: float = EPS) -> Mode:
    """k - 1 inputs to A + 2r, the carrier to B; A of every input = B - `ahead` of the carrier."""
    k = lengths.size
    meet = np.zeros(k)
    meet[-1] = lengths[-1] - ahead
    pairs = np.array(list(combinations(range(k), 2)))
    goals = np.full(k, 2 * R)
    goals[-1] = lengths[-1]
    touch = np.full(len(pairs), R)
    return Mode(goals, np.zeros(k), lengths, eps, pairs, meet[pairs], touch)


def insert(lengths: Array, standoff: float = 0.3, eps: float = EPS) -> Mode:
    """The input waits at its standoff until the carrier stands at its station."""
    station = 0.5 * lengths[0]
    return Mode(
        goals=np.array([station, 2 * R]),
        lower=np.zeros(2),
        upper=lengths,
        eps=eps,
        pairs=np.array([[0, 1]]),
        meet=np.array([[station - 2 * R, 0.0]]),
        touch=np.array([R]),
        gate=np.array([-1, 0]),
        standoff=np.array([0.0, standoff]),
    )


def chain(lengths: Array) -> Mode:
    """Three robots, each waiting for the one before."""
    gate, standoff = np.array([-1, 0, 1]), np.array([0.0, 0.2, 0.3])
    goals = np.array([lengths[0], 0.1, 0.1])
    return Mode(goals, np.zeros(3), lengths, EPS, gate=gate, standoff=standoff)


def atomic(lengths: Array) -> Mode:
    return Mode(lengths, np.zeros(1), lengths, EPS)


CASES: dict[str, tuple[Callable[[Array], Mode], int]] = {"chain": (chain, 3)}


def bundle_of(modes: list[Mode], v: float = 1.0, a: float = 4.0) -> Bundle:
    return Bundle.of(modes, [Limits(np.full(m.size, v), np.full(m.size, a)) for m in modes])


def random_modes(case: str, count: int, rng: np.random.Generator) -> list[Mode]:
    make, k = CASES[case]
    return [make(rng.uniform(0.6, 1.5, k)) for _ in range(count)]


def random_start(bundle: Bundle, rng: np.random.Generator) -> Array:
    """A point of W - Δ for each mode; about half of the robots start near a meeting point."""
    x = np.full(bundle.goal.size, np.nan)
    missing = np.ones(len(bundle.modes), bool)
    while missing.any():
        draw = rng.uniform(np.maximum(bundle.lower, -9.0), np.minimum(bundle.upper, 9.0))
        near = rng.choice(bundle.pairs.robots.size, bundle.pairs.robots.size // 2)
        robot, meet = bundle.pairs.robots.ravel()[near], bundle.pairs.meet.ravel()[near]
        draw[robot] = meet + rng.uniform(-1.3 * R, 1.3 * R, near.size)
        draw = np.clip(draw, bundle.lower, bundle.upper)
        fresh = missing[bundle.owner]
        x[fresh] = draw[fresh]
        missing &= ~bundle.in_domain(x)
    return x


@pytest.mark.parametrize("case", CASES)
def test_batch_equals_one_by_one(case: str) -> None:
    rng = np.random.default_rng(4)
    others = [*random_modes("mate", 3, rng), Mode.still(2), *random_modes("insert", 2, rng)]
    bundle = bundle_of(random_modes(case, 5, rng) + others)
    x = random_start(bundle, rng)
    for number, mode in enumerate(bundle.modes):
        here = slice(bundle.starts[number], bundle.starts[number] + mode.size)
        alone = bundle_of([mode])
        assert np.allclose(alone.field(x[here], DT), bundle.field(x, DT)[here], atol=1e-12)
        assert np.allclose(gradient_of(alone, x[here]), gradient_of(bundle, x)[here], rtol=1e-12)
        for question in (potential, Bundle.at_goal, Bundle.in_domain):
            whole, part = question(bundle, x), question(alone, x[here])
            assert np.allclose(whole[number], part[0], rtol=1e-12)


def test_waiting_modes_stand_still_anywhere() -> None:
    bundle = bundle_of([Mode.still(2), atomic(np.ones(1))])
    x = np.array([-5.0, 7.0, 0.2])
    assert np.array_equal(bundle.field(x, DT), [0.0, 0.0, 1.0])
    assert np.array_equal(gradient_of(bundle, x)[:2], [0.0, 0.0])
    assert potential(bundle, x)[0] == 0.0
    assert bundle.at_goal(x).tolist() == [True, False]
    assert bundle.in_domain(x).tolist() == [True, True]


def test_who_waits_pulls_at_whom_it_waits_for() -> None:
    """The slope of phi of three robots, each waiting for the one before, near their goals."""
    made = chain(np.array([1.0, 0.5, 0.5]))
    bundle = bundle_of([made])
    x = made.goals + EPS * np.array([-0.9, 0.95, 40.0])
    step = 1e-8 * np.eye(3)
    slope = [(potential(bundle, x + s) - potential(bundle, x - s))[0] / 2e-8 for s in step]
    assert gradient_of(bundle, x) == pytest.approx(np.array(slope), rel=1e-4, abs=1e-5)
    assert np.abs(gradient_of(bundle, x)[:2]).min() > 100.0
