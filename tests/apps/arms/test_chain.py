"""Chains move, weigh and resist as the engine's do."""

from __future__ import annotations

import numpy as np

from tests.arm_models import both, configurations

SEEDS = range(30)


def test_no_point_is_faster_than_its_levers() -> None:
    """Levers bound the Jacobian of every point of a body, and are no idle bound."""
    used = 0.0
    for seed in SEEDS:
        chain, _, _ = both(seed)
        q, frame = configurations(chain, 100, seed), len(chain)
        points = np.random.default_rng(seed).normal(size=(3, 3)) * 0.1
        lever = chain.lever(frame, points)
        columns = np.array([chain.point_jacobian(q, frame, point)[:, :3] for point in points])
        speed = np.linalg.norm(columns, axis=2).max(axis=(0, 1))
        assert (speed <= lever + 1e-12).all()
        used = max(used, float((speed / lever)[~chain.slides].max(initial=0.0)))
    assert used > 0.95
