"""One hand for all labels of a line: each is held in its own place about the robot."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest

import factory
from factory.apps.few_robots.sharing import with_lines
from factory.apps.fidelity.hidden import HiddenPenetrations
from factory.apps.runs.watched import watched
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.run import Run
from factory.engine.simulation.simulation import Simulation
from factory.floor.geometry.solids import Product
from factory.floor.layout import hanging
from factory.floor.layout.clearance import certify
from factory.floor.layout.embedding import lay_out
from factory.floor.layout.feeding import feeder_of
from factory.floor.layout.hands import holding
from factory.floor.layout.hands.hand import Hand
from factory.floor.layout.hands.limbs import limbs
from factory.floor.layout.hands.places import Places
from factory.floor.layout.hands.places import places as found_places
from factory.floor.layout.hands.reach import AIR
from factory.floor.layout.hanging import Hanging
from factory.floor.layout.layout import Layout
from factory.pipeline import Project, read
from tests.drawn_products import drawn_product
from tests.layout_values import with_visits
from tests.random_products import random_product

AT_MOST_MM = 0.1

PRODUCTS = {
    "paper": (
        """root = sub3; sub3 = insert ( sub2, part3 ); sub2 = weld ( sub1 );
sub1 = insert ( part1, part2 ); part1 = atomic(); part2 = atomic(); part3 = atomic()""",
        ("part2", "part3"),
    ),
    "blocks": (
        """root = s3; s1 = insert ( base, w1 ); s2 = insert ( s1, w2 ); s3 = insert ( s2, w3 );
base = atomic ( box = ( 0.2, 0.04, 0.02 ), pos = ( 0, 0, 0.01 ) );
w1 = atomic ( box = ( 0.02, 0.02, 0.02 ), pos = ( -0.06, 0.03, 0.01 ) );
w2 = atomic ( box = ( 0.02, 0.03, 0.02 ), pos = ( 0, 0.035, 0.01 ) );
w3 = atomic ( box = ( 0.02, 0.02, 0.02 ), pos = ( 0.06, 0.03, 0.01 ) )""",
        ("w1", "w2", "w3"),
    ),
    "steps": (
        """root = s2; s1 = insert ( base, low ); s2 = insert ( s1, tall );
base = atomic ( box = ( 0.1, 0.04, 0.02 ), pos = ( 0, 0, 0.01 ) );
tall = atomic ( box = ( 0.02, 0.02, 0.04 ), pos = ( -0.03, 0.03, 0.02 ) );
low = atomic ( box = ( 0.02, 0.02, 0.02 ), pos = ( 0.03, 0.03, 0.01 ) )""",
        ("low", "tall"),
    ),
    "shelf": (
        """root = s3; s1 = insert ( post, w1 ); s2 = insert ( s1, w2 ); s3 = insert ( s2, w3 );
post = atomic ( box = ( 0.06, 0.04, 0.12 ), pos = ( 0, 0, 0.06 ) );
w1 = atomic ( box = ( 0.02, 0.02, 0.02 ), pos = ( 0, 0.03, 0.02 ) );
w2 = atomic ( box = ( 0.03, 0.03, 0.02 ), pos = ( 0, 0.035, 0.06 ) );
w3 = atomic ( box = ( 0.02, 0.02, 0.02 ), pos = ( 0.01, 0.03, 0.1 ) )""",
        ("w1", "w2", "w3"),
    ),
    "tub": (
        """root = s2; s1 = insert ( tub, a ); s2 = insert ( s1, b );
tub = mate ( base, walls ); walls = mate ( left, right, front, back );
base = atomic ( box = ( 0.1, 0.1, 0.01 ), pos = ( 0, 0, 0.005 ) );
left = atomic ( box = ( 0.01, 0.1, 0.03 ), pos = ( -0.045, 0, 0.025 ) );
right = atomic ( box = ( 0.01, 0.1, 0.03 ), pos = ( 0.045, 0, 0.025 ) );
front = atomic ( box = ( 0.08, 0.01, 0.03 ), pos = ( 0, -0.045, 0.025 ) );
back = atomic ( box = ( 0.08, 0.01, 0.03 ), pos = ( 0, 0.045, 0.025 ) );
a = atomic ( box = ( 0.04, 0.04, 0.01 ), pos = ( -0.01, 0, 0.015 ) );
b = atomic ( box = ( 0.03, 0.03, 0.01 ), pos = ( 0.01, 0, 0.025 ) )""",
        ("a", "b"),
    ),
    "ladder": (
        """root = s2; s1 = insert ( post, w1 ); s2 = insert ( s1, w2 );
post = atomic ( box = ( 0.06, 0.04, 0.22 ), pos = ( 0, 0, 0.11 ) );
w1 = atomic ( box = ( 0.02, 0.02, 0.02 ), pos = ( 0, 0.03, 0.02 ) );
w2 = atomic ( box = ( 0.02, 0.02, 0.02 ), pos = ( 0, 0.03, 0.2 ) )""",
        ("w1", "w2"),
    ),
    "two kinds": (
        """root = s2; s1 = insert ( base, low ); s2 = insert ( s1, ball );
base = atomic ( box = ( 0.1, 0.04, 0.06 ), pos = ( 0, 0, 0.03 ) );
low = atomic ( box = ( 0.02, 0.02, 0.02 ), pos = ( 0.03, 0.03, 0.01 ) );
ball = atomic ( sphere = 0.002, pos = ( -0.03, 0.022, 0.05 ), mass = 500 )""",
        ("low", "ball"),
    ),
}
"""Products and the labels that share a robot: boxes at one height, of two heights, several heights
beside a post,
things that are lowered, and one that no hand can hold."""


@cache
def project(name: str, shared: bool = True) -> Project:
    """A product with or without a line."""
    return planned(*PRODUCTS[name], shared)


def planned(text: str, line: tuple[str, ...], shared: bool = True) -> Project:
    """A product with or without a line."""
    with TemporaryDirectory() as folder:
        file = Path(folder) / "product.pag"
        file.write_text(text)
        found = read(file)
        found = with_lines(found, [line]) if shared else found
        assert found.layout
        return found


def of_line(layout: Layout) -> tuple[int, Hand]:
    """The robot with several tours, and its hand."""
    (robot,) = (r for r, tours in enumerate(layout.factory.tours) if layout.magazine(r)[1:])
    hand = layout.hand(robot)
    assert hand is not None
    return robot, hand


def run_of(layout: Layout, distributed: bool = False, seed: int = 1) -> Run:
    """A run with a monitor beside it."""
    asked = RunRequest(units=4, jitter=0.3, seed=seed, distributed=distributed)
    return watched(Simulation(layout, asked), max_time=90.0)


def looked_into(layout: Layout, distributed: bool = False) -> tuple[Run, HiddenPenetrations]:
    """A run with a monitor beside it, and what was inside what."""
    asked = RunRequest(units=4, jitter=0.3, seed=1, distributed=distributed)
    simulation = Simulation(layout, asked)
    hidden = HiddenPenetrations.of(simulation)
    look = [lambda state: hidden.look(state.observation.qpos, state.time)]
    return watched(simulation, look, 90.0), hidden


@pytest.mark.parametrize(
    ("name", "kind", "lift"),
    [
        ("paper", "behind", None),
        ("blocks", "below", None),
        ("shelf", "behind", 0.08),
        ("tub", "above", 0.06),
    ],
)
def test_one_hand_holds_all_labels_of_a_line(name: str, kind: str, lift: float | None) -> None:
    layout = project(name).layout
    robot, hand = of_line(layout)
    assert hand.kind == kind
    assert layout.rise(robot) == (0.0 if lift is None else pytest.approx(lift))
    assert certify(layout).holds
    factory, product = layout.factory, layout.product
    pad = next(limb for limb in limbs(layout, robot) if limb.name == "pad")
    ends = [np.array(pad.low), np.array(pad.high)]
    path = layout.guidepaths[robot]
    for tour in factory.tours[robot]:
        (part,) = factory.contents[factory.operations[tour[0]].label]
        visit = layout.visits[tour[0], robot]
        (x, y), (u, v) = path.carriage(path.length), path.heading
        middle, shift = path.middle(path.length), visit.shift
        solid = product.solids[part]
        over = 0.1 + visit.elevation - product.low[2]
        off = np.array([middle[0] + shift[0], middle[1] + shift[1], over])
        off[:2] -= product.middle[:2]
        low, high = solid.low + off, solid.high + off
        tip = [
            np.array([x + a * u - b * v, y + a * v + b * u, c + visit.up * pad.lifted])
            for a, b, c in ends
        ]
        apart = np.maximum(low - np.maximum(*tip), np.minimum(*tip) - high)
        assert apart.max() == pytest.approx(AIR, abs=2e-6), f"{name}: {part}"


@pytest.mark.parametrize(
    ("name", "distributed"),
    [("paper", True), ("steps", False), ("shelf", False), ("tub", True)],
)
def test_it_makes_units_and_touches_nothing_else(name: str, distributed: bool) -> None:
    run, hidden = looked_into(project(name).layout, distributed)
    assert run.succeeded and run.refines_net, run.trouble
    assert run.physics is not None and run.physics.unintended_contacts == 0
    assert run.physics.grip_gap_max_mm is not None and run.physics.grip_gap_max_mm < 0.5
    assert hidden.deepest() < AT_MOST_MM, hidden.found()


def test_sliders_in_each_others_way_are_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hanging, "common_places", lambda *_: [])
    run, hidden = looked_into(replace(project("paper").layout))  # hangs as is not known yet
    assert run.succeeded
    assert {p.geoms for p in hidden.found() if p.depth_mm > AT_MOST_MM} == {
        ("feeder/part2/pad", "feeder/part3/pad"),
        ("feeder/part2/pad", "feeder/part3/rod"),
        ("feeder/part2/rod", "feeder/part3/pad"),
        ("feeder/part2/rod", "feeder/part3/rod"),
    }


@pytest.mark.parametrize("name", ["paper", "blocks", "steps", "shelf", "tub"])
def test_a_line_with_a_place_on_all_parts_has_one_slider(name: str) -> None:
    layout = project(name).layout
    found = Hanging.of(layout)
    shown = layout.magazine(of_line(layout)[0])
    assert {found.slider[label] for label in shown} == {shown[0]}
    feet = {label: found.raised[label] + feeder_of(layout, label).stroke for label in shown}
    assert max(feet.values()) - min(feet.values()) < 1e-9, "it goes up to one height"
    assert {round(up, 9) for up in found.raised.values()} >= ({0.02} if name == "steps" else {0.0})


def test_parts_apart_hang_from_sliders_apart() -> None:
    """In a draft without hands parts are beside each other in the housing, as in the product."""
    text = """root = s2; s1 = insert ( base, a ); s2 = insert ( s1, b );
base = atomic ( box = ( 0.1, 0.1, 0.02 ), pos = ( 0, 0, 0.01 ) );
a = atomic ( box = ( 0.02, 0.02, 0.02 ), pos = ( -0.04, 0.06, 0.01 ) );
b = atomic ( box = ( 0.02, 0.02, 0.03 ), pos = ( 0.04, 0.06, 0.015 ) )"""
    made = planned(text, ("a", "b"))
    layout = lay_out(made.plain, made.product)
    found = Hanging.of(layout)
    assert dict(found.slider) == {"base": "base", "a": "a", "b": "b"}
    run, hidden = looked_into(layout)
    assert run.succeeded
    inside = [p for p in hidden.found() if any(g.startswith("feeder/") for g in p.geoms)]
    assert not inside


def test_a_lift_is_set_at_home_where_its_hand_would_meet_what_waits() -> None:
    """Part a is put onto a slab, b beside it: the pad is over the slab when it has let go of a, and
    comes down to where b is."""
    text = """root = s2; s1 = insert ( base, a ); s2 = insert ( s1, b );
base = atomic ( box = ( 0.1, 0.1, 0.02 ), pos = ( 0, 0, 0.01 ) );
a = atomic ( box = ( 0.02, 0.02, 0.02 ), pos = ( 0, 0.02, 0.0302 ) );
b = atomic ( box = ( 0.02, 0.02, 0.02 ), pos = ( 0, 0.0602, 0.01 ) )"""
    layout = planned(text, ("a", "b")).layout
    assert layout.factory.adjusted == {1} and layout.certificate is not None
    (order,) = layout.certificate.apart.orders
    assert order.before.startswith("past:r2:") and order.start == "b_s"
    run = run_of(layout)
    assert run.succeeded, run.verdict.failures
    assert run.physics is not None and run.physics.unintended_contacts == 0


def test_places_of_hands_are_found_once_for_all_plans(monkeypatch: pytest.MonkeyPatch) -> None:
    looked = list[tuple[object, ...]]()

    def places(product: Product, *of: Any) -> Places:
        looked.append(of)
        return found_places(product, *of)

    monkeypatch.setattr(holding, "places", places)
    shared = with_lines(planned(*PRODUCTS["shelf"], shared=False), [PRODUCTS["shelf"][1]])
    visits = shared.layout.visits
    assert looked and len(looked) == len({*looked})
    assert visits == planned(*PRODUCTS["shelf"]).layout.visits, "whatever was looked at before"


def test_the_carrier_stands_where_each_label_comes() -> None:
    layout = project("blocks").layout
    robot, _ = of_line(layout)
    factory, stops = layout.factory, []
    for tour in factory.tours[robot]:
        last = factory.operations[tour[-1]]
        short, further = layout.stop_offset(last.index, last.robots.index(robot))
        assert short >= 0, "it never comes nearer to its carrier's line than its path ends"
        stops.append(round(layout.station(last.index) + further, 6))
    assert len(set(stops)) == 1, "all are told from one station"
    assert len({layout.station(tour[-1]) for tour in factory.tours[robot]}) == 3


def test_the_magazine_shows_each_part_where_the_hand_takes_it() -> None:
    layout = project("blocks").layout
    robot, _ = of_line(layout)
    housings = {feeder_of(layout, part).housing for part in layout.magazine(robot)}
    assert len(housings) == 1
    xlo, xhi, ylo, yhi = housings.pop()
    wide, deep = sorted((round(xhi - xlo, 6), round(yhi - ylo, 6)))
    assert wide < 0.04 and deep < 0.05, "hardly larger than one block, though they lie 120 mm apart"


def test_nothing_is_shifted_where_no_robot_has_several_tours() -> None:
    layout = project("shelf", shared=False).layout
    assert {visit.shift for visit in layout.visits.values()} == {(0.0, 0.0)}
    assert not layout.factory.adjusted
    (robot,) = project("shelf").layout.factory.adjusted
    assert project("shelf").factory.robots[robot].type == "lift"


def test_what_no_hand_of_a_line_can_hold_is_said() -> None:
    found = project("two kinds")
    assert of_line(found.layout)[1].kind == "none"
    (told,) = (warning for warning in found.warnings if warning.code == "NoGrip")
    assert told.message == "no hand can hold 'ball'"
    assert "; so r2 has no hand for 'low' either; " in told.hint


def test_a_tower_is_not_over_pads_that_have_yet_to_rise() -> None:
    found = project("ladder")
    assert of_line(found.layout)[1].kind == "none" and not found.layout.factory.adjusted
    (told,) = (warning for warning in found.warnings if warning.code == "NoGrip")
    assert told.message == "no one hand can hold all that r2 brings, 'w1' and 'w2'"
    assert "behind it can hold each, but not in one place of the hand" in told.hint


def moved(layout: Layout, by: tuple[float, float, float]) -> Layout:
    """A layout in which a robot holds the second label of its line elsewhere than it was found."""
    robot, _ = of_line(layout)
    return with_visits(layout, shifts={(robot, 1): by})


@pytest.mark.parametrize("by", [(0.002, 0.0, 0.0), (0.0, 0.0, -0.002)])
def test_a_label_that_is_held_2_mm_off_fails_the_run(by: tuple[float, float, float]) -> None:
    layout = project("shelf").layout if by[0] else project("tub").layout
    run = run_of(moved(layout, by))
    assert not run.succeeded
    codes = {failure.code for failure in run.verdict.failures}
    assert "GripGap" in codes, codes


def test_a_hand_over_2_mm_off_fails_certificate_and_run(monkeypatch: pytest.MonkeyPatch) -> None:
    layout = project("shelf").layout
    robot, _ = of_line(layout)
    known: Callable[..., tuple[float, float]] = Layout.stop_offset
    second = layout.factory.tours[robot][1][-1], robot

    def late(self: Layout, operation: int, slot: int) -> tuple[float, float]:
        short, further = known(self, operation, slot)
        return short + 0.002 * (operation == second[0]), further

    monkeypatch.setattr(Layout, "stop_offset", late)
    visit = layout.visits[second]
    visits = {**layout.visits, second: replace(visit, at=visit.at + 0.002)}
    changed = replace(layout, visits=visits, certificate=None)
    (fault, *_) = certify(changed).faults
    assert "2.0 mm from its place" in fault.message
    run = run_of(changed)
    assert not run.succeeded
    assert "HandOffGap" in {failure.code for failure in run.verdict.failures}


@pytest.mark.parametrize(("seed", "units"), [(50, 4), (291152039, 10), (291152024, 5)])
def test_a_magazine_and_its_robot_are_as_fast_as_predicted(
    seed: int, units: int, tmp_path: Path
) -> None:
    """The next part begins to come down in the tick in which the last slider is up (50), and in
    that in which the robot is out of its way (291152039); and a lift rises no further than its next
    tour takes it (291152024): a run takes the time of its critical circuit."""
    file = tmp_path / "product.pag"
    file.write_text(random_product(seed))
    run = factory.run(factory.compile(file, robots="least"), units=units)
    assert run.cycle_time_s == pytest.approx(run.predicted_cycle_time_s, abs=1e-6)


@pytest.mark.parametrize("seed", [291310082, 291310098])
def test_a_robot_sets_out_when_its_next_operation_may_start(seed: int, tmp_path: Path) -> None:
    """Its lift rises first, and is 1 mm below its end then: another robot waits until it is past
    a point."""
    run = factory.run(factory.compile(drawn_product(seed).write(tmp_path)), units=16)
    assert run.cycle_time_s == pytest.approx(run.predicted_cycle_time_s, abs=0.01)
