"""The ring plan: both robots of a tee reach all goals, without a collision (Theorem 15)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from factory.support.arrays import Array, Truth
from factory.support.engine import mujoco
from tests import reservation
from tests.reservation import admitted, braking, drive, gaps
from tests.ring import ARRIVED, NO_WAY, SPARE, Spots, Tee, TeeState

DT = 0.01
"""The tick [s]."""

TEE = Tee(np.array([0.6, 0.35, 0.35]), 0.085, 0.02)
"""60 mm carriages with 20 mm between them, and corners of 20 mm that leave the lines by 5 mm."""

Limits = tuple[Array, Array]

Step = Callable[[TeeState, Spots, Limits, float], TeeState]


@dataclass(frozen=True)
class TeeRuns:
    """What n runs came to: which `collided`, on the lines of the tee or with their corners rounded,
    and which `missed` their goals; the `least` distance on the lines, and the
    longest way along an axis in a tick (`jump`) [m]."""

    collided: Truth
    missed: Truth
    least: float
    jump: float


def gap(state: TeeState, tee: Tee) -> Array:
    """How far pairs are from Δ (n,) [m]."""
    one, other = (state.boxes(slot, x, x) for slot, x in enumerate(state.x.T))
    return reservation.gaps(one, other, tee.delta)


def draw(rng: np.random.Generator, tee: Tee, count: int) -> Spots:
    """Random positions of pairs that are clear of each other."""
    edge, depth = np.empty((count, 2), np.intp), np.empty((count, 2))
    left = np.arange(count)
    while left.size:
        edge[left] = rng.choice(3, (left.size, 2), p=tee.lengths / tee.lengths.sum())
        depth[left] = rng.uniform(0.0, 1.0, (left.size, 2)) * tee.lengths[edge[left]]
        drawn = TeeState.at(Spots(edge[left], depth[left]))
        left = left[gap(drawn, tee) <= 2 * SPARE]
    return Spots(edge, depth)


def reachable(rng: np.random.Generator, tee: Tee, count: int) -> tuple[Spots, Spots]:
    """Random starts and goals; those that the ring does not lead to are left out."""
    start, goals = draw(rng, tee, count), draw(rng, tee, count)
    leads = tee.reachable(start, goals)
    return Spots(start.edge[leads], start.depth[leads]), Spots(
        goals.edge[leads], goals.depth[leads]
    )


def arrived(state: TeeState, goals: Spots) -> Truth:
    """Which pairs stand at their goals."""
    spots = state.spots
    way = np.where(
        spots.edge == goals.edge, np.abs(spots.depth - goals.depth), spots.depth + goals.depth
    )
    return np.asarray(((way < 2e-4) & (np.abs(state.v) < 0.01)).all(axis=1))


def wander(rng: np.random.Generator, tee: Tee, goals: Spots) -> Spots:
    """The goals, some of them drawn anew."""
    drawn, anew = draw(rng, tee, len(goals.edge)), rng.random((len(goals.edge), 1)) < 0.02
    return Spots(np.where(anew, drawn.edge, goals.edge), np.where(anew, drawn.depth, goals.depth))


def run(
    count: int, tee: Tee = TEE, seed: int = 0, step: Step | None = None, disturbed: bool = False
) -> TeeRuns:
    """Runs from random starts to random goals, at most 20 s each, with limits that differ by 30 %.

    `disturbed`: for 4 s goals change in motion, and later on, too, 30 % of the robots brake in each
    tick whatever the plan.
    """
    rng, step = np.random.default_rng(seed), step or tee.tick
    start, goals = reachable(rng, tee, count)
    state, shape = TeeState.at(start), start.edge.shape
    speed, acceleration = 0.5 * rng.uniform(0.7, 1.3, shape), np.full(shape, 2.0)
    least, floor = np.full(shape[0], np.inf), np.full(shape[0], np.inf)
    at, jump = tee.floor(state), 0.0
    there = np.zeros(shape[0], bool)
    for moment in range(round(20 / DT)):
        most = speed
        if disturbed:
            goals = wander(rng, tee, goals) if moment < 4 / DT else goals
            most = np.where(rng.random(shape) < 0.3, 0.0, speed)
        state = step(state, goals, (most, acceleration), DT)
        least = np.minimum(least, gap(state, tee))
        before, at = at, tee.floor(state)
        jump = max(jump, float(np.abs(at - before).max()))
        floor = np.minimum(floor, np.abs(at[:, 0] - at[:, 1]).max(axis=1))
        there = arrived(state, goals) | (there & (not disturbed))
        if there.all() and moment > 4 / DT * disturbed:
            break
    collided = (least < -1e-9) | (floor < tee.apart - tee.corner / 4 - 1e-9)
    return TeeRuns(collided, ~there, float(least.min()) + tee.apart, jump)


def adversary(count: int, tee: Tee = TEE, seed: int = 0) -> TeeRuns:
    """Runs of 6 s without a plan: each robot makes straight for a random goal, and gets another one
    every 0.4 s, whatever the other robot's is."""
    rng = np.random.default_rng(seed)
    state = TeeState.at(draw(rng, tee, count))
    shape = state.x.shape
    limits = 0.5 * rng.uniform(0.7, 1.3, shape), np.full(shape, 2.0)
    least, goals = np.full(count, np.inf), state.spots
    for moment in range(round(6 / DT)):
        if moment % 40 == 0:
            both = draw(rng, tee, count), draw(rng, tee, count)
            edge = np.stack([drawn.edge[:, slot] for slot, drawn in enumerate(both)], axis=1)
            depth = np.stack([drawn.depth[:, slot] for slot, drawn in enumerate(both)], axis=1)
            goals = Spots(edge, depth)
        state = tee.towards(state, goals, limits, DT)
        least = np.minimum(least, gap(state, tee))
    return TeeRuns(least < -1e-9, np.zeros(count, bool), float(least.min()) + tee.apart, 0.0)


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


CARRIAGE, MASS, TIMESTEP = 0.06, 1.6, 0.005
STEPS = round(DT / TIMESTEP)
TRACKING = 2e-4
"""The most by which a carriage may be off its reference, along one axis [m]."""


def model() -> mujoco.MjModel:
    """Two square carriages, on two slides each, whose drives are alike."""
    bodies = "".join(
        f'<body pos="0 0 .03"><joint name="x{n}" type="slide" axis="1 0 0"/>'
        f'<joint name="y{n}" type="slide" axis="0 1 0"/>'
        f'<geom type="box" size="{CARRIAGE / 2} {CARRIAGE / 2} .017" mass="{MASS}"/></body>'
        for n in (0, 1)
    )
    drives = "".join(
        f'<pid joint="{axis}{n}" kp="7600" kv="220" input="pos vel ff" forcerange="-40 40"/>'
        for n in (0, 1)
        for axis in "xy"
    )
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="{TIMESTEP}" integrator="implicitfast"/>'
        f"<worldbody>{bodies}</worldbody><actuator>{drives}</actuator></mujoco>"
    )


def planned(count: int, seed: int = 3) -> Array:
    """Where pairs are in each tick [m], and their velocities [m/s] (2, ticks, n, 2, 2)."""
    rng = np.random.default_rng(seed)
    start, goals = reachable(rng, TEE, count)
    state = TeeState.at(start)
    limits = 0.5 * rng.uniform(0.7, 1.3, state.x.shape), np.full(state.x.shape, 2.0)
    ticks = [at(state)]
    while not arrived(state, goals).all():
        state = TEE.tick(state, goals, limits, DT)
        ticks.append(at(state))
    return np.array(ticks).swapaxes(0, 1)


def at(state: TeeState) -> tuple[Array, Array]:
    """Where pairs are on the floor (n, 2, 2) [m], and their velocities [m/s]."""
    soon = replace(state, x=state.x + 1e-6 * state.v)
    return TEE.floor(state), (TEE.floor(soon) - TEE.floor(state)) / 1e-6


def driven(m: mujoco.MjModel, ticks: Array) -> tuple[int, float]:
    """How many steps had a contact when drives followed one pair's way (2, ticks, 2, 2), and how
    far one was off it at most [m]."""
    d, (xs, vs) = mujoco.MjData(m), ticks
    d.qpos[:] = xs[0].ravel()
    contacts, off = 0, 0.0
    for x, then, v, later in zip(xs, xs[1:], vs, vs[1:], strict=False):
        for step in range(STEPS):
            share = step / STEPS
            square, cube = share**2, share**3
            place = (2 * cube - 3 * square + 1) * x + (3 * square - 2 * cube) * then
            place += DT * ((cube - 2 * square + share) * v + (cube - square) * later)
            rate = (later - v) / DT
            pace = v + (share * DT + TIMESTEP / 2) * rate  # what the implicit damping acts on
            setpoint = place, pace, MASS * rate
            d.ctrl[:] = np.stack(setpoint, axis=-1).ravel()
            off = max(off, float(np.abs(d.qpos - place.ravel()).max()))
            mujoco.mj_step(m, d)
            contacts += d.ncon > 0
    return contacts, off


def check(count: int) -> None:
    """So many pairs touch nothing and follow their references."""
    m, ticks = model(), planned(count)
    results = [driven(m, ticks[:, :, pair]) for pair in range(ticks.shape[2])]
    assert max(contacts for contacts, _ in results) == 0
    assert max(off for _, off in results) < TRACKING


@pytest.mark.slow
def test_three_hundred_pairs_touch_nothing() -> None:
    """The campaign."""
    check(300)


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
