"""The optimised layout: never worse than the first feasible one, never below the bound, and what
its contours allow."""

from __future__ import annotations

from dataclasses import replace
from math import inf
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings

import factory.floor.layout.optimising as optimising
import factory.floor.layout.packing as packing
from factory.engine.timing.gain import gain, soonest
from factory.engine.timing.timed import pace as paced
from factory.engine.timing.timing import Timing
from factory.floor.geometry.product import product_geometry
from factory.floor.layout.bounds import cycle_time_bound
from factory.floor.layout.dimensions import LAYERS, Clearance
from factory.floor.layout.durations import Pace, gear_times, operation_times
from factory.floor.layout.embedding import lay_out
from factory.floor.layout.layout import Layout
from factory.floor.layout.optimising import first_feasible
from factory.floor.layout.outline import Choice, Outline
from factory.floor.layout.packing import SPAN, Packing
from factory.floor.layout.request import Ground
from factory.floor.layout.shapes import Shape
from factory.floor.layout.skyline import Skyline
from factory.pipeline import read
from factory.support.errors import RunError
from factory.support.settings import Settings
from tests.command_line import Terminal
from tests.layout_values import (
    STYLES,
    Drawn,
    drawn_layouts,
    paper_layout,
    random_layout,
    row_of_inserts,
    stations_of,
    table_pag,
)
from tests.once import Stages
from tests.pag_values import SHAPES, factory_of
from tests.paths import EXAMPLES, ROOT

PACE = Pace.of(Settings())


def cycle(layout: Layout) -> float:
    return max(gear_times(layout, PACE))


@settings(max_examples=10)
@given(drawn_layouts)
def test_between_the_bound_and_the_first_layout(drawn: Drawn) -> None:
    """The bound is that of the first layout too, which no search has touched."""
    layout = random_layout(*drawn)
    first = first_feasible(layout.factory, layout.product, Clearance())
    bound = cycle_time_bound(layout.factory, layout.product, layout.clearance, PACE)
    assert 0 < bound <= cycle(layout) + 1e-9
    assert cycle(layout) <= cycle(first) + 1e-9


@settings(max_examples=20)
@given(drawn_layouts)
def test_times_are_those_of_the_modes(drawn: Drawn) -> None:
    """Scalar times, from rest to rest, against those predicted from the modes of the operations:
    in whole ticks, and with dwells that begin in the goal ball."""
    layout = random_layout(*drawn)
    predicted = Timing(layout, replace(Settings(), stage=False)).delays
    later = np.array(predicted) - operation_times(layout, PACE)
    slowing = 1.0 - PACE.entered(1.0)
    assert later.min() > -slowing - Settings().tick and later.max() < 4 * Settings().tick


@pytest.mark.parametrize(
    ("name", "figures"),
    [
        ("paper", (2.53, 2.53, 2.481)),
        ("lamp", (3.88, 3.88, 2.863)),
        ("stool", (6.11, 5.53, 3.223)),
        ("shelf", (6.22, 6.22, 3.105)),
        ("balanced", (2.93, 2.97, 1.315)),
    ],
)
def test_what_the_examples_gain(name: str, figures: tuple[float, float, float]) -> None:
    """Cycle times [s] of the first layout and the one found, as runs are predicted, and the bound.
    The search does not know which hands wait for others: of the balanced tree's first layout, by
    its estimate slower, fewer do."""
    project = read(EXAMPLES / f"{name}.pag")
    found = gain(project.layout, project.settings, project.hands)
    first, chosen = found.first.predicted_cycle_time_s, found.chosen.predicted_cycle_time_s
    assert (first, chosen, found.bound) == pytest.approx(figures, abs=6e-4)
    assert chosen == pytest.approx(paced(project.layout, project.settings)[0].seconds, abs=1e-6)


@given(drawn_layouts)
@settings(max_examples=8)
def test_no_run_is_faster_than_the_bound(drawn: Drawn) -> None:
    """A run counts an operation as ended a little before its robots rest, and knows it in a whole
    tick; at any speed and however rough its ticks are."""
    seed = drawn[1]
    asked = Settings(stage=seed // 2 % 2, eps=10.0 ** (-4 + seed % 3 / 2))
    if seed % 2:
        asked = replace(asked, timestep=0.002 * (1 + seed % 4), substeps=1 + seed % 3)
    layout = random_layout(*drawn)
    bound = cycle_time_bound(layout.factory, layout.product, layout.clearance, soonest(asked))
    assert bound <= paced(layout, asked)[0].seconds + 1e-9


def test_the_search_and_the_bound_agree_where_the_paper_s_robots_are_close() -> None:
    """The paper's layout is as good as any: all that is missing is a millimetre of rounding."""
    layout = paper_layout()
    bound = cycle_time_bound(layout.factory, layout.product, layout.clearance, PACE)
    assert cycle(layout) - bound < 0.01


def test_large_factories_are_packed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(optimising, "LARGE", 0)
    for seed in range(12):
        layout = random_layout(8 + seed, seed, SHAPES[seed % 4], STYLES[seed % len(STYLES)])
        assert layout.certificate is not None and layout.certificate.holds
    chest = read(EXAMPLES / "chest.pag")
    assert cycle(lay_out(chest.plain, chest.product)) < 7.0


def test_the_output_robot_need_not_pass_the_branches_ahead() -> None:
    """A balanced tree: the product leaves between the branches; boxes would make its way as long
    as they are."""
    rows = [(f"p{n}", "atomic", "", {}) for n in range(16)]
    level, number = [row[0] for row in rows], 0
    while len(level) > 1:
        pairs = list(zip(level[::2], level[1::2], strict=True))
        level = [f"s{number + n}" for n in range(len(pairs))]
        rows += [(s, "mate", " ".join(p), {}) for s, p in zip(level, pairs, strict=True)]
        number += len(pairs)
    factory = factory_of(table_pag(level[0], *rows))
    product = product_geometry(factory.pag)
    first = first_feasible(factory, product, Clearance())
    passed = lay_out(factory, product).guidepaths[0].travel
    assert passed < 0.3 < 0.6 < first.guidepaths[0].travel


def test_slower_robots_get_another_layout() -> None:
    """The pace is part of what is optimised; the same pace gives the same layout."""
    project = read(EXAMPLES / "truck.pag")
    factory, slow = project.plain, replace(PACE, speed=0.1)
    one, again = (lay_out(factory, project.product, pace=slow) for _ in range(2))
    assert one.guidepaths == again.guidepaths
    assert one.guidepaths != lay_out(factory, project.product).guidepaths
    assert one.certificate is not None
    first = first_feasible(one.factory, project.product, Clearance())
    assert max(gear_times(one, slow)) < max(gear_times(first, slow))


def test_a_floor_that_only_the_first_layout_fits() -> None:
    """Nested branches are deeper; on a floor that is too shallow they are laid out as boxes."""
    project = read(EXAMPLES / "shelf.pag")
    factory, product = project.plain, project.product
    xlo, xhi, ylo, yhi = lay_out(factory, product).floor
    shallow = (10.0, yhi - ylo - 0.01)
    found = lay_out(factory, product, floor=shallow)
    assert found.floor[3] - found.floor[2] <= shallow[1]
    assert cycle(found) > cycle(lay_out(factory, product))
    with pytest.raises(RunError, match="too deep"):
        lay_out(factory, product, floor=(10.0, 0.3))
    assert xhi > xlo


def test_a_row_of_inserts_stands_on_both_sides() -> None:
    layout = row_of_inserts(9)
    headings = {path.heading for path in layout.guidepaths[1:]}
    assert len(headings) == 2
    assert max(stations_of(layout).values()) < 8 * 0.08


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


def test_beside_a_path_a_short_robot_stops_before_the_crown_of_a_long_one() -> None:
    skyline = Skyline().taken(outline(NARROW, 0.0, 0.5), 0.0, 0.6)
    short = outline(NARROW, 0.0)
    assert skyline.travel(short, 0.2, 0.3) == pytest.approx(0.3), "0.55 m is where the crown begins"
    assert skyline.travel(short, 0.2, 0.5) == inf, "its rear would be in the crown"
    assert skyline.travel(short, 0.07, 0.3) == inf, "their lanes would overlap"
    assert {round(start, 3) for start in skyline.starts(short, 0.0)} == {0.08, 0.54}


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


def test_a_slow_pace_takes_longer() -> None:
    slow = replace(PACE, speed=0.1)
    assert max(gear_times(paper_layout(), slow)) > 1.5 * cycle(paper_layout())
    assert slow.rest(1.0) == pytest.approx(10.05) and slow.rest(0.0) == 0.0
    assert PACE.staged(1.0, 0.2, 0.0) == PACE.rest(1.0)
    assert PACE.staged(1.0, 0.2, 9.0) == pytest.approx(9.0 + PACE.rest(0.2))


def test_build_tells_what_was_gained(run: Terminal, stages: Stages) -> None:
    stages.on = True
    chest = EXAMPLES / "chest.pag"
    told = run("build", chest)
    assert told.status == 0
    words = "cycle 6.30 s (r12); first feasible layout 8.09 s, 2.85 m², 7.72 m;"
    assert f"{words} no layout below 3.12 s" in told.out
    found = run("build", chest, "--json").json["layout"]
    assert found["predicted_cycle_time_s"] == pytest.approx(6.30, abs=1e-3)
    assert found["bottleneck"] == "r12"
    assert found["first_feasible"]["predicted_cycle_time_s"] == pytest.approx(8.09, abs=1e-3)
    assert found["cycle_time_bound_s"] == pytest.approx(3.122, abs=1e-3)
    assert found["area_m2"] < found["first_feasible"]["area_m2"]


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("paper", ()),
        ("paper", ("--wip", 1)),
        ("paper", ("--parallel", "sub2=2")),
        ("paper", ("--robots", 4)),
        ("balanced", ()),
    ],
)
def test_build_and_run_tell_one_cycle_time(
    run: Terminal, stages: Stages, name: str, options: tuple[object, ...]
) -> None:
    """The balanced tree's robots wait for each other's hands, which the search does not know."""
    stages.on = True
    file = EXAMPLES / f"{name}.pag"
    told = run("build", file, *options, "--json").json["layout"]
    made = run("run", file, *options, "--world", "mujoco", "--units", 1, "--json").json
    assert told["predicted_cycle_time_s"] == pytest.approx(made["predicted_cycle_time_s"], abs=1e-6)
    assert told["bottleneck"] == made["bottleneck"]
    assert told["cycle_time_bound_s"] < told["predicted_cycle_time_s"]


def test_a_factory_is_laid_out_at_the_pace_of_its_settings(stages: Stages) -> None:
    """At a crawl, ways cost more than gates: the truck's factory is another one then."""
    stages.on = True
    project = read(ROOT / "examples" / "truck.pag", ())
    usual, slow = (
        Ground().lay_out(project.plain, project.product, Settings(speed=speed))
        for speed in (0.5, 0.05)
    )
    assert slow.guidepaths != usual.guidepaths


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
