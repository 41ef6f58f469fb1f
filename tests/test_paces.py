"""The campaign of cycle times, on a product that takes seconds."""

from __future__ import annotations

from benches.fidelity import paces


def test_the_pace_of_the_papers_example_is_that_of_its_net() -> None:
    (results,) = paces.measure(quick=True)
    (found,) = results["products"]
    assert found["done"] == found["refines_net"] == found["seeds"] == 2
    assert 0 < max(abs(found["off_least_percent"]), abs(found["off_most_percent"])) < paces.LIMIT
    assert "2 of 2" in paces.section(results)
