"""Planted faults: each makes a run fail by name, and what is benign does not."""

from __future__ import annotations

import pytest

from tests.planted import BENIGN, PLANTS, Plant

QUICK = {
    *("nothing is solid", "the spheres round geoms are nothing", "there is no gravity for 0.2 s"),
    *("a part turns by 1°", "the log says 0 contacts", "the log is of another seed, and signed"),
}


@pytest.mark.parametrize(
    "plant",
    [pytest.param(p, marks=() if p.name in QUICK else pytest.mark.slow, id=p.name) for p in PLANTS],
)
def test_a_planted_fault_is_found_by_name(plant: Plant) -> None:
    verdict = plant.verdict()
    assert not verdict.succeeded
    assert {*plant.codes} <= {failure.code for failure in verdict.failures}, verdict.failures


@pytest.mark.slow
@pytest.mark.parametrize("plant", BENIGN, ids=str)
def test_what_is_benign_fails_nothing(plant: Plant) -> None:
    verdict = plant.verdict()
    assert verdict.succeeded, verdict.failures
