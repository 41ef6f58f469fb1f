"""Predicted times against the field and the governor, integrated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from factory.support.arrays import Array
from factory.theory.control.governed import GovernedAxis, Trajectory, mode_ticks, trajectories
from factory.theory.control.governor import follow
from factory.theory.control.mode import STILL, Limits, Mode
from factory.theory.control.navigation import Bundle
from factory.theory.control.profile import SpeedProfile

R, EPS = 0.06, 2e-4


def mate(lengths: Array) -> Mode:
    goals = np.array([2 * R, 2 * R, lengths[2]])
    pairs = np.array([[0, 1], [0, 2], [1, 2]])
    meet = np.array([0.0, 0.0, lengths[2] - 2 * R])[pairs]
    return Mode(goals, np.zeros(3), lengths, EPS, pairs, meet, np.full(3, R))


def staged(lengths: Array, standoffs: Array) -> Mode:
    """A chain of robots, each waiting for the one before."""
    k = lengths.size
    gate = np.arange(k) - 1
    return Mode(np.zeros(k), np.zeros(k), lengths, EPS, gate=gate, standoff=standoffs, dwell=0.1)


def measured(mode: Mode, x: Array, limits: Limits, drive: GovernedAxis) -> int:
    """The tick in which the field's flow, or the governed reference, ends the mode."""
    bundle, v, shown = Bundle.of([mode], [limits]), np.zeros_like(x), np.zeros_like(x)
    clock = 0.0
    for tick in range(1, 100_000):
        if drive.instant:
            x = x + bundle.field(x, drive.tick) * drive.tick
        else:
            x, v, a = follow(bundle, x, v, drive.tick)
            shown = v - drive.lag * a
        there = bool(bundle.at_goal(x)[0])
        clock += there * drive.tick
        if there and clock >= mode.dwell - 1e-9 and np.abs(shown).max() < STILL:
            return tick
    raise AssertionError("the goal was never reached")


def random_limits(rng: np.random.Generator, k: int) -> Limits:
    return Limits(rng.uniform(0.3, 1.0, k), rng.uniform(1.0, 5.0, k))


@pytest.mark.parametrize("instant", [False, True])
@pytest.mark.parametrize("tick", [1e-3, 10e-3])
def test_a_mode_ends_in_the_tick_in_which_the_integrated_one_does(
    instant: bool, tick: float
) -> None:
    """Rounding may shift the end by a tick: in one of twenty at most."""
    rng, off = np.random.default_rng(0), []
    for _ in range(8):
        long = rng.uniform(0.5, 1.5, 3)
        for mode, x0 in (
            (mate(long), np.array([long[0], long[1], 0.0])),
            (staged(long[:2], np.array([0.0, 0.6 * long[1]])), long[:2]),
            (staged(long, 0.9 * long * rng.uniform(0, 1, 3)), long),
            (staged(long[:2], np.array([0.0, 0.1])), np.array([1e-4, 1.0]) * long[:2]),
        ):
            limits, drive = (
                random_limits(rng, mode.size),
                GovernedAxis(1.0, 1.0, tick, tick / 2, instant),
            )
            assert mode.clear_from(x0)
            found = mode_ticks(mode, trajectories(mode, x0, limits, drive), tick)
            off.append(found - measured(mode, x0, limits, drive))
    assert max(map(abs, off)) <= 1 and sum(map(bool, off)) <= len(off) // 20


def test_known_times() -> None:
    profile = SpeedProfile(1.0, 1.0)
    assert [profile.rest(distance) for distance in (2.0, 0.25, 0.0)] == [3.0, 1.0, 0.0]
    assert [profile.landing(distance) for distance in (2.0, 0.125, 0.0)] == [2.5, 0.5, 0.0]


@settings(max_examples=200, deadline=None)
@given(
    st.floats(0.01, 5.0), st.floats(0.0, 1.0), st.floats(0.0, 9.0), st.floats(0.05, 2.0),
    st.floats(0.2, 9.0),
)  # fmt: skip
def test_staged_time_lies_between_going_through_and_stopping(
    distance: float, share: float, opens: float, v: float, a: float
) -> None:
    standoff, profile = share * distance, SpeedProfile(v, a)
    direct = profile.rest(distance)
    found = profile.staged(distance, standoff, opens)
    stopped = max(opens, profile.rest(distance - standoff))
    assert direct - 1e-6 <= found <= stopped + profile.rest(standoff) + 1e-6
    assert profile.staged(distance, standoff, 0.0) == pytest.approx(direct)
    late = 1e3
    expected = late + profile.rest(standoff)
    assert profile.staged(distance, standoff, late) == pytest.approx(expected, abs=1e-3)


@settings(max_examples=100, deadline=None)
@given(st.floats(0.001, 5.0), st.floats(0.05, 2.0), st.floats(0.2, 9.0), st.floats(0.0, 1.0))
def test_a_way_ends_at_the_distance_at_rest(d: float, v: float, a: float, part: float) -> None:
    profile = SpeedProfile(v, a)
    total = profile.rest(d)
    way, speed = profile.gone(d, total)
    assert way == pytest.approx(d) and speed == pytest.approx(0.0, abs=1e-9)
    half, speed = profile.gone(d, part * total)
    assert -1e-12 <= half <= d + 1e-9 and speed <= v + 1e-12


@settings(max_examples=60, deadline=None)
@given(st.floats(0.001, 1.0), st.floats(0.2, 2.0), st.floats(0.5, 9.0), st.floats(0.0, 1.0))
def test_a_way_in_ticks_is_the_continuous_one_rounded_up(
    d: float, v: float, a: float, part: float
) -> None:
    profile, way = SpeedProfile(v, a), GovernedAxis(v, a, 0.01).way(d)
    assert 0 <= way.rests(1e-6, 1e-6) - profile.rest(d) / 0.01 < 2.5
    tick = way.passes(part * d)
    assert way.left[tick] - 1e-9 <= part * d <= way.left[max(tick - 1, 0)]


def test_waiting_takes_a_tick_or_its_dwell() -> None:
    limits, drive = Limits(np.ones(2), np.ones(2)), GovernedAxis(1.0, 1.0, 0.01)
    ways = trajectories(Mode.still(2), np.zeros(2), limits, drive)
    assert mode_ticks(Mode.still(2), ways, 0.01) == 1
    assert mode_ticks(replace(Mode.still(2), dwell=0.25), ways, 0.01) == 25


def test_a_way_is_done_with_a_ramp_at_each_end() -> None:
    """0.25 s each, at half of 0.5 m/s; with a speed at the start the first one is shorter."""
    assert SpeedProfile().rest(1.0) == pytest.approx(2 * 0.25 + (1.0 - 2 * 0.0625) / 0.5)
    assert SpeedProfile().rest(1.0, 0.5) == pytest.approx(0.25 + (1.0 - 0.0625) / 0.5)


def test_an_axis_rests_once_it_is_both_near_and_slow() -> None:
    way = Trajectory((0.3, 0.1, 0.0, 0.0), (0.2, 0.1, 0.0, 0.0), (0.2, 0.2, 0.1, 0.0))
    assert (way.within(0.05), way.rests(0.05), way.rests(0.05, still=0.5)) == (2, 3, 2)
