"""Seeded runs of pairs of robots on a tee, many at once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from factory.support.arrays import Array, Truth
from tests import reservation
from tests.ring import SPARE, Spots, Tee, TeeState

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
