"""Property (∗): an arm that follows a way within its limits keeps those of all joints."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from factory.apps.arms.chain import SerialChain
from factory.apps.arms.inverse import solutions
from factory.apps.arms.joint_way import JointWay
from factory.apps.arms.slowness import (
    box_average,
    enforce_limits,
    smooth_majorant,
    tool_shares,
    way_through,
)
from tests.arm_models import (
    ANY_TOOL_SPEED,
    PACE,
    configurations,
    down,
    random_way,
    retreat,
    shipped,
    straight_line,
)

REFERENCES, STEPS, STEP = 200, 300, 0.005


def references(rng: np.random.Generator, length: float) -> Iterator[tuple[np.ndarray, ...]]:
    """Coordinates, speeds and accelerations (REFERENCES,) at steps of 5 ms: to random speeds with
    accelerations up to A, with stops and returns, and in time before the ends."""
    fast, most = PACE.speed, PACE.acceleration
    x, v = rng.uniform(0.0, length, REFERENCES), np.zeros(REFERENCES)
    aim = np.zeros(REFERENCES)
    for _ in range(STEPS):
        new = rng.choice([-fast, 0.0, fast, rng.uniform(-fast, fast)], REFERENCES)
        aim = np.where(rng.random(REFERENCES) < 0.04, new, aim)
        ahead = np.sqrt(2 * most * np.maximum(length - x - fast * STEP, 0.0))
        behind = np.sqrt(2 * most * np.maximum(x - fast * STEP, 0.0))
        push = np.clip((np.clip(aim, -behind, ahead) - v) / STEP, -most, most)
        yield x, v, push
        v = np.clip(v + push * STEP, -fast, fast)
        x = np.clip(x + v * STEP, 0.0, length)


@pytest.mark.parametrize("name", ["six", "scara"])
def test_no_joint_is_above_its_limits_on_random_ways(name: str) -> None:
    """10,000 references on 50 ways of both arms, long and short. Joints come near their limits."""
    chain, rng = shipped(name), np.random.default_rng(0)
    most = np.zeros(2)
    for seed in range(25):
        way = random_way(chain, seed, (1.0, 0.03)[seed % 2])
        rows = zip(*references(rng, way.length), strict=True)
        x, v, push = (np.concatenate(row) for row in rows)
        _, first, second = way.at(x)
        speed = np.abs(first * v[:, None]) / chain.limits.speed
        gain = np.abs(first * push[:, None] + second * (v**2)[:, None])
        most = np.maximum(most, [speed.max(), (gain / chain.limits.acceleration).max()])
    assert (most <= 1.0 + 1e-9).all()
    assert (most > 0.75).all()


def test_a_way_is_the_spline_with_not_a_knot_ends() -> None:
    for seed in range(6):
        rng = np.random.default_rng(seed)
        count = int(rng.integers(4, 40))
        x = np.concatenate([[0.0], np.cumsum(rng.uniform(0.05, 1.0, count - 1))])
        places = rng.normal(size=(count, 3))
        way, spline = JointWay(x, places), CubicSpline(x, places)
        at = np.linspace(0.0, way.length, 500)
        for order, value in enumerate(way.at(at)):
            scale = np.abs(spline(at, order)).max()
            assert np.abs(value - spline(at, order)).max() < 1e-10 * scale
        for beyond, end in ((-0.3, 0.0), (way.length + 0.3, way.length)):
            assert all((a == b).all() for a, b in zip(way.at(beyond), way.at(end), strict=True))


def test_bounds_hold_between_any_coordinates_and_are_met() -> None:
    for seed in range(6):
        chain = shipped("six")
        way = random_way(chain, seed)
        rng = np.random.default_rng(seed)
        x = np.sort(rng.uniform(0.0, way.length, 9))
        first, second = way.bounds(x)
        for number in range(8):
            _, slope, bend = way.at(np.linspace(x[number], x[number + 1], 400))
            assert (np.abs(slope) <= first[number] + 1e-12).all()
            assert (np.abs(bend) <= second[number] + 1e-9).all()
            assert np.abs(bend).max(axis=0) == pytest.approx(second[number], rel=0.05)
        fine, _ = way.bounds(np.linspace(0.0, way.length, 4000))
        dense = np.abs(way.at(np.linspace(0.0, way.length, 4000))[1]).max(axis=0)
        assert fine.max(axis=0) == pytest.approx(dense, rel=1e-3)


def test_limits_stretch_no_more_than_they_must() -> None:
    for seed in range(6):
        chain = shipped("six")
        way = random_way(chain, seed, (1.0, 0.03)[seed % 2])
        speed, push = way.shares(chain.limits, PACE)
        _, first, second = way.at(np.linspace(0.0, way.length, 3000))
        fast = np.abs(first) * PACE.speed / chain.limits.speed
        gain = np.abs(first) * PACE.acceleration + np.abs(second) * PACE.speed**2
        assert (fast.max(axis=0) <= speed + 1e-9).all()
        need = (gain / chain.limits.acceleration).max(axis=0)
        assert (need <= push + 1e-9).all() and (push <= 1.6 * need).all()
        assert max(speed.max(), push.max()) <= 1.0
        assert max(speed.max(), push.max()) > 1.0 - 1e-9
        shorter = way.stretch(0.98)
        assert shorter.length == pytest.approx(0.98 * way.length)
        again = enforce_limits(shorter, chain, ANY_TOOL_SPEED)
        assert again.length == pytest.approx(way.length, rel=1e-9)
        slower = enforce_limits(way, chain, PACE)
        assert tool_shares(chain, slower, PACE).max() <= 1.0
        assert slower.length > way.length or seed % 2


def test_the_nearest_coordinate_is_sought_where_the_arm_is() -> None:
    """Also where the way passes the same configuration again, or the arm is beside it."""
    for seed in range(10):
        chain = shipped("six")
        way = random_way(chain, seed)
        rng = np.random.default_rng(seed)
        x = rng.uniform(0.02, way.length - 0.02, 50)
        g, first, _ = way.at(x)
        beside = rng.normal(size=g.shape)
        beside -= first * ((beside * first).sum(1) / (first * first).sum(1))[:, None]
        beside *= 1e-3 / np.linalg.norm(beside, axis=1)[:, None]
        near = np.clip(x + rng.uniform(-0.01, 0.01, 50), 0.0, way.length)
        there, off = way.nearest(g + beside, near)
        assert np.abs(there - x).max() < 1e-9
        assert off == pytest.approx(1e-3, rel=1e-3)
        along, speed = way.along(g, 0.3 * first, near)
        assert np.abs(along - x).max() < 1e-9 and speed == pytest.approx(0.3)
    back = JointWay(np.arange(5.0), np.array([0.0, 1.0, 2.0, 1.0, 0.0])[:, None])
    assert back.nearest(np.full((2, 1), 1.0), np.array([1.02, 2.98]))[0] == pytest.approx([1, 3])


def test_knots_that_make_no_way_are_refused() -> None:
    for knots in ([0.0, 1.0, 2.0], [0.0, 1.0, 1.0, 2.0], [0.5, 1.0, 2.0, 3.0]):
        with pytest.raises(ValueError, match="knots for"):
            JointWay(np.array(knots), np.zeros((len(knots), 2)))


def ends(chain: SerialChain, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Straight beginning and end of a leg between two places in reach."""
    rng = np.random.default_rng(seed)
    lines = []
    for angle in rng.uniform(-1.2, 1.2, 2):
        place = np.array([0.38 * np.cos(angle), 0.38 * np.sin(angle), 0.05])
        (q,) = solutions(chain, place[None], down(rng.uniform(-1, 1))[None])
        lines.append(straight_line(chain, q[:1], retreat(chain, q[:1]), 0.085)[0][0])
    return lines[0], lines[1][::-1]


@pytest.mark.parametrize("name", ["six", "scara"])
@pytest.mark.parametrize("seed", range(4))
def test_a_way_has_straight_ends_slow_ends_and_uses_its_limits(name: str, seed: int) -> None:
    chain = shipped(name)
    out, into = ends(chain, seed)
    way = way_through(chain, out, np.stack([out[-1], into[0]]), into, PACE)
    g = way.at(np.array([0.0, way.length]))[0]
    assert np.abs(g - [out[0], into[-1]]).max() < 1e-12
    for low, high, end in ((0.0, way.off, 0), (way.hover, way.length, -1)):
        at, turn = chain.tool(way.at(np.linspace(low, high, 200))[0])
        assert np.abs(at[:, :2] - at[end, :2]).max() < 1e-6
        assert np.abs(turn - turn[end]).max() < 1e-3
        assert np.ptp(at[:, 2]) > 0.035
    speed, push = way.shares(chain.limits, PACE)
    tool = tool_shares(chain, way, PACE)
    assert max(speed.max(), push.max(), tool.max()) <= 1.0 + 1e-9
    slow = np.concatenate([tool[:20], tool[-20:]])
    assert slow.max() > 0.9


def test_a_box_average_is_that_of_the_polyline() -> None:
    """Against a fine sum; where the half width is 0 nothing changes."""
    rng = np.random.default_rng(0)
    t = np.linspace(0.0, 1.0, 41)
    path = rng.normal(size=(41, 2))
    half = np.where((t > 0.2) & (t < 0.8), 0.13, 0.0)
    mean = box_average(t, path, half)
    assert (mean[half == 0.0] == path[half == 0.0]).all()
    for k in np.flatnonzero(half):
        fine = np.linspace(t[k] - 0.13, t[k] + 0.13, 200_01)
        rows = np.stack([np.interp(fine, t, column) for column in path.T], axis=1)
        assert np.abs(rows.mean(axis=0) - mean[k]).max() < 1e-3


def test_a_smooth_majorant_is_nowhere_below() -> None:
    values = np.random.default_rng(0).uniform(size=300)
    smooth = smooth_majorant(values, 7)
    assert (smooth >= values - 1e-12).all()
    assert np.abs(np.diff(smooth)).max() <= 1 / 15 + 1e-12
    assert smooth_majorant(np.ones(50), 5) == pytest.approx(np.ones(50))


def test_random_configurations_are_joined_within_their_limits() -> None:
    """A transfer whose corners are sharp: the rounded way keeps (∗) with no straight ends."""
    chain = shipped("six")
    corners = configurations(chain, 3, 4) * 0.4
    legs = [np.linspace(a, b, 30) for a, b in pairwise(corners)]
    out, into = legs[0][:8], legs[1][-8:]
    middle = np.concatenate([legs[0][7:], legs[1][1:23]])
    way = way_through(chain, out, middle, into, PACE)
    speed, push = way.shares(chain.limits, PACE)
    assert speed.max() <= 1.0 and push.max() <= 1.0
    assert 0.0 < way.off < way.hover < way.length
