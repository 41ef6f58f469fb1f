"""The clearance certificate: it holds for every layout, and fails for every planted fault."""

from __future__ import annotations

import json

import pytest

from factory.floor.layout.certificate import ALWAYS, Certificate
from factory.floor.layout.clearance import certify
from factory.floor.layout.dimensions import SIDE
from factory.floor.layout.layout import Layout
from tests.layout_values import (
    DRAWN,
    Drawn,
    paper_layout,
    random_layout,
    row_of_inserts,
    shortened,
    with_path,
)


def broken(layout: Layout, *words: str) -> Certificate:
    """The certificate of a faulty layout, one of whose faults says all the words."""
    found = certify(layout)
    assert not found.holds
    texts = [fault.message for fault in found.faults]
    assert any(all(word in text for word in words) for text in texts), texts
    return found


@pytest.mark.parametrize("drawn", DRAWN, ids=str)
def test_every_layout_is_clear(drawn: Drawn) -> None:
    layout = random_layout(*drawn)
    assert layout.certificate is not None and layout.certificate.holds
    assert certify(layout) == layout.certificate


def test_what_comes_near_in_the_paper_s_example_is_in_one_gear() -> None:
    found = paper_layout().certificate
    assert found is not None and not found.apart.orders
    met = {frozenset(pair.machines) for pair in found.apart.excluded}
    assert {frozenset(["r3", "r5"]), frozenset(["r3", "r6"]), frozenset(["r1", "r2"])} <= met


def test_layers_and_gaps_are_stated() -> None:
    found = paper_layout().certificate
    assert found is not None
    assert [name for name, _, _ in found.layers] == ["carriages", "masts and arms", "payloads"]
    assert all(low < high for _, low, high in found.layers)
    assert all(gap > 0 for _, gap in found.gaps)


def test_coupled_regions_belong_to_the_operation_that_takes_the_payload() -> None:
    layout = paper_layout()
    assert layout.certificate is not None
    coupled = [r for r in layout.certificate.regions if r.mode != ALWAYS]
    assert len(coupled) == 5  # every robot but the tool delivers once
    for region in coupled:
        operation = layout.factory.operations[region.mode]
        assert region.label in operation.before


def test_a_fault_says_where_and_by_how_much() -> None:
    found = certify(shortened(paper_layout(), 4, 0.012))
    fault = next(fault for fault in found.faults if set(fault.robots) == {"r5", "r3"})
    assert fault.lacking == pytest.approx(0.012, abs=0.0015 + SIDE)
    assert len(fault.positions) == 2
    diagnostic = fault.diagnostic()
    assert diagnostic.code == "Layout"
    assert "mm nearer than they may; making a single unit needs both at once" in diagnostic.message
    assert "test.pag" in diagnostic.hint
    assert json.dumps(found.as_json())


def test_an_insertion_with_a_wrong_standoff(monkeypatch: pytest.MonkeyPatch) -> None:
    layout = row_of_inserts()
    monkeypatch.setattr(Layout, "standoff", lambda self, operation, slot: 0.0)
    broken(layout, "mm nearer than they may at the end of")
    monkeypatch.setattr(Layout, "standoff", lambda self, operation, slot: 2.0)
    broken(layout, "it could never start")


def test_guidepaths_that_cross_or_leave_the_grid() -> None:
    layout = paper_layout()
    x, y = layout.guidepaths[5].a
    broken(with_path(layout, 5, a=(x + 0.0004, y)), "r6", "not in whole millimetres")
    broken(with_path(layout, 5, travel=0.0), "r6", "has no length")
    broken(with_path(layout, 5, a=(x - 0.2, y)), "the guidepaths of r5 and r6 cross at")
    across = with_path(layout, 3, travel=-0.4)
    broken(across, "the guidepaths of r3 and r4 cross at")
