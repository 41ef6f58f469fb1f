"""Property (∗): an arm that follows a way within its limits keeps those of all joints."""

from __future__ import annotations

import numpy as np
import pytest

from factory.apps.arms.joint_way import JointWay
from factory.apps.arms.slowness import enforce_limits, tool_shares
from tests.arm_models import ANY_TOOL_SPEED, PACE, random_way, shipped


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


def test_knots_that_make_no_way_are_refused() -> None:
    for knots in ([0.0, 1.0, 2.0], [0.0, 1.0, 1.0, 2.0], [0.5, 1.0, 2.0, 3.0]):
        with pytest.raises(ValueError, match="knots for"):
            JointWay(np.array(knots), np.zeros((len(knots), 2)))
