"""Solids as drawn: what two have in common, by how much, and what one sweeps."""

from __future__ import annotations

from factory.floor.geometry.overlapping import Overlapping


def test_an_overlap_that_is_all_facets_is_said_to_be_and_may_be_allowed() -> None:
    for sagitta, is_facets in ((1e-4, False), (2e-4, True), (3e-4, True)):
        fault = Overlapping("peg", "hole", 2e-4, sagitta).fault(())
        assert fault is not None
        assert ("may be their facets" in fault.message) == is_facets
        assert (fault.hint or "").endswith(f"peg:hole:{1e3 * sagitta:g}mm") == is_facets
