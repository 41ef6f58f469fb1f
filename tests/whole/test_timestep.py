"""The timestep that the factory chooses: the longest that its drives allow, and no longer."""

from __future__ import annotations

from pathlib import Path

import pytest

from factory.apps.fidelity.record import QUANTITIES
from factory.engine.mjcf.driving import ALLOWED
from factory.support.errors import InputError
from factory.support.settings import AUTO, Settings
from tests.command_line import Terminal
from tests.paths import PAPER

LIMITS = ("tracking_error_max_mm", "handoff_gap_max_mm", "weld_residual_max_mm")
"""The figures that a timestep is chosen by."""


def test_it_is_half_of_what_a_good_factory_keeps() -> None:
    assert {QUANTITIES[key].limit for key in LIMITS} == {2e3 * ALLOWED}


def test_what_is_no_timestep_is_told(
    run: Terminal, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert "'soon' is not a valid float" in run("run", PAPER, "--timestep", "soon").err
    monkeypatch.setenv("FACTORY_TIMESTEP", "soon")
    told = run("run", PAPER)
    assert told.status == 2
    assert "FACTORY_TIMESTEP: timestep must be a number" in told.err
    assert 'for example timestep = 0.002, or "auto"' in told.err
    with pytest.raises(InputError, match="speed"):
        Settings().with_options({"speed": 1e9, "timestep": AUTO})
    with pytest.raises(ValueError, match="auto"):
        _ = Settings().step
