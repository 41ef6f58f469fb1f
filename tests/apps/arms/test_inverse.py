"""Solutions of the inverse kinematics, and what is said of poses out of reach."""

from __future__ import annotations

import numpy as np
import pytest

from factory.apps.arms.inverse import SINGULAR, solutions
from factory.apps.arms.reach import Unreachable, diagnose_reach
from tests.arm_models import down, shipped


@pytest.mark.parametrize("distance", [0.95])
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
