"""Places that are never marked together, and order places, against every marking of small nets."""

from __future__ import annotations

import pytest

from factory.theory.nets.exclusion import _Arc, _Paths
from factory.theory.nets.marked import MarkedNet
from factory.theory.nets.petri import PetriNet, Place, Transition


@pytest.mark.parametrize(("tokens", "is_implied"), [(0, False), (1, True)])
def test_an_arc_is_implied_by_a_path_with_no_more_tokens(tokens: int, is_implied: bool) -> None:
    """The path over the place without a token, though another one with a token goes beside it."""
    ends, marked = ((0, 1), (0, 1), (1, 2), (2, 0)), (0, 1, 1, 1)
    places = tuple(Place(f"p{n}", (a,), (b,)) for n, (a, b) in enumerate(ends))
    net = MarkedNet(PetriNet(tuple(map(Transition, "abc")), places), marked)
    assert _Paths(net).implies(_Arc(0, 2, tokens, 0)) == is_implied
