"""Every figure of fidelity against known values, and against planted faults."""

from __future__ import annotations

import pytest

from factory.apps.fidelity import SeedRecord
from factory.apps.fidelity.record import Fidelity


@pytest.mark.parametrize(
    ("units", "words"), [((4, 4), "2 seeds, 4 units"), ((9, 4, 61), "3 seeds, 4 to 61 units")]
)
def test_runs_are_counted_from_the_fewest_units_to_the_most(units, words: str) -> None:
    seeds = tuple(SeedRecord(seed, count, {}) for seed, count in enumerate(units))
    assert Fidelity("x", 3, 0.3, seeds).runs == words
