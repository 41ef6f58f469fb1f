"""Navigation functions: gradient, the only critical point, convergence inside the domain."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from factory.support.arrays import Array
from factory.theory.control import mode as mode_module
from factory.theory.control.mode import Limits, Mode
from factory.theory.control.navigation import Bundle
from tests.navigation_functions import gradient as gradient_of
from tests.navigation_functions import potential
from tests.slow import slow_but

R, EPS, DT = 0.06, 1e-3, 1e-3
Field = Callable[[Array, float], Array]


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


def weld(lengths: Array) -> Mode:
    """A tool whose guidepath ends at the station of the carrier; both stop 2r short of it."""
    station = 0.4 * lengths[0]
    goals = np.array([station + 2 * R, 2 * R])
    meet = np.array([[station, 0.0]])
    return Mode(goals, np.zeros(2), lengths, EPS, np.array([[0, 1]]), meet, np.array([R]))


def chain(lengths: Array) -> Mode:
    """Three robots, each waiting for the one before."""
    gate, standoff = np.array([-1, 0, 1]), np.array([0.0, 0.2, 0.3])
    goals = np.array([lengths[0], 0.1, 0.1])
    return Mode(goals, np.zeros(3), lengths, EPS, gate=gate, standoff=standoff)


def atomic(lengths: Array) -> Mode:
    return Mode(lengths, np.zeros(1), lengths, EPS)


CASES: dict[str, tuple[Callable[[Array], Mode], int]] = {
    "atomic": (atomic, 1),
    "mate": (mate, 3),
    "mate at B": (lambda lengths: mate(lengths, ahead=0.0), 3),
    "mate of four": (mate, 5),
    "mate of five": (mate, 6),
    "insert": (insert, 2),
    "weld": (weld, 2),
    "chain": (chain, 3),
}


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


def faults(bundle: Bundle, x: Array, field: Field | None = None, seconds: float = 6.0) -> set[str]:
    """What goes wrong on the way along the field from x: nothing, if phi is a navigation function
    and the field descends it."""
    field = field or bundle.field
    found: set[str] = set()
    before = potential(bundle, x)
    for _ in range(round(seconds / DT)):
        x = x + field(x, DT) * DT
        if not bundle.in_domain(x).all():
            found.add("left the domain")
        after = potential(bundle, x)
        if (after > before + 1e-9).any():
            found.add("phi rose")
        before = after
    if not bundle.at_goal(x).all():
        found.add("never arrived")
    return found


@pytest.mark.parametrize("case", slow_but(["mate", "insert"], CASES))
def test_descends_to_the_goal_inside_the_domain(case: str) -> None:
    rng = np.random.default_rng(1)
    bundle = bundle_of(random_modes(case, 200, rng))
    assert not any(mode.trapped for mode in bundle.modes)
    assert faults(bundle, random_start(bundle, rng)) == set()


@pytest.mark.parametrize("case", CASES)
def test_gradient_is_that_of_phi(case: str) -> None:
    rng = np.random.default_rng(2)
    modes = random_modes(case, 100, rng)
    bundle = bundle_of(modes)
    x = random_start(bundle, rng)
    gates = bundle.gates
    x[gates.gate] = bundle.goal[gates.gate] + EPS * rng.uniform(0.7, 1.1, gates.gate.size)
    x[gates.gate] = np.minimum(x[gates.gate], bundle.upper[gates.gate])
    gradient, step = gradient_of(bundle, x), 1e-8
    creased = np.zeros(x.size, bool)
    meeting = np.abs(x[bundle.pairs.robots] - bundle.pairs.meet) <= step
    np.logical_or.at(creased, bundle.pairs.robots, meeting)
    for i in range(max(mode.size for mode in modes)):
        robot = np.array([s + i for s, m in zip(bundle.starts, modes, strict=True) if i < m.size])
        shift = np.zeros_like(x)
        shift[robot] = step
        numeric = (potential(bundle, x + shift) - potential(bundle, x - shift)) / (2 * step)
        smooth = ~creased[robot]
        found = gradient[robot][smooth]
        expected = numeric[bundle.owner[robot]][smooth]
        assert np.allclose(found, expected, rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("case", CASES)
def test_field_is_minus_a_positive_diagonal_times_the_gradient(case: str) -> None:
    rng = np.random.default_rng(3)
    bundle = bundle_of(random_modes(case, 300, rng))
    x = random_start(bundle, rng)
    field, gradient = bundle.field(x, DT), gradient_of(bundle, x)
    stopped = (x <= bundle.lower) & (gradient > 0) | (x >= bundle.upper) & (gradient < 0)
    assert (field[stopped] == 0).all()
    moving = ~stopped & (np.abs(gradient) > 1e-9)
    assert (np.sign(field[moving]) == -np.sign(gradient[moving])).all()
    assert (np.abs(field) <= bundle.speed).all()
    progress = np.add.reduceat(field * gradient, bundle.starts)
    assert (progress[~bundle.at_goal(x)] < 0).all()


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


def test_phi_is_0_at_the_goal_and_1_on_the_obstacles() -> None:
    mode = mate(np.array([1.0, 1.2, 0.8]))
    bundle = bundle_of([mode])
    assert potential(bundle, mode.goals) == [0.0]
    assert potential(bundle, np.array([R / 2, R / 2, 0.1])) == [1.0]
    assert bundle.in_domain(np.array([R / 2, R / 2, 0.1])) == [False]
    assert 0 < potential(bundle, np.array([1.0, 1.2, 0.0]))[0] < 1


def test_far_from_obstacles_robots_make_for_their_targets_at_full_speed() -> None:
    bundle = bundle_of([insert(np.array([1.0, 1.0])), mate(np.array([1.0, 1.2, 0.8]))], v=0.7)
    x = np.array([0.9, 0.9, 1.0, 1.1, 0.1])
    assert np.array_equal(bundle.field(x, DT), [-0.7, -0.7, -0.7, -0.7, 0.7])
    waiting = np.array([0.9, 2 * R + 0.3, 1.0, 1.1, 0.1])
    assert bundle.field(waiting, DT)[1] == 0.0
    open_gate = np.array([0.5, 2 * R + 0.3, 1.0, 1.1, 0.1])
    assert bundle.field(open_gate, DT)[1] == -0.7


def test_a_gate_opens_only_at_the_goal_ball() -> None:
    bundle = bundle_of([insert(np.array([1.0, 1.0]))])
    for x0, x1, inside in ((0.9, 0.5, True), (0.9, 0.2, False), (0.5, 0.2, True)):
        assert bundle.in_domain(np.array([x0, x1])) == [inside]
    assert bundle.in_domain(np.array([0.5 + EPS, 2 * R + 0.3 - 2 * EPS])) == [False]


def test_waiting_modes_stand_still_anywhere() -> None:
    bundle = bundle_of([Mode.still(2), atomic(np.ones(1))])
    x = np.array([-5.0, 7.0, 0.2])
    assert np.array_equal(bundle.field(x, DT), [0.0, 0.0, 1.0])
    assert np.array_equal(gradient_of(bundle, x)[:2], [0.0, 0.0])
    assert potential(bundle, x)[0] == 0.0
    assert bundle.at_goal(x).tolist() == [True, False]
    assert bundle.in_domain(x).tolist() == [True, True]


@settings(max_examples=200, deadline=None)
@given(st.integers(2, 6), st.floats(0.0, 3.0), st.integers(0, 2**32 - 1))
def test_only_the_goal_is_critical(k: int, ahead: float, seed: int) -> None:
    """For any mate, wherever the inputs meet the carrier: no zero of the field but the goal."""
    rng = np.random.default_rng(seed)
    lengths = rng.uniform(0.4, 1.0, k)
    bundle = bundle_of([mate(lengths, ahead * R)] * 20)
    x = random_start(bundle, rng)
    moves = np.logical_or.reduceat(bundle.field(x, DT) != 0, bundle.starts)
    assert (moves | bundle.at_goal(x)).all()


def test_planted_wrong_sign_is_caught() -> None:
    rng = np.random.default_rng(5)
    bundle = bundle_of(random_modes("mate", 20, rng))
    x = random_start(bundle, rng)
    found = faults(bundle, x, lambda x, dt: -bundle.field(x, dt), seconds=1.0)
    assert found == {"left the domain", "phi rose", "never arrived"}


def test_planted_blindness_to_obstacles_is_caught() -> None:
    rng = np.random.default_rng(6)
    bundle = bundle_of(random_modes("mate", 50, rng))
    blind = bundle_of([Mode(m.goals, m.lower, m.upper, m.eps) for m in bundle.modes])
    found = faults(bundle, random_start(bundle, rng), blind.field)
    assert "left the domain" in found


def test_planted_early_entry_is_caught() -> None:
    rng = np.random.default_rng(7)
    bundle = bundle_of(random_modes("insert", 50, rng))
    hasty = bundle_of([Mode(m.goals, m.lower, m.upper, m.eps) for m in bundle.modes])
    assert "left the domain" in faults(bundle, random_start(bundle, rng), hasty.field)


def test_planted_obstacle_on_the_goal_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    lengths = np.array([1.0, 1.2, 0.8])
    sound = mate(lengths)
    blocked = (sound.goals, sound.lower, sound.upper, EPS, sound.pairs, sound.meet, 5 * sound.touch)
    with pytest.raises(ValueError, match="robots 1 and 2 at their goals touch"):
        Mode(*blocked)
    monkeypatch.setattr(mode_module, "_check_pairs", lambda mode: None)
    monkeypatch.setattr(mode_module, "_reach", lambda mode: 1.5 * mode.touch)
    bundle = bundle_of([Mode(*blocked)])
    assert "never arrived" in faults(bundle, np.array([1.0, 1.1, 0.1]), seconds=3.0)


def test_who_waits_pulls_at_whom_it_waits_for() -> None:
    """The slope of phi of three robots, each waiting for the one before, near their goals."""
    made = chain(np.array([1.0, 0.5, 0.5]))
    bundle = bundle_of([made])
    x = made.goals + EPS * np.array([-0.9, 0.95, 40.0])
    step = 1e-8 * np.eye(3)
    slope = [(potential(bundle, x + s) - potential(bundle, x - s))[0] / 2e-8 for s in step]
    assert gradient_of(bundle, x) == pytest.approx(np.array(slope), rel=1e-4, abs=1e-5)
    assert np.abs(gradient_of(bundle, x)[:2]).min() > 100.0
