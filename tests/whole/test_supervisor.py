"""The supervisor: what waits is asked for again only where something has changed that it may wait
for; clocks go on; nothing fires that is not enabled."""

from __future__ import annotations

import pytest

from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from tests.simulation_values import layout_of


def test_an_event_that_is_not_enabled_cannot_fire() -> None:
    """Planted fault: the supervisor is made to end an operation that has not begun."""
    simulation = Simulation(layout_of("paper"), RunRequest("ideal", units=1))
    sub3 = simulation.layout.factory.by_label["sub3"].index
    with pytest.raises(AssertionError, match="not all are enabled that fire: sub3_e"):
        simulation.supervisor._fire([], [sub3])
