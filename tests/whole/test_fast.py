"""What only makes the MuJoCo world faster changes nothing: with it and without, and however many
ticks go to the engine in one call, a run is the same to the last bit."""

from __future__ import annotations

import pytest

from factory.engine.simulation.mujoco.fast import neighbours
from tests.simulation_values import ready


@pytest.fixture(autouse=True)
def _neighbours_in_small_factories_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(neighbours, "FEW", 0)


def test_no_more_is_simulated_than_was_asked_for() -> None:
    run = ready("paper", units=5).run(max_time=1.23)
    assert run.sim_time_s == pytest.approx(1.23) and run.trouble is not None
