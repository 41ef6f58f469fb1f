"""The layout: what it says of the paper's example, of floors and payloads, and of what it
builds."""

from __future__ import annotations

from dataclasses import replace

import pytest

from factory.floor.geometry.product import product_geometry
from factory.floor.layout.certificate import ARM_BODY, Region
from factory.floor.layout.crowding import Crowding
from factory.floor.layout.dimensions import ARMS, Clearance
from factory.floor.layout.embedding import lay_out
from factory.floor.layout.feeding import feeder_of
from factory.floor.layout.footprint import footprint
from factory.floor.layout.guidepath import hull
from factory.floor.layout.layout import Layout, carriers
from factory.floor.layout.shapes import symmetric_shapes
from factory.floor.layout.sweeps import piles
from factory.floor.modes.modes import operation_modes
from factory.support.errors import InputError, RunError
from factory.theory.compiler.compiler import compile_pag
from factory.theory.problem.template import Law, Point
from tests.layout_values import (
    DRAWN,
    Drawn,
    paper_layout,
    random_layout,
    row_of_inserts,
    stations_of,
    table_pag,
)
from tests.pag_values import TEMPLATES, catalogue, factory_of, paper


def test_the_paper_s_example() -> None:
    """Golden numbers: whole millimetres, so they are exact."""
    layout = paper_layout()
    assert round(layout.guidepath_length * 1000) == 1182
    travels = [round(path.travel * 1000) for path in layout.guidepaths]
    assert travels == [150, 81, 159, 120, 81, 81]
    assert layout.area == pytest.approx(0.332, abs=0.001)
    at = stations_of(layout)
    stations = {o.label: at[o.index] for o in layout.factory.operations}
    assert stations["sub1"] == stations["sub3"] == 0.0
    assert stations["sub2"] == pytest.approx(0.08)
    assert {path.reach for path in layout.guidepaths[1:]} == {0.08}


def test_the_same_input_gives_the_same_layout() -> None:
    anew = random_layout.__wrapped__
    first, second = (anew(30, 4, "any", "mixed") for _ in range(2))
    assert first.guidepaths == second.guidepaths and first.visits == second.visits


@pytest.mark.parametrize("drawn", DRAWN[::2], ids=str)
def test_robots_meet_where_their_operation_is(drawn: Drawn) -> None:
    layout = random_layout(*drawn)
    factory = layout.factory
    for robot, carrier in enumerate(carriers(layout.factory)):
        if carrier < 0:
            continue
        number = factory.robots[robot].operations[-1]
        path, on = layout.guidepaths[robot], layout.guidepaths[carrier]
        assert path.a == pytest.approx(on.middle(layout.station(number)))
        assert path.middle(path.reach) == path.a
        assert abs(path.heading[0] * on.heading[0] + path.heading[1] * on.heading[1]) == 0
    assert len(operation_modes(layout, 2e-4)) == len(factory.operations)


@pytest.mark.parametrize("drawn", DRAWN[1::2], ids=str)
def test_payload_extents_are_those_of_their_parts(drawn: Drawn) -> None:
    layout = random_layout(*drawn)
    product, factory = layout.product, layout.factory
    x, y, _ = product.middle
    found = piles(factory, product)
    for label, parts in factory.contents.items():
        solids = [product.solids[part] for part in parts]
        wanted = hull([(s.low[0] - x, s.high[0] - x, s.low[1] - y, s.high[1] - y) for s in solids])
        assert layout.payloads[label] == pytest.approx(wanted)
        assert found[label].box == pytest.approx(wanted)
        height = max(s.high[2] for s in solids) - min(s.low[2] for s in solids)
        assert found[label].z[1] - found[label].z[0] == pytest.approx(height)
        assert found[label].z[0] >= 0.1 - 1e-9


def test_stretching_changes_lengths_alone() -> None:
    """A larger clearance makes paths longer; nothing else is scaled."""
    near, far = (lay_out(paper_layout().factory, paper_layout().product, c) for c in (0.01, 0.04))
    assert near.guidepath_length < paper_layout().guidepath_length < far.guidepath_length
    assert [p.heading for p in near.guidepaths] == [p.heading for p in far.guidepaths]


def test_frames_undo_each_other() -> None:
    for path in paper_layout().guidepaths:
        box = (-0.1, 0.3, -0.2, 0.05)
        assert path.world(path.frame(box), (0.0, 0.0)) == pytest.approx(box)


# --- floors ---------------------------------------------------------------------------------------


def test_a_floor_that_is_large_enough() -> None:
    layout = paper_layout()
    xlo, xhi, ylo, yhi = layout.floor
    again = lay_out(layout.factory, layout.product, floor=(xhi - xlo + 1e-6, yhi - ylo + 1e-6))
    assert again.floor == layout.floor


@pytest.mark.parametrize(
    ("floor", "words"),
    [
        (
            (0.59, 1.0),
            ["0.037 m too wide (along the output robot's path)", "to the outfeed's shed"],
        ),
        ((2.0, 0.4), ["0.130 m too deep (across it)", "the post of 'part3''s feeder"]),
        ((0.5, 0.5), ["0.127 m too wide", "0.030 m too deep"]),
    ],
)
def test_a_floor_that_is_too_small(floor: tuple[float, float], words: list[str]) -> None:
    layout = paper_layout()
    with pytest.raises(RunError) as caught:
        lay_out(layout.factory, layout.product, floor=floor)
    (found,) = caught.value.diagnostics
    assert found.code == "Layout"
    assert found.message.startswith("the factory takes 0.627 x 0.530 m of floor: ")
    for word in words:
        assert word in found.message
    assert found.hint.startswith("it fits --floor 0.63x0.53; the longest guidepath is that of r")


# --- templates ------------------------------------------------------------------------------------


def test_three_guests_at_one_point_are_refused() -> None:
    clamp = TEMPLATES["clamp"]
    press = replace(
        clamp,
        robots=("dot", "tool", "tool", "tool"),
        before=(*clamp.before, "nopart"),
        after=(*clamp.after, "nopart"),
        law=Law("navigation", (*clamp.law.goals, Point("A", 4, 2))),
    )
    with pytest.raises(InputError, match="3 guidepaths would end at one point"):
        laid_out_with(press)


def test_a_guest_with_its_goal_away_from_a_is_refused() -> None:
    weld = TEMPLATES["weld"]
    law = replace(weld.law, goals=(weld.law.goals[0], Point("B", 2)))
    with pytest.raises(InputError, match="'sub2': a robot that is not the carrier has its goal"):
        laid_out_with(replace(weld, law=law))


def test_goals_that_do_not_meet_fail_the_certificate() -> None:
    mate = TEMPLATES["mate"]
    law = replace(mate.law, goals=(Point("A", 1, 3), *mate.law.goals[1:]))
    with pytest.raises(RunError, match="the goals of mate do not meet"):
        laid_out_with(replace(mate, law=law))


def test_a_carrier_may_stop_ahead_of_its_tools() -> None:
    """clamp has its goal at S1, 2r ahead of where it would meet them."""
    rows = [("p", "atomic", "", {}), ("q", "atomic", "", {})]
    pag = table_pag("y", *rows, ("x", "mate", "p q", {}), ("y", "clamp", "x", {}))  # type: ignore[arg-type]
    factory = factory_of(pag)
    layout = lay_out(factory, product_geometry(pag))
    operation = factory.by_label["y"]
    ahead = layout.guidepaths[0].middle(layout.goals(operation.index)[0])
    station = layout.guidepaths[operation.robots[1]].a
    assert ahead[0] - station[0] == pytest.approx(layout.guidepaths[0].reach)


def laid_out_with(template: object) -> Layout:
    """The paper's example with one template replaced, under its own name or as weld."""
    name = template.name if template.name in ("mate", "weld") else "weld"  # type: ignore[attr-defined]
    templates = {**TEMPLATES, name: replace(template, name=name)}  # type: ignore[type-var]
    factory = compile_pag(paper(), templates, catalogue())  # type: ignore[arg-type]
    return lay_out(factory, product_geometry(factory.pag))


def test_an_insertion_at_a_feeder_keeps_clear_of_its_boom() -> None:
    """A part that takes another before anything else does so away from the boom over its feeder."""
    rows = [
        ("x", "insert", "p q", {}),
        ("p", "atomic", "", {"box": (0.1, 0.1, 0.02)}),
        ("q", "atomic", "", {"box": (0.02, 0.02, 0.2), "pos": (0.0, 0.0, 0.1)}),
    ]
    pag = table_pag("x", *rows)  # type: ignore[arg-type]
    layout = lay_out(factory_of(pag), product_geometry(pag))
    assert stations_of(layout)[layout.factory.by_label["x"].index] >= 0.07
    boom = feeder_of(layout, "p").boom
    assert layout.guidepaths[1].a[0] - 0.05 - boom[1] >= 0.02 - 1e-9


def test_later_guests_of_a_row_follow_one_another() -> None:
    layout = row_of_inserts(7)
    inserts = [o for o in layout.factory.operations if o.template.name == "insert"]
    at = stations_of(layout)
    stations = [at[o.index] for o in reversed(inserts)]
    assert stations == sorted(stations) and stations[0] > 0
    assert len(set(stations)) >= 3  # at most two, from either side, at one place


def test_a_fault_of_two_regions_says_how_far_they_are_apart_or_in_each_other() -> None:
    layout = paper_layout()
    one = Region(1, ARMS, ARM_BODY, (0.0, 1.0, 0.0, 1.0), (0.0, 0.1))
    for x, said in ((1.003, "are 3.0 mm apart"), (0.998, "overlap by 2.0 mm")):
        other = replace(one, robot=2, box=(x, 2.0, 0.0, 1.0))
        assert said in Crowding(layout).fault(one, other).message


def test_a_floor_has_tiles_only_if_they_are_asked_for() -> None:
    assert paper_layout().tile == 0.0


def test_a_corridor_beside_a_robot_is_left_only_if_it_is_asked_for() -> None:
    layout = paper_layout()
    (shape, *_), c = symmetric_shapes(layout.factory, layout.payloads, Clearance()), Clearance()
    made = [footprint(layout.factory, 0, shape, c, *asked) for asked in ((), (False,), (True,))]
    assert [one.corridor for one in made] == [False, False, True]
