"""The ring plan: both robots of a tee reach all goals, without a collision (Theorem 15)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from factory.support.arrays import Array
from factory.support.engine import mujoco
from tests.ring import ARRIVED, NO_WAY, Tee, TeeState
from tests.tee_runs import DT, TEE, arrived, reachable, run

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
