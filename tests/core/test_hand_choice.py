"""What a hand costs, where pads and tips may be, and what is in their way."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from factory.floor.geometry.product import product_geometry
from factory.floor.layout.hands import in_the_way
from factory.floor.layout.hands.choosing import Hands
from factory.floor.layout.hands.groups import LONG, PINNED, WAIT
from factory.floor.layout.hands.hand import Hand
from factory.floor.layout.hands.holding import held
from factory.floor.layout.hands.kinds import ABOVE, BELOW
from factory.floor.layout.hands.lowered import Lowered
from factory.floor.layout.hands.one_hand import _cost
from factory.floor.layout.hands.outermost import _on_edges
from factory.floor.layout.hands.places import Loads, places
from factory.floor.layout.hands.surfaces import hit
from tests.layout_values import paper_layout, table_pag


def test_a_pin_and_a_wait_cost_and_a_wait_no_more_than_a_long_one() -> None:
    hand = Hand(BELOW, ((0.0, 0.0, 0.0),))
    waits = replace(hand, wait=0.1 * LONG / WAIT)
    late = replace(hand, wait=9.0 * LONG / WAIT)
    assert _cost(hand) == 0.0
    assert _cost(replace(waits, tip="pin")) == pytest.approx(PINNED + 0.1 * LONG)
    assert _cost(late) == LONG


def test_an_upright_edge_is_within_a_disc_where_its_foot_is() -> None:
    """And one that rises reaches as far out as where it leaves the disc."""
    ends = np.array([[[0.05, 0.0], [0.05, 0.0]], [[0.0, 0.0], [0.1, 0.0]]])
    out, at = np.array([[0.0, 0.3], [0.0, 0.2]]), np.array([[0.0, 0.0], [0.05, 0.0], [0.0, 0.9]])
    reach = _on_edges(ends, out, at, np.full(3, 0.01))
    assert reach == pytest.approx([0.02, 0.3, -np.inf])


def test_how_thick_a_plate_is_does_not_matter_to_places_on_it() -> None:
    made = []
    for thick in (0.005, 0.1):
        values = {"box": (0.1, 0.06, thick), "density": 5.0 / thick}
        product = product_geometry(table_pag("x", ("x", "atomic", "", values)))
        made.append(places(product, ("x",), (2, 1), ABOVE, Loads.of(product, (("x",),), 0.0)))
    thin, thick = made
    assert len(thin) and (thin.at[:, :2] == thick.at[:, :2]).all()


def test_what_is_lowered_onto_a_place_is_in_the_way_there(monkeypatch: pytest.MonkeyPatch) -> None:
    layout = paper_layout()
    looked = Hands(layout.factory, layout.product).in_the_way
    frames = [((1, 0), (0, 1))]
    robot = next(r.index for r in layout.factory.robots if r.travels and r.index)
    label = held(layout.factory, robot)
    at = looked.on_side(robot, ABOVE, frames)

    def met(*ways: Any) -> Any:
        return np.arange(ways[0]) == 0 if len(ways) == 1 else hit(*ways)

    monkeypatch.setattr(Lowered, "beams", lambda _, robot, kind, at, u, t: [(len(at),)])
    monkeypatch.setattr(in_the_way, "hit", met)
    free, _ = looked.checks(robot, label, ABOVE, at, frames)
    assert free["lowered"].tolist() == [False, *[True] * (len(at) - 1)]
