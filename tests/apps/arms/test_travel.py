"""Lemma 2: a body is nowhere nearer to something than what it travels lets it come."""

from __future__ import annotations

import numpy as np

from factory.apps.arms.chain import ConvexBody, SerialChain
from factory.apps.arms.joint_way import JointWay
from factory.apps.arms.travel import travels
from tests.arm_models import both, configurations

STEPS = 20


def points_at(chain: SerialChain, body: ConvexBody, q: np.ndarray) -> np.ndarray:
    """Points of a body (..., k, 3) in the base frame."""
    place, turn = chain.frames(q)
    there = turn[..., body.frame, :, :] @ body.points.T
    return np.asarray(np.swapaxes(there, -1, -2) + place[..., None, body.frame, :])


def tip(chain: SerialChain) -> ConvexBody:
    """What is at the tool: a point."""
    return ConvexBody("tip", len(chain), chain.tool_place[None] * 1.5)


def test_nothing_is_nearer_than_the_lemma_says() -> None:
    """The distance of a tool from a point near its way, between samples of random chains with
    hinges and slides."""
    for seed in range(8):
        chain, _, _ = both(seed)
        rng = np.random.default_rng(seed)
        knots = np.concatenate([[0.0], np.cumsum(rng.uniform(0.2, 1.0, 9))])
        way = JointWay(knots, configurations(chain, 10, seed) * rng.uniform(0.05, 1.0))
        x = np.linspace(0.0, way.length, 251)
        tool = tip(chain)
        fine = np.linspace(0.0, way.length, 250 * STEPS + 1)
        path = points_at(chain, tool, way.at(fine)[0])[:, 0]
        near = path[rng.integers(len(path))] + rng.normal(0.0, 1e-3, 3)
        distance = np.linalg.norm(path - near, axis=-1)
        least = np.lib.stride_tricks.sliding_window_view(distance, STEPS + 1)[::STEPS].min(axis=1)
        at = distance[::STEPS]
        bound = (at[:-1] + at[1:] - travels(chain, way, x, [tool])[:, 0]) / 2
        assert (least >= bound - 1e-12).all()
        assert (least < at[:-1]).any()
