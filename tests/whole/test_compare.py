"""The comparison with others: what its sections compute is what they say."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from benches.compare import ablations, concurrency, manuals
from tests.examples import with_hands


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


def test_a_chair_of_boxes_is_planned_and_compared(tmp_path: Path) -> None:
    manuals.write_chair(tmp_path)
    (chair,) = json.loads((tmp_path / "main_data.json").read_text())
    row = manuals.compared(chair, tmp_path / "parts" / "Chair" / "boxes")
    assert row["clean"] and row["f1"] == pytest.approx(2 / 3)


def test_one_operation_at_a_time_takes_as_long_for_each_unit() -> None:
    layout = with_hands("paper")
    alone, together = concurrency.made(layout, alone=True), concurrency.made(layout)
    assert alone["succeeded"] and together["succeeded"]
    assert together["first_s"] <= alone["first_s"]
    assert together["cycle_s"] < 0.8 * alone["cycle_s"]


def test_without_waits_a_run_fails_and_a_wrong_order_is_dead() -> None:
    layout = with_hands("stool")
    as_it_is, without = ablations.made(layout), ablations.made(layout, waits=False)
    assert as_it_is["succeeded"] and not as_it_is["contacts"]
    assert not without["succeeded"] and without["contacts"] and without["why"] == "Contact"
    found = ablations.orders(layout)
    assert found["wrong"] == found["dead"] > 0
    assert "order:" in found["why"]
