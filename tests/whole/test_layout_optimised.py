"""The optimised layout: never worse than the first feasible one, never below the bound, and what
its contours allow."""

from __future__ import annotations

from math import inf
from types import SimpleNamespace
from typing import Any

import pytest

import factory.floor.layout.optimising as optimising
import factory.floor.layout.packing as packing
from factory.floor.layout.dimensions import LAYERS
from factory.floor.layout.durations import Pace
from factory.floor.layout.outline import Choice, Outline
from factory.floor.layout.packing import SPAN, Packing
from factory.floor.layout.shapes import Shape
from factory.floor.layout.skyline import Skyline
from factory.support.settings import Settings


def outline(lane: tuple[float, float], front: float, crown: float = 0.0) -> Outline:
    """A robot whose own things are `front` ahead of its B end and 0.1 m behind, with a crown so
    wide on either side, from 0.05 m ahead to 0.3 m behind."""
    own = (-0.1, front, *lane)
    blocks = (own, (-0.3, 0.05, -crown, crown)) if crown else (own,)
    shape = Shape({}, (0.0, 0.0, 0.0, 0.0), 0.0, 0.035, 0.08, 0.0, False)
    return Outline(shape, Choice(), (blocks,) * 3, 0.0)


NARROW = (-0.04, 0.04)


def test_beside_a_path_a_long_robot_goes_past_the_crown_of_a_short_one() -> None:
    skyline = Skyline().taken(outline(NARROW, 0.0, 0.5), 0.0, 0.1)
    long = outline(NARROW, 0.0, 0.5)
    assert skyline.travel(long, 0.3, 0.1) == inf, "its own path would cross that crown"
    assert skyline.travel(long, 0.6, 0.1) == pytest.approx(0.45), "behind 0.4 m, 0.05 m ahead"
    assert skyline.travel(long, 1.0, 0.1) == pytest.approx(0.1), "beside it, no further than needed"


def test_boxes_do_not_nest() -> None:
    skyline = Skyline(nested=False).taken(outline(NARROW, 0.0, 0.5), 0.0, 0.6)
    assert skyline.travel(outline(NARROW, 0.0), 0.2, 0.3) == inf
    assert skyline.travel(outline(NARROW, 0.0), 0.6, 0.3) == pytest.approx(0.3)


def test_what_is_far_back_becomes_a_wall() -> None:
    skyline = Skyline()
    for number in range(20):
        skyline = skyline.taken(outline(NARROW, 0.0), 0.08 * number, 0.1)
    assert all(len(skyline.blocks[layer]) <= 16 for layer in LAYERS)
    assert skyline.travel(outline(NARROW, 0.0), 0.08 * 20, 0.1) == pytest.approx(0.1)
    assert skyline.travel(outline(NARROW, 0.0), 0.0, 0.1) == inf


PACE = Pace.of(Settings())


def test_the_slowest_robot_counts_most() -> None:
    assert optimising._weights([4.0, 2.0, 0.0]) == [1.0, (1 + 1 / 16) / 2, 0.5]


def test_stations_are_looked_at_as_long_as_the_way_there_is_worth_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    stops = (0.1, 0.11, 0.1 + 2 * SPAN, 5.0)
    guest: Any = SimpleNamespace(side=1, outline=None, travel=0.0)
    way: Any = SimpleNamespace(
        station=0.0, cost=0.0, beside={1: SimpleNamespace(starts=lambda outline, least: {*stops})}
    )
    made = Packing.__new__(Packing)
    made.robot, made.task = 0, SimpleNamespace(weights=[1.0], pace=PACE)  # type: ignore[assignment]
    monkeypatch.setattr(Packing, "_back", lambda *_: 0.0)
    monkeypatch.setattr(Packing, "_next", lambda *_: iter(()))
    monkeypatch.setattr(
        Packing,
        "_added",
        lambda self, way, stop, station, guests: SimpleNamespace(
            at=station, cost=PACE.rest(station) + station / PACE.speed
        ),
    )
    monkeypatch.setattr(packing, "_came", lambda beside, guest, station, travel: guest)
    looked = [one.at for one in made._stations(way, None, [guest], 0.1)]  # type: ignore[arg-type]
    assert looked == [0.1, 0.11]
