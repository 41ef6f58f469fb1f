"""Long runs: nothing drifts and nothing is lost; drifts and losses that are planted are noticed."""

from __future__ import annotations

import numpy as np
import pytest

from benches.fidelity import long_runs


def test_a_drift_is_noticed() -> None:
    noise = np.random.default_rng(0).normal(0, 1e-3, 200)
    steady = long_runs.compare((0.05 + noise).tolist(), 5, 1e-3)
    drifting = long_runs.compare((0.05 + noise + 5e-5 * np.arange(200)).tolist(), 5, 1e-3)
    assert steady["same"] and not drifting["same"]


def test_memory_that_grows_is_noticed() -> None:
    found = {
        "figures": {},
        "made": 1,
        "units": 1,
        "trouble": None,
        "refines_net": True,
        "contacts": 0,
        "warnings": 0,
        "growth_kib_a_unit": long_runs.growth([1e5 + 20.0 * n for n in range(100)]),
        "lost": [],
    }
    assert long_runs.faults(found) == ["memory grows by 20.0 KiB a unit"]


@pytest.mark.slow
def test_hundreds_of_units_do_not_drift() -> None:
    for run in long_runs.measure()["runs"]:
        assert long_runs.faults(run) == [], run
