"""The planner on puzzles with known answers, from meshes to a tree or to a proof that there is
none."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from factory.apps.planning.plan import CannotAssemble, Planned, PlanOptions, plan
from factory.floor.mating.paths import TOLERANCE
from factory.support.errors import InputError
from tests.plan_puzzles import Box, Parts, block, dovetail, pinwheel, ring, source, tub

QUICK = PlanOptions(lay_out=False)


def _bar(n: int, y: float, until: float, low: float, high: float) -> Box:
    """A bar along a plank."""
    return (-30, 20 * n + y, low), (30, 20 * n + until, high)


NEST: Parts = {
    "outer": tub(60, 60, 0, 60),
    "inner": tub(40, 40, 4.2, 40),
    "cube": [block(30, 30, 4.4, 30)],
    "inner_lid": [block(48, 48, 44.4, 48)],
    "lid": [block(68, 68, 60.2, 64)],
}
PEG: Parts = {
    "peg": [block(10, 10, 0, 30), block(40, 40, -6, 0)],
    "cap": [
        ((-20, -20, 0.2), (-5.2, 20, 30.2)),
        ((5.2, -20, 0.2), (20, 20, 30.2)),
        ((-5.2, -20, 0.2), (5.2, -5.2, 30.2)),
        ((-5.2, 5.2, 0.2), (5.2, 20, 30.2)),
        block(40, 40, 30.2, 36),
    ],
}
CHAIN: Parts = {"one": ring(0, 2), "two": ring(21.5, 1), "three": ring(43, 2)}
HOOKS: Parts = {"one": ring(0, 2, -1), "two": ring(21.5, 1, +1)}
TWINS: Parts = {
    "bar": [block(60, 20, 0, 10)],
    "left": [((-36, -14, 0), (-30, 14, 20)), ((-30, 10.2, 0), (-10, 14, 20))],
    "right": [((30, -14, 0), (36, 14, 20)), ((10, 10.2, 0), (30, 14, 20))],
}
FAR_WALL: Parts = {
    "plate": [((-50, -20, -6), (80, 20, 0))],
    "guide": [
        ((-10, -20, 0.2), (10, -5.2, 14)),
        ((-10, 5.2, 0.2), (10, 20, 14)),
        ((-10, -20, 14), (10, 20, 18)),
    ],
    "bolt": [((-30, -5, 0.2), (30, 5, 10))],
    "east": [((60, -20, 0), (66, 20, 30))],
    "west": [((-46, -20, 0), (-40, 20, 30))],
}
BRIDGE: Parts = {
    "north": [block(10, 10, 0, 40, y=40)],
    "south": [block(10, 10, 0, 40, y=-40)],
    "deck": [block(12, 100, 40, 46)],
}
DRAWN_IN: Parts = {
    "tray": tub(60, 30, 0, 20),
    "first": [((-30.1, -15.1, -0.1), (-9.9, 15.1, 18))],
    "second": [((-10.1, -15.1, -0.1), (10.1, 15.1, 18))],
    "third": [((9.9, -15.1, -0.1), (30.1, 15.1, 18))],
}
PLANKS: Parts = {
    f"plank{n}": [
        ((-30, 20 * n, 0), (30, 20 * n + 15, 12)),
        *([_bar(n, 15, 17, 4, 8), _bar(n, 17, 19.5, 2, 10)] if n < 3 else []),
        *([_bar(n, -4.8, -3.2, z, z + 3.8) for z in (0, 8.2)] if n else []),
        *([_bar(n, -3.2, 0, z, z + 1.8) for z in (0, 10.2)] if n else []),
    ]
    for n in range(4)
}
LOADED: Parts = {
    "tube": [*tub(20, 20, 0, 80)],
    **{f"disc{n}": [block(19, 19, 10 * n + 0.2, 10 * n + 10)] for n in range(7)},
}


def planned(folder: Path, parts: Parts, options: PlanOptions = QUICK) -> Planned:
    found = plan(source(folder, parts), options)
    assert isinstance(found, Planned)
    assert found.figures.blocked == found.figures.through == found.figures.apart == 0
    assert found.optimal
    return found


def refused(folder: Path, parts: Parts, options: PlanOptions = QUICK) -> CannotAssemble:
    found = plan(source(folder, parts), options)
    assert isinstance(found, CannotAssemble)
    return found


def direction(found: Planned, label: str) -> tuple[int, int, int]:
    """The way along which the first operation with a unit takes it out."""
    for join in found.operations:
        if label in join.come:
            return join.direction
        if label in join.pile:
            x, y, z = join.direction
            return -x, -y, -z
    raise AssertionError(label)


def together(found: Planned, *labels: str) -> int:
    """The number of the first operation after which some units are joined."""
    for number, join in enumerate(found.operations):
        if {*labels} <= {*join.pile, *join.come}:
            return number
    raise AssertionError(labels)


def test_nested_boxes_are_filled_before_they_are_closed(tmp_path: Path) -> None:
    found = planned(tmp_path, NEST)
    whole = [{*join.pile, *join.come} for join in found.operations]
    assert not any({"outer", "lid"} <= made and "inner" not in made for made in whole)
    assert not any({"inner", "inner_lid"} <= made and "cube" not in made for made in whole)
    assert direction(found, "cube") == (0, 0, 1)


def test_a_peg_is_put_into_a_hole_from_below_by_lowering_the_hole(tmp_path: Path) -> None:
    found = planned(tmp_path, PEG)
    assert direction(found, "cap") == (0, 0, 1)
    assert found.figures.robots == 3


@pytest.mark.parametrize("parts", [PEG, NEST, LOADED, dovetail(stops=(30,))])
def test_there_is_room_on_every_way(tmp_path: Path, parts: Parts) -> None:
    """Nothing is drawn into another, so a way without room would be the wrong one."""
    found = planned(tmp_path, parts)
    assert all(join.clearance > -TOLERANCE for join in found.operations)


def test_a_dovetail_slides_along_its_groove_only(tmp_path: Path) -> None:
    found = planned(tmp_path, dovetail())
    assert [abs(x) for x in direction(found, "tail")] == [1, 0, 0]
    assert found.operations[0].clearance == pytest.approx(1e-4 / 1.25**0.5)


def test_a_dovetail_with_one_stop_slides_from_the_other_end(tmp_path: Path) -> None:
    found = planned(tmp_path, dovetail(stops=(30,)))
    assert direction(found, "tail") == (-1, 0, 0)


def test_a_dovetail_that_was_drawn_in_is_still_a_dovetail(tmp_path: Path) -> None:
    found = planned(tmp_path, dovetail(gap=-0.1))
    assert [abs(x) for x in direction(found, "tail")] == [1, 0, 0]
    assert found.operations[0].clearance < 0


@pytest.mark.parametrize("gap", [0.2, -0.1])
def test_a_dovetail_with_two_stops_cannot_be_joined(tmp_path: Path, gap: float) -> None:
    found = refused(tmp_path, dovetail(gap, (30, -30)))
    assert [set(one.labels) for one in found.interlocks] == [{"socket", "tail"}]
    assert found.removal.smallest and len(found.removal.labels) == 1


def test_a_burr_of_three_cannot_be_joined_though_any_two_can(tmp_path: Path) -> None:
    found = refused(tmp_path, pinwheel())
    (core,) = found.interlocks
    assert core.labels == ("a", "b", "c")
    assert {way for way, _ in core.circuits} == {(n, s) for n in range(3) for s in (1, -1)}
    assert found.removal.smallest and len(found.removal.labels) == 1
    for pair in ("ab", "bc", "ca"):
        planned(tmp_path, {label: pinwheel()[label] for label in pair})


def test_a_burr_without_its_last_pin_can_be_joined(tmp_path: Path) -> None:
    planned(tmp_path, pinwheel(closed=False))


def test_a_chain_of_closed_links_is_freed_by_the_middle_one(tmp_path: Path) -> None:
    found = refused(tmp_path, CHAIN)
    assert [one.labels for one in found.interlocks] == [("one", "two", "three")]
    assert found.removal.labels == ("two",) and found.removal.smallest
    allowed = PlanOptions(lay_out=False, allow=found.removal.labels)
    best = plan(source(tmp_path, CHAIN), allowed)
    assert isinstance(best, Planned) and best.figures.blocked == 2


def test_clashes_that_are_allowed_make_a_chain_possible(tmp_path: Path) -> None:
    allowed = PlanOptions(lay_out=False, allow=("two",))
    found = plan(source(tmp_path, CHAIN), allowed)
    assert isinstance(found, Planned)
    assert sum(join.blocked for join in found.operations) >= 1
    with pytest.raises(InputError, match=r"there is no part or kept sub-assembly 'tow'"):
        plan(source(tmp_path, CHAIN), PlanOptions(lay_out=False, allow=("tow",)))


def test_hooks_come_apart(tmp_path: Path) -> None:
    found = planned(tmp_path, HOOKS)
    assert direction(found, "one") == (1, 0, 0)


def test_mirrored_twins_come_from_opposite_sides(tmp_path: Path) -> None:
    found = planned(tmp_path, TWINS)
    ways = [direction(found, label) for label in ("left", "right")]
    assert ways[0][0] <= 0 <= ways[1][0] and ways[0][0] < ways[1][0]


def test_what_is_in_the_way_later_counts(tmp_path: Path) -> None:
    """The bolt leaves its guide on the first step, but its way out ends at a wall."""
    found = planned(tmp_path, FAR_WALL, replace(QUICK, screws=None))
    join = found.operations[together(found, "bolt", "guide")]
    assert not {"east", "west"} <= {*join.pile, *join.come}


def test_what_does_not_touch_is_not_joined_first(tmp_path: Path) -> None:
    found = planned(tmp_path, BRIDGE)
    assert together(found, "north", "south") == len(found.operations) - 1


def test_parts_that_were_drawn_in_do_not_interlock(tmp_path: Path) -> None:
    found = planned(tmp_path, DRAWN_IN)
    assert direction(found, "tray") == (0, 0, -1)


def test_tongues_and_grooves_that_open_one_way_need_no_relay(tmp_path: Path) -> None:
    """They come along x: without a relay two at a time, if x is upright. As drawn, one relay."""
    found = planned(tmp_path, PLANKS, replace(QUICK, up=(0, +1)))
    assert found.figures.relays == 0
    assert found.orientation[2] == pytest.approx((1, 0, 0))
    assert planned(tmp_path, PLANKS).figures.relays == 1
    assert all(abs(join.direction[0]) == 1 for join in found.operations)


def test_a_tube_is_loaded_from_its_open_end(tmp_path: Path) -> None:
    found = planned(tmp_path, LOADED)
    assert direction(found, "tube") == (0, 0, -1)


def test_few_robots_are_asked_for(tmp_path: Path) -> None:
    quick = planned(tmp_path, LOADED)
    few = planned(tmp_path, LOADED, PlanOptions(aim="robots", lay_out=False))
    assert few.figures.robots < quick.figures.robots
    assert few.figures.expected >= quick.figures.expected


@dataclass(frozen=True)
class Answer:
    """What is known of the same puzzle laid out."""

    parts: Parts
    robots: int


ANSWERS: Mapping[str, Answer] = {"peg": Answer(PEG, 3), "nest": Answer(NEST, 0)}


@pytest.mark.parametrize("name", ANSWERS)
def test_what_the_planner_calls_free_check_calls_free(tmp_path: Path, name: str) -> None:
    found = plan(source(tmp_path, ANSWERS[name].parts), PlanOptions(seconds=5))
    assert isinstance(found, Planned) and found.project is not None
    matings = found.project.matings
    assert matings is not None and not matings.of_kind("blocked")
    assert found.figures.cycle is not None and found.figures.cycle > 0
