"""Piles that are carried back to the beginning of a way when they are scrap."""

from __future__ import annotations

from dataclasses import replace

import pytest

from factory.floor.layout.crowding import separation
from factory.floor.layout.scrapping import not_carried_back
from factory.floor.layout.sweeps import piles
from tests.examples import with_hands


@pytest.mark.parametrize("name", ["paper", "balanced", "lamp"])
def test_most_piles_can_be_carried_back(name: str) -> None:
    assert not_carried_back(with_hands(name)) == frozenset()


def test_the_finished_chest_would_hit_a_post() -> None:
    layout = with_hands("chest")
    assert not_carried_back(layout) == {(0, "chest")}
    path, label = layout.guidepaths[0], "chest"
    pile = piles(layout.factory, layout.product)[label]
    (way,) = path.sweeps(pile.box, path.length, layout.stops(0)[-2])
    posts = [r for r in layout.certificate.regions if r.robot == 7 and r.label == "front1"]
    assert min(separation(way, post.box) for post in posts) < layout.clearance


def test_a_wider_clearance_bars_more() -> None:
    layout = with_hands("truck")
    found = not_carried_back(layout)
    assert {label for _, label in found} == {"rear", "rear_set"}
    assert found < not_carried_back(replace(layout, clearance=2 * layout.clearance))
