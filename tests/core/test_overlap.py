"""Solids as drawn: what two have in common, by how much, and what one sweeps."""

from __future__ import annotations

import pytest
from manifold3d import Manifold

from factory.floor.geometry.overlap import is_seen_near, may_share
from factory.floor.geometry.overlapping import Overlapping


def test_an_overlap_that_is_all_facets_is_said_to_be_and_may_be_allowed() -> None:
    for sagitta, is_facets in ((1e-4, False), (2e-4, True), (3e-4, True)):
        fault = Overlapping("peg", "hole", 2e-4, sagitta).fault(())
        assert fault is not None
        assert ("may be their facets" in fault.message) == is_facets
        assert (fault.hint or "").endswith(f"peg:hole:{1e3 * sagitta:g}mm") == is_facets


@pytest.mark.parametrize(
    ("up", "shares", "near"), [(1.0, False, True), (1.01, False, False), (0.99, True, False)]
)
def test_plates_that_lie_on_each_other_share_nothing_and_are_near(up, shares, near) -> None:
    plate = Manifold.cube((3.0, 3.0, 1.0)).refine(4)
    other = plate.translate((0.3, 0.2, up))
    assert (may_share(plate, other), is_seen_near(plate, other)) == (shares, near)
    assert is_seen_near(plate, other, 0.02) == (up >= 1) or shares
