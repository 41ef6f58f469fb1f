"""Parts of a sub-assembly that was dropped collide with each other from then on."""

from __future__ import annotations

from itertools import combinations

import pytest

from factory.apps.recovery import recover
from factory.apps.recovery.faults import Campaign, WorldFault
from factory.engine.record.state import State
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.support.engine import mujoco
from tests.examples import with_hands

PRESSED = -0.008
"""Parts that fall on each other press in by no more than this [m]; at rest they do by a tenth."""


@pytest.mark.parametrize("label", ["stand", pytest.param("lit/2", marks=pytest.mark.slow)])
def test_parts_of_what_was_dropped_do_not_lie_in_each_other(label: str) -> None:
    """The lamp's sub-assemblies fell into heaps whose parts lay 24 to 50 mm in each other."""
    simulation = Simulation(with_hands("lamp"), RunRequest(recovers=True))
    recover(simulation, Campaign(faults=(WorldFault("drop", label=label, unit=1),), clear=2))
    world = simulation.physical
    m, d, geoms = world.m, world.d, world.parts.masks.solid
    deepest, seen = 0.0, 0

    def look(state: State) -> None:
        nonlocal deepest, seen
        for one, other in combinations(sorted(world.inspection.pressing.fallen), 2):
            seen += 1
            for pair in ((int(a), int(b)) for a in geoms[one] for b in geoms[other]):
                deepest = min(deepest, mujoco.mj_geomDistance(m, d, *pair, 0.001, None))

    made = simulation.run([look])
    assert made.products == 1 and seen > 100
    assert deepest > PRESSED
    assert made.physics and not made.physics.unintended_contacts and not made.physics.faults
    assert (m.geom_solref[:, 0] == m.geom_solref[0, 0]).all(), "back in hands they are as before"
