"""Platens: bends that are searched for, tiles, and what is made of them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

import factory
from factory.apps.platen import compacting
from factory.apps.platen.compacting import compacted
from factory.apps.platen.placing import Floor, Placing
from factory.apps.platen.platen import on_platen
from factory.floor.layout.bending import Detour
from factory.floor.layout.certificate import Region
from factory.floor.layout.crowding import Crowding
from factory.floor.layout.durations import Pace
from factory.floor.layout.layout import Layout
from factory.floor.layout.sweeps import piles, regions
from factory.floor.layout.way import Bend
from factory.support.errors import InputError, RunError
from tests.command_line import Terminal
from tests.examples import with_hands
from tests.paths import ROOT

PACE = Pace()


@pytest.fixture(scope="module")
def straight() -> Layout:
    """The truck on rails."""
    return with_hands("truck")


def crowded(layout: Layout) -> Iterator[tuple[Region, Region]]:
    return Crowding(layout).crowded(regions(layout, piles(layout.factory, layout.product)))


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
