"""Solutions of the inverse kinematics, and what is said of poses out of reach."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from factory.apps.arms.chain import SerialChain
from factory.apps.arms.inverse import (
    SINGULAR,
    TURN,
    descend,
    least_singular_value,
    nearest_in_range,
    seeds,
    solutions,
)
from factory.apps.arms.reach import Unreachable, diagnose_reach
from tests.arm_models import both, configurations, down, retreat, shipped, straight_line

ARMS = ("six", "scara")


def apart(chain: SerialChain, q: np.ndarray, r: np.ndarray) -> np.ndarray:
    """Greatest joint difference, whole turns of hinges aside."""
    off = q - r
    off -= np.where(chain.slides, 0.0, TURN * np.round(off / TURN))
    return np.asarray(np.abs(off).max(axis=-1))


@pytest.mark.parametrize("name", ARMS)
def test_each_solution_is_at_the_pose_and_one_is_where_it_came_from(name: str) -> None:
    chain = shipped(name)
    q = configurations(chain, 12, 3)
    regular = least_singular_value(chain, q) > SINGULAR
    places, turns = chain.tool(q)
    every = solutions(chain, places, turns)
    assert regular.sum() >= 6
    for number in np.flatnonzero(regular):
        there = every[number]
        at, now = chain.tool(there)
        assert np.abs(at - places[number]).max() < 1e-8
        assert np.abs(now - turns[number]).max() < 1e-8
        assert ((chain.limits.low <= there) & (there <= chain.limits.high)).all()
        assert apart(chain, there, q[number]).min() < 1e-6


def test_six_axes_have_eight_solutions_in_order_and_four_have_two() -> None:
    six, scara = shipped("six"), shipped("scara")
    places = np.array([[0.3, 0.35, 0.25], [-0.2, 0.45, 0.3], [0.4, -0.1, 0.2]])
    every = solutions(six, places, np.stack([down(yaw) for yaw in (0.2, 1.0, -2.0)]))
    for there in every:
        assert len(there) == 8
        rounded = np.round(there, 6).tolist()
        assert rounded == sorted(rounded)
        close = np.array([apart(six, there, one) for one in there]) + np.eye(8)
        assert close.min() > 1e-3
    (two,) = solutions(scara, np.array([[0.3, 0.2, 0.1]]), down(0.3)[None])
    assert len(two) == 2


def test_the_same_input_gives_the_same_bits() -> None:
    chain = shipped("six")
    places, turns = chain.tool(configurations(chain, 3, 1))
    one, other = (solutions(chain, places, turns) for _ in range(2))
    assert [q.tobytes() for q in one] == [q.tobytes() for q in other]
    assert seeds(chain).tobytes() == seeds(chain).tobytes()


def test_seeds_fill_the_ranges() -> None:
    """Each tenth of each joint's range has some, none is outside."""
    for name in ARMS:
        chain = shipped(name)
        low = np.maximum(chain.limits.low, -np.pi)
        high = np.minimum(chain.limits.high, np.pi)
        share = (seeds(chain, 200) - low) / (high - low)
        assert share.min() >= 0.0 and share.max() <= 1.0
        for column in share.T:
            assert np.bincount((column * 10).astype(int), minlength=10).min() >= 10


def test_random_chains_come_back_to_their_poses() -> None:
    """Of chains with at least 6 joints, from a configuration close by; what is not at the pose is
    not said to be."""
    for seed in range(6):
        chain, _, _ = both(seed)
        q = configurations(chain, 20, seed)
        place, turn = chain.tool(q)
        rng = np.random.default_rng(seed)
        back, there = descend(chain, place, turn, q + rng.normal(size=q.shape) * 0.02)
        at, now = chain.tool(back)
        off = np.linalg.norm(at - place, axis=-1) + np.abs(now - turn).max(axis=(1, 2))
        assert ((off < 1e-7) == there).all()
        assert there.mean() >= 0.9


def test_hinges_turn_to_the_nearest_in_their_range() -> None:
    chain = shipped("six")
    q = configurations(chain, 50, 0)
    near = np.random.default_rng(1).uniform(-6, 6, q.shape)
    moved, inside = nearest_in_range(chain, q, near)
    assert inside.all() and (np.abs(moved) <= chain.limits.high).all() and (moved != q).any()
    assert np.abs((moved - q) / TURN % 1.0 - 0.5).min() > 0.5 - 1e-9
    for turn in (-TURN, TURN):
        other = moved + turn
        possible = np.abs(other) <= chain.limits.high
        assert (np.abs(other - near) >= np.abs(moved - near) - 1e-9)[possible].all()
    narrow = replace(chain.limits, low=np.full(6, 0.5), high=np.full(6, 0.6))
    _, inside = nearest_in_range(
        replace(chain, limits=narrow), np.full((2, 6), [[0.55], [0.65]]), near[:2]
    )
    assert inside.tolist() == [True, False]


def test_singular_values_do_not_depend_on_size_and_vanish_in_singular_configurations() -> None:
    chain = shipped("six")
    q = configurations(chain, 20, 0)
    double = replace(chain, anchor=2 * chain.anchor, tool_place=2 * chain.tool_place)
    assert np.allclose(least_singular_value(double, q), least_singular_value(chain, q), atol=1e-12)
    straight_arm, aligned = q[0].copy(), q[0].copy()
    straight_arm[2], aligned[4] = 0.0, 0.0
    values = least_singular_value(
        chain, np.stack([straight_arm, aligned, [0, 0.5, 1.5, 0, 1.5, 0]])
    )
    assert values[:2].max() < 1e-9 and values[2] > SINGULAR
    scara = shipped("scara")
    double = replace(
        scara,
        anchor=2 * scara.anchor,
        tool_place=2 * scara.tool_place,
        limits=replace(scara.limits, low=2 * scara.limits.low, high=2 * scara.limits.high),
    )
    q = configurations(scara, 20, 0)
    there = least_singular_value(scara, q)
    assert np.allclose(least_singular_value(double, q), there, atol=1e-12)


def test_a_straight_line_is_straight_and_keeps_the_orientation() -> None:
    chain = shipped("six")
    (q,) = solutions(chain, np.array([[0.3, 0.35, 0.1]]), down(0.2)[None])
    rows, good = straight_line(chain, q, retreat(chain, q), 0.085)
    assert good.all() and rows.shape == (8, 25, 6)
    assert np.abs(retreat(chain, q) - [0.0, 0.0, 1.0]).max() < 1e-8
    at, turn = chain.tool(rows)
    heights = np.linspace(0.0, 0.085, 25)
    assert np.abs(at - ([0.3, 0.35, 0.1] + heights[:, None] * [0, 0, 1])).max() < 1e-8
    assert np.abs(turn - down(0.2)).max() < 1e-8
    _, good = straight_line(chain, q, np.array([0.8, 0.6, 0.0]), 0.6)
    assert not good.any()


@pytest.mark.parametrize("distance", [1.0, 0.95])
def test_what_is_too_far_is_so_many_millimetres_short(distance: float) -> None:
    """The edge is reached, and 1 mm beyond it is not."""
    chain = shipped("six")
    place = np.array([0.6, 0.8, 0.0]) * distance + [0.0, 0.0, 0.15]
    why = diagnose_reach(chain, place, down(0.4))
    assert why is not None and why.reach is not None
    assert why.distance == pytest.approx(distance) and 0.5 < why.reach < distance
    for reach, there in ((why.reach - 5e-4, True), (why.reach + 5e-4, False)):
        at = np.array([0.6, 0.8, 0.0]) * reach + [0.0, 0.0, 0.15]
        (q,) = solutions(chain, at[None], down(0.4)[None], 256)
        assert bool(len(q)) is there
    short = (distance - why.reach) * 1e3
    assert why.message("lid", "left") == (
        f"'lid' is {distance:.3f} m from the axis of left, at 0.15 m above its base; "
        f"it comes to {why.reach:.3f} m there, {short:.0f} mm short"
    )


def test_what_is_too_near_too_high_or_nearly_singular_is_told_apart() -> None:
    chain = shipped("six")
    near = diagnose_reach(chain, np.array([0.0, 0.1, 0.15]), down(0.0))
    assert near is not None and near.reach is not None and near.reach > 0.13
    assert near.message("lid", "left").endswith(f"it comes no nearer than {near.reach:.3f} m there")
    high = diagnose_reach(chain, np.array([0.2, 0.1, 2.0]), down(0.0))
    assert high == Unreachable(pytest.approx(np.hypot(0.2, 0.1)), 2.0, None)
    assert high.message("a", "b").endswith("no place at that height so turned")
    edge = diagnose_reach(chain, np.array([1.0, 0.0, 0.15]), down(0.0))
    assert edge is not None and edge.reach is not None
    bent = diagnose_reach(chain, np.array([edge.reach - 1e-3, 0.0, 0.15]), down(0.0))
    assert bent is not None and bent.singular is not None and bent.singular < SINGULAR
    words = "'lid' is reached by left only within 0.08 of a singular configuration"
    assert bent.message("lid", "left") == words
    assert diagnose_reach(chain, np.array([0.3, 0.35, 0.15]), down(0.0)) is None
