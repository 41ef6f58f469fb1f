"""Platens: bends that are searched for, tiles, and what is made of them."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import factory
from factory.apps.exports.floor_plan import flat_shapes
from factory.apps.few_robots.aim import Aim
from factory.apps.few_robots.search import allocated
from factory.apps.platen import compacting
from factory.apps.platen.compacting import compacted
from factory.apps.platen.placing import Floor, Placing
from factory.apps.platen.platen import on_platen
from factory.floor.layout.bending import Detour
from factory.floor.layout.certificate import Region
from factory.floor.layout.crowding import Crowding
from factory.floor.layout.durations import Pace, cycle_of
from factory.floor.layout.layout import Layout
from factory.floor.layout.request import Ground
from factory.floor.layout.saved import LayoutTable
from factory.floor.layout.sweeps import piles, regions
from factory.floor.layout.tiles import fill_of, tiles_of
from factory.floor.layout.way import Bend
from factory.pipeline import read
from factory.support.errors import InputError, RunError
from factory.support.tables import table_of, value_of
from tests.command_line import Terminal
from tests.examples import with_hands
from tests.layout_values import paper_layout
from tests.paths import ROOT

PACE = Pace()


@pytest.fixture(scope="module")
def straight() -> Layout:
    """The truck on rails."""
    return with_hands("truck")


@pytest.fixture(scope="module")
def found(straight: Layout) -> list[Layout]:
    """What a short search finds for it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(compacting, "TRIES", 40)
        return compacted(straight, PACE)


@pytest.fixture(scope="module")
def platen(straight: Layout, found: list[Layout]) -> Layout:
    """The best of that on tiles."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("factory.apps.platen.platen.compacted", lambda *_: found)
        return on_platen(straight, PACE, 0.24)


def floor(layout: Layout) -> float:
    return Placing(Floor(layout), {}).area


def test_each_layout_found_takes_less_floor_and_is_about_as_fast(
    straight: Layout, found: list[Layout]
) -> None:
    floors = [floor(straight), *map(floor, found)]
    assert floors[1:] == sorted(floors[1:], reverse=True)
    assert floors[-1] < 0.9 * floors[0]
    for layout in found:
        assert cycle_of(layout, PACE) <= compacting.SLOWER * cycle_of(straight, PACE)


def crowded(layout: Layout) -> Iterator[tuple[Region, Region]]:
    return Crowding(layout).crowded(regions(layout, piles(layout.factory, layout.product)))


def test_no_layout_found_is_crowded(found: list[Layout]) -> None:
    """No layout found has regions that are too near; what else is wrong is not seen by regions."""
    for layout in found:
        assert not [*crowded(layout)]


def test_branches_that_come_too_near_are_seen(straight: Layout) -> None:
    """r13's branch on that of r6, moved there by a bend."""
    path = straight.guidepaths[12]
    travel = round(path.travel + 0.55, 3)
    for across in (0.5, -0.5):
        ground = Floor(straight)
        placing = Placing(ground, {}).changed(12, Detour(travel, (Bend(0.2, across),), 0.02), [12])
        placing.look([12])
        layout = certified_or_none(straight, placing)
        assert bool(placing.deep.any()) == (layout is None)


def certified_or_none(straight: Layout, placing: Placing) -> Layout | None:
    from factory.floor.layout.bending import bent

    layout = bent(straight, placing.detours)
    return None if [*crowded(layout)] else layout


def test_a_search_is_the_same_each_time(monkeypatch: pytest.MonkeyPatch) -> None:
    stool = with_hands("stool")
    monkeypatch.setattr(compacting, "TRIES", 10)
    one, other = (compacted(stool, PACE) for _ in range(2))
    assert one and [a.guidepaths for a in one] == [b.guidepaths for b in other]


def test_a_search_takes_no_longer_for_many_robots(
    straight: Layout, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A change takes a time that grows with the robots, so there are fewer of them."""
    tried = dict[int, int]()

    class Search:
        def __init__(self, layout: Layout, *_: object) -> None:
            self.robots = len(layout.guidepaths)

        def better(self, tries: int) -> list[tuple[float, Layout]]:
            tried[self.robots] = tries
            return []

    monkeypatch.setattr(compacting, "_Search", Search)
    for count in (1, 23, 100, 1000):
        compacted(replace(straight, guidepaths=straight.guidepaths[:1] * count), PACE)
    assert tried == {1: 220, 23: 5060, 100: 1200, 1000: 120}


def test_few_robots_are_looked_for_on_rails(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each of a hundred layouts with a search for bends of its own took an hour."""
    searched_for = list[Layout]()
    monkeypatch.setattr(
        "factory.apps.platen.platen.compacted", lambda made, _: searched_for.append(made) or []
    )
    project = read(ROOT / "examples" / "paper.pag", ground=Ground((4.0, 3.0), tile=0.24))
    best = allocated(project, Aim(robots="least", effort=10))
    assert best.layout.tile == 0.24 and best.ground == project.ground
    assert [len(made.guidepaths) for made in searched_for] == [len(best.layout.guidepaths)] == [3]


def test_tiles_lie_under_all_regions_and_nowhere_else(platen: Layout) -> None:
    tiles = np.array(tiles_of(platen))
    for region in regions(platen, piles(platen.factory, platen.product)):
        a, b, c, d = region.box
        wide = np.minimum(tiles[:, 1], b) - np.maximum(tiles[:, 0], a)
        deep = np.minimum(tiles[:, 3], d) - np.maximum(tiles[:, 2], c)
        shared = np.maximum(wide, 0.0) * np.maximum(deep, 0.0)
        assert shared.sum() == pytest.approx((b - a) * (d - c), abs=1e-5)
    steps = (tiles[:, [0, 2]] - tiles[0, [0, 2]]) / 0.24
    assert steps == pytest.approx(steps.round(), abs=1e-4)
    assert len({(x, y) for x, y in steps.round().tolist()}) == len(tiles)
    assert 0.3 < fill_of(platen, tiles_of(platen)) < 1.0
    assert len(tiles) * 0.24**2 < platen.area


def test_a_layout_on_rails_has_no_tiles(straight: Layout) -> None:
    assert tiles_of(straight) == []
    assert not any(shape.style == "tile" for shape in flat_shapes(straight))


def test_a_floor_plan_shows_tiles_and_bends(platen: Layout) -> None:
    shapes = [*flat_shapes(platen)]
    assert sum(shape.style == "tile" for shape in shapes) == len(tiles_of(platen))
    corners = sum(len(path.corners) for path in platen.guidepaths)
    legs = sum(shape.style == "path" for shape in shapes)
    assert legs == len(platen.guidepaths) + corners > len(platen.guidepaths)


def test_a_layout_with_bends_is_kept_and_read_again(platen: Layout) -> None:
    text = json.dumps(table_of(LayoutTable.of(platen)))
    table = value_of(LayoutTable, json.loads(text))
    factory_ = platen.factory
    read = table.laid_out(factory_, platen.product, factory_)
    assert read.guidepaths == platen.guidepaths
    assert (read.tile, read.area) == (0.24, platen.area)


def test_a_truck_on_a_platen_runs(platen: Layout) -> None:
    run = factory.run(platen, units=1)
    assert run.succeeded and run.refines_net
    assert run.physics.unintended_contacts == 0
    assert run.physics.handoff_gap_max_mm < 0.1


def test_a_platen_needs_its_floor(straight: Layout, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compacting, "TRIES", 0)
    with pytest.raises(RunError, match=r"takes 2\.\d+ x 1\.\d+ m of floor"):
        on_platen(straight, PACE, 0.24, (2.0, 1.0))


def test_a_platen_goes_with_no_relays() -> None:
    product = factory.load_pag(ROOT / "examples" / "paper.pag")
    with pytest.raises(InputError, match="--platen cannot be combined with --relay"):
        factory.lay_out(product, relay=True, tile=0.24)


def test_a_build_tells_its_tiles(
    run: Terminal, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(compacting, "TRIES", 10)
    file, to = ROOT / "examples" / "paper.pag", tmp_path / "paper.xml"
    document = run("build", file, "--tile", "0.12", "-o", to, "--json").json
    assert document["tile_m"] == 0.12
    assert document["tiles"] > 10
    assert 0.2 < document["fill"] < 1.0


def test_what_moves_together_stays_as_near_as_it_is() -> None:
    """Those that move with a robot are compared with others, not with each other."""
    placing = Placing(Floor(paper_layout()), {})
    near = np.zeros_like(placing.deep)
    near[2, 3] = near[3, 2] = 0.1
    placing.deep = near.copy()
    placing.look([1, 2, 3])
    assert (placing.deep == near).all()
