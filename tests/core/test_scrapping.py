"""Piles that are carried back to the beginning of a way when they are scrap."""

from __future__ import annotations

from factory.floor.layout.crowding import separation
from factory.floor.layout.scrapping import not_carried_back
from factory.floor.layout.sweeps import piles
from tests.examples import with_hands


def test_the_finished_chest_would_hit_a_post() -> None:
    layout = with_hands("chest")
    assert not_carried_back(layout) == {(0, "chest")}
    path, label = layout.guidepaths[0], "chest"
    pile = piles(layout.factory, layout.product)[label]
    (way,) = path.sweeps(pile.box, path.length, layout.stops(0)[-2])
    posts = [r for r in layout.certificate.regions if r.robot == 7 and r.label == "front1"]
    assert min(separation(way, post.box) for post in posts) < layout.clearance
