"""The comparison with others: what its sections compute is what they say."""

from __future__ import annotations

from benches.compare import manuals


def test_a_manual_is_read_as_a_tree_of_parts() -> None:
    """Parts that are equal count as one kind; a step may name what is joined already."""
    chair = {"parts_ct": 5, "geometric_equivalence_relation": {"1": ["2", "3"], "0,1": ["0,2"]}}
    kinds = manuals.kinds_of(chair)
    assert kinds == [0, 1, 1, 1, 4]
    whole = frozenset({(0, 1), (1, 3), (4, 1)})
    one_leg, two = frozenset({(0, 1), (1, 1)}), frozenset({(0, 1), (1, 2)})
    assert manuals.manual([["0", "3"], "1", "2", "4"], kinds) == {one_leg, whole}
    assert manuals.manual([["0,1", "2"], "3", "4"], kinds) == {two, whole}
    assert manuals.f1({one_leg, whole}, {one_leg, whole}) == 1.0
    assert manuals.f1({one_leg, whole}, {two, whole}) == 0.5
