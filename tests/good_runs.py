"""What every run in MuJoCo must reach, and markings for runs to start from."""

from __future__ import annotations

import random

from factory.engine.simulation.run import Run
from factory.floor.layout.layout import Layout
from factory.theory.nets.petri import Marking
from tests.token_game import enabled, follower


def assert_good(run: Run) -> None:
    """The figures that every MuJoCo run must reach."""
    assert run.trouble is None
    assert run.refines_net
    physics = run.physics
    assert physics is not None
    assert physics.handoff_gap_max_mm <= 1.0
    assert physics.product_error_max_mm is not None
    assert physics.product_error_max_mm <= 0.1
    assert physics.unintended_contacts == 0, physics.contacts
    assert physics.engine_warnings == 0


def random_marking(layout: Layout, seed: int) -> Marking:
    """A legal marking: play the token game at random for a while."""
    net, draw = layout.factory.net, random.Random(seed)
    marking = net.initial_marking
    for _ in range(draw.randrange(1, 60)):
        event = draw.choice(enabled(net.threaded.net, marking))
        marking = follower(net.threaded.net, marking, [event])
    return marking
