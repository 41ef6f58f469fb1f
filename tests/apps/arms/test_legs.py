"""Legs are clear or say what blocked them; the configurations of a circuit are the best."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise, product
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from factory.api import Array, Index
from factory.apps.arms import planning
from factory.apps.arms.chain import SerialChain
from factory.apps.arms.circuit import EVERY_JOINT, candidates, circuit, free_candidates, partners
from factory.apps.arms.inverse import (
    SINGULAR,
    least_singular_value,
    solutions,
)
from factory.apps.arms.joint_way import JointWay
from factory.apps.arms.legs import CHECKS, NoWay, leg, line, obstruction, transfer
from factory.apps.arms.planning import ArmPlanner
from tests.arm_models import PACE, ball, down, nothing, retreat, shipped, straight_line

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


def test_a_leg_with_nothing_in_its_way_is_straight_in_joint_space() -> None:
    chain = shipped("six")
    out, into = visit(chain, LEFT), visit(chain, RIGHT)[::-1]
    path = transfer(out[-1], into[0], nothing, limits(chain))
    assert not isinstance(path, NoWay)
    assert (path == line(out[-1], into[0])).all()
    assert np.abs(np.diff(path, axis=0)).max() <= 0.04 + 1e-9
    way = leg(chain, out, into, nothing, nothing, PACE)
    assert isinstance(way, JointWay)
    assert np.abs(way.at(np.array([0.0, way.length]))[0] - [out[0], into[-1]]).max() < 1e-12


@pytest.mark.parametrize("seed", range(2))
def test_a_leg_goes_round_a_ball(seed: int) -> None:
    """One in the middle of the straight line of the tool; the way is clear everywhere."""
    chain = shipped("six")
    out, into = visit(chain, LEFT), visit(chain, RIGHT)[::-1]
    middle = chain.tool(line(out[-1], into[0]))[0]
    clearance = ball(chain, middle[len(middle) // 2], 0.08)
    assert clearance(line(out[-1], into[0]))[0].min() < 0.0
    way = leg(chain, out, into, clearance, nothing, PACE, seed)
    assert isinstance(way, JointWay)
    fine = np.linspace(way.off, way.hover, 1500)
    assert clearance(way.at(fine)[0])[0].min() > -1e-3
    assert obstruction(way, clearance, nothing) is None
    again = leg(chain, out, into, clearance, nothing, PACE, seed)
    assert isinstance(again, JointWay) and again.places.tobytes() == way.places.tobytes()
    alone = leg(chain, out, into, nothing, nothing, PACE)
    assert isinstance(alone, JointWay) and way.length > alone.length
    blocked = obstruction(alone, clearance, nothing)
    assert blocked is not None and 0.01 < blocked.depth < 0.2


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


def test_a_visit_that_is_not_clear_ends_the_search_at_once() -> None:
    chain, asked = shipped("six"), []

    def clearance(q: Array) -> tuple[Array, Index]:
        asked.append(len(q))
        return np.where(np.arange(len(q)) == 0, -0.004, 1.0), np.full(len(q), 7)

    a, b = visit(chain, LEFT)[-1], visit(chain, RIGHT)[-1]
    blocked = transfer(a, b, clearance, limits(chain))
    assert isinstance(blocked, NoWay) and blocked.pair == 7
    assert blocked.depth == pytest.approx(0.01) and len(asked) == 2


def test_straight_ends_have_a_clearance_of_their_own() -> None:
    """What is near a part's place is no obstacle to a transfer, and the other way round."""
    chain = shipped("six")
    out, into = visit(chain, LEFT), visit(chain, RIGHT)[::-1]
    near = ball(chain, RIGHT, 0.03)
    assert isinstance(leg(chain, out, into, near, nothing, PACE), JointWay)
    blocked = leg(chain, out, into, nothing, near, PACE)
    assert isinstance(blocked, NoWay) and blocked.depth == pytest.approx(0.03, abs=2e-3)
    assert 0 < blocked.count < CHECKS / 3


def test_partners_are_on_the_branch_of_their_configurations() -> None:
    chain = shipped("six")
    (q,) = solutions(chain, LEFT[None], down(0.0)[None])
    other, good = partners(chain, q, RIGHT, down(0.0))
    assert good.sum() >= 4
    at, _ = chain.tool(other[good])
    assert np.abs(at - RIGHT).max() < 1e-8
    for joint in (2, 4):
        assert (np.sign(np.sin(other[good][:, joint])) == np.sign(np.sin(q[good][:, joint]))).all()
    for share in np.linspace(0.0, 1.0, 21):
        assert least_singular_value(chain, q + share * (other - q))[good].min() > 0.01
    assert least_singular_value(chain, other[good]).min() >= SINGULAR
    assert not partners(chain, q, np.array([2.0, 0.0, 0.0]), down(0.0))[1].any()


def poses(place: Array, count: int) -> tuple[Array, Array]:
    """One place in several turns about the vertical."""
    turns = np.stack([down(yaw) for yaw in 2 * np.pi * np.arange(count) / count])
    return np.tile(place, (count, 1)), turns


def test_candidates_are_clear_and_what_is_not_is_named() -> None:
    chain = shipped("six")
    near = np.array([0.0, 0.3, 1.9, -0.6, -1.57, 0.0])
    takes, puts = poses(LEFT, 4), poses(RIGHT, 4)
    every = candidates(chain, takes, puts, nothing, near, UP)
    assert every.blocked is None and len(every.pairs) == every.reached >= 16
    for k, (place, turn) in enumerate((takes, puts)):
        at, now = chain.tool(every.pairs[:, k])
        assert np.abs(at - place[every.grips]).max() < 1e-8
        assert np.abs(now - turn[every.grips]).max() < 1e-8
    for k in (0, 1):
        clearance = ball(chain, chain.frames(every.pairs[0, k])[0][3], 0.05)
        some = candidates(chain, takes, puts, clearance, near, UP)
        assert 0 < len(some.pairs) < some.reached == every.reached and some.blocked is not None
        visits = some.pairs.reshape(-1, 6)
        above = straight_line(chain, visits, retreat(chain, visits), 0.085)[0][:, -1]
        assert min(clearance(visits)[0].min(), clearance(above)[0].min()) >= 0.0
    none = candidates(chain, takes, puts, ball(chain, LEFT, 0.3), near, UP)
    assert len(none.pairs) == 0 and none.blocked is not None and none.blocked.depth > 0.0
    far = candidates(chain, poses(np.array([2.0, 0, 0]), 2), poses(RIGHT, 2), nothing, near, UP)
    assert far.reached == 0 and far.blocked is None and far.pairs.shape == (0, 2, 6)


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


@pytest.mark.parametrize("seed", range(5))
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


@pytest.mark.parametrize(
    ("label", "held"), [("lid", [True, True, False]), ("", [False, True, False])]
)
def test_a_part_counts_until_it_is_over_its_place(
    label: str, held: list[bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is judged with the arm while the arm takes it up and on the way, at its place no more."""
    asked = list[Any]()
    way = JointWay(np.linspace(0.0, 1.0, 5), np.zeros((5, 2)), 0.1, 0.8)
    planner: Any = ArmPlanner.__new__(ArmPlanner)
    planner.chain = SimpleNamespace(bodies=[])
    planner.scene = SimpleNamespace(margins=lambda q, label, need, spared, held: held)
    burden = SimpleNamespace(onto=0, source=1, join=None, takes=None, comes=(0, 0, 1))
    planner.cell = SimpleNamespace(burdens=dict.fromkeys(("lid", "tub"), burden))
    planner.pace, planner._moving = None, frozenset()
    for name in ("_have", "_carried", "_spared_at", "_spared_under"):
        monkeypatch.setattr(ArmPlanner, name, lambda *_: set())
    monkeypatch.setattr(planning, "leg", lambda *_, **__: way)

    def certify(
        chain: object, way: JointWay, stretch: object, bodies: object, margins: Any
    ) -> None:
        asked.append((stretch, margins(q=way.places)))

    monkeypatch.setattr(planning, "uncertified", certify)
    end = SimpleNamespace(rows=np.zeros((2, 2)), share=0.1)
    assert planner._leg(end, end, label, "tub", "lid") is way
    assert [stretch for stretch, _ in asked] == [(0.0, 0.1), (0.1, 0.8), (0.8, 1.0)]
    assert [counts for _, counts in asked] == held
