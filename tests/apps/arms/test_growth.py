"""Lemma 2: between two samples a body lies in their hull grown by ρ."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import nnls

from factory.apps.arms.chain import ConvexBody, SerialChain
from factory.apps.arms.growth import growths, samples, travels
from factory.apps.arms.joint_way import JointWay
from factory.apps.arms.read import chain_of
from tests.arm_models import both, configurations, random_way, shipped

WITHIN = np.linspace(0.0, 1.0, 9)[1:-1]


def points_at(chain: SerialChain, body: ConvexBody, q: np.ndarray) -> np.ndarray:
    """Points of a body (..., k, 3) in the base frame."""
    place, turn = chain.frames(q)
    there = turn[..., body.frame, :, :] @ body.points.T
    return np.asarray(np.swapaxes(there, -1, -2) + place[..., None, body.frame, :])


def off_chords(way: JointWay, chain: SerialChain, body: ConvexBody, x: np.ndarray) -> np.ndarray:
    """Greatest distance of the points of a body from their chords between samples (m - 1,)."""
    ends = points_at(chain, body, way.at(x)[0])
    between = x[:-1, None] + np.diff(x)[:, None] * WITHIN
    paths = points_at(chain, body, way.at(between)[0])
    share = WITHIN[:, None, None]
    chords = ends[:-1, None] + share * (ends[1:, None] - ends[:-1, None])
    return np.asarray(np.linalg.norm(paths - chords, axis=-1).max(axis=(1, 2)))


def corner(chain: SerialChain) -> ConvexBody:
    """What is at the tool: a point."""
    return ConvexBody("tip", len(chain), chain.tool_place[None] * 1.5)


@pytest.mark.parametrize("seed", range(40))
def test_no_point_leaves_its_chord_further_than_the_growth(seed: int) -> None:
    """On 250 pieces of ways of random chains: 10,000 in all."""
    chain, _, _ = both(seed)
    rng = np.random.default_rng(seed)
    x = np.concatenate([[0.0], np.cumsum(rng.uniform(0.2, 1.0, 9))])
    way = JointWay(x, configurations(chain, 10, seed) * rng.uniform(0.05, 1.0))
    at = np.sort(rng.uniform(0.0, way.length, 251))
    body = corner(chain)
    off = off_chords(way, chain, body, at)
    assert (off <= growths(chain, way, at, [body])[:, 0] + 1e-12).all()


def test_the_growth_is_used() -> None:
    """At least 40 % of it, for the shipped arm stretched out and for a random chain."""
    six = shipped("six")
    q = np.zeros((4, 6))
    q[:, 0], q[:, 1] = np.linspace(0.0, 1.0, 4), np.pi / 2
    way = JointWay(np.linspace(0.0, 1.0, 4), q)
    x = np.linspace(0.0, 1.0, 21)
    share = off_chords(way, six, corner(six), x) / growths(six, way, x, [corner(six)])[:, 0]
    assert 0.4 < share.max() <= 1.0
    best = 0.0
    for seed in range(20):
        chain, _, _ = both(seed)
        way = JointWay(np.arange(6.0), configurations(chain, 6, seed) * 0.3)
        x = np.linspace(0.0, 5.0, 201)
        share = off_chords(way, chain, corner(chain), x)
        best = max(best, float((share / growths(chain, way, x, [corner(chain)])[:, 0]).max()))
    assert 0.4 < best <= 1.0


def test_the_growth_is_met_by_an_arm_that_is_stretched_out() -> None:
    """Where all joints turn the same way, its far end bends as much as Lemma 2 lets it."""
    limits = '<numeric name="speed" data="1 1 1"/><numeric name="acceleration" data="1 1 1"/>'
    hinge = '<joint axis="0 0 1" range="-90 90"/><geom size="0.01"/>'
    link = f'<body pos="0.3 0 0">{hinge}'
    text = f'{3 * link}<site name="tool" pos="0.3 0 0"/>{3 * "</body>"}'
    chain = chain_of(f"<mujoco><custom>{limits}</custom><worldbody>{text}</worldbody></mujoco>")
    speeds = np.array([0.3, 0.8, 0.5])
    way = JointWay(np.linspace(-0.1, 0.1, 5) + 0.1, np.outer(np.linspace(-0.1, 0.1, 5), speeds))
    x = np.array([0.08, 0.12])
    tip = ConvexBody("tip", 3, chain.tool_place[None])
    share = off_chords(way, chain, tip, x) / growths(chain, way, x, [tip])[:, 0]
    assert 0.98 < share[0] <= 1.0


def distance_to_hull(point: np.ndarray, corners: np.ndarray) -> float:
    """Distance of a point from the hull of others: the least |Σ w c - p| with w >= 0, Σ w = 1."""
    heavy = 1e4
    matrix = np.vstack([corners.T, heavy * np.ones(len(corners))])
    weights, _ = nnls(matrix, np.append(point, heavy))
    return float(np.linalg.norm(corners.T @ (weights / weights.sum()) - point))


@pytest.mark.parametrize("seed", range(6))
def test_bodies_lie_in_the_hull_of_two_samples_grown(seed: int) -> None:
    """All bodies of the shipped arm, their corners at moments between the samples."""
    chain = shipped("six")
    way = random_way(chain, seed)
    x = np.linspace(0.0, way.length, 30)
    growth = growths(chain, way, x)
    for k in (3, 17):
        for number, body in enumerate(chain.bodies):
            hull = points_at(chain, body, way.at(x[k : k + 2])[0]).reshape(-1, 3)
            between = points_at(chain, body, way.at(x[[k]] + 0.45 * (x[k + 1] - x[k]))[0])[0]
            worst = max(distance_to_hull(point, hull) for point in between[::3])
            assert worst <= growth[k, number] + 1e-9


def test_travels_bound_the_paths_of_points() -> None:
    chain = shipped("six")
    used = 0.0
    for seed in range(10):
        way = random_way(chain, seed)
        x = np.linspace(0.0, way.length, 12)
        for number, body in enumerate(chain.bodies):
            rows = points_at(chain, body, way.at(np.linspace(0.0, way.length, 12 * 20 - 19))[0])
            steps = np.linalg.norm(np.diff(rows, axis=0), axis=-1).reshape(11, 20, -1)
            length = steps.sum(axis=1).max(axis=1)
            bound = travels(chain, way, x)[:, number]
            assert (length <= bound + 1e-12).all()
            used = max(used, float((length / np.maximum(bound, 1e-9)).max()))
    assert used > 0.5


def test_samples_are_as_close_as_the_growth_asks() -> None:
    chain = shipped("six")
    way = random_way(chain, 0)
    counts = []
    for most in (4e-3, 1e-3, 2.5e-4):
        x = samples(chain, way, most)
        assert x[0] == 0.0 and x[-1] == way.length and (np.diff(x) > 0).all()
        assert growths(chain, way, x).max() <= most
        counts.append(len(x))
    assert counts[0] < counts[1] < counts[2] < 3 * counts[1]
    with pytest.raises(ValueError, match="not all below"):
        samples(chain, way, 0.0)
