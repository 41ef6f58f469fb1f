"""Welds, hands and masks: what is said last of a weld or body counts, all is written at once, and
nothing else differs from writing it one after the other."""

from __future__ import annotations

import numpy as np
import pytest

from tests.good_runs import random_marking
from tests.simulation_values import layout_of, ready


@pytest.mark.parametrize("seed", [1])
def test_a_run_from_a_marking_begins_with_what_robots_hold(seed: int) -> None:
    """Where the welds hold it: nothing jumps."""
    start = random_marking(layout_of("paper"), seed)
    world = ready("paper", start=start).physical
    places = world.d.xpos.copy()
    for _ in range(20):
        world.advance(1)
    held = [body for held in world.parts.holdings.in_hands().values() for body in held.values()]
    assert np.abs(world.d.xpos[held] - places[held]).max(initial=0.0) < 1e-4
    assert not world.inspection.unintended
