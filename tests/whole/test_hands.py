"""Hands from geometry: they touch what they hold, and go through nothing on any way."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from shutil import copytree
from tempfile import TemporaryDirectory

import numpy as np
import pytest

import factory
from factory.apps.few_robots.sharing import with_lines
from factory.apps.fidelity.hidden import HiddenPenetrations
from factory.apps.runs.watched import watched
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.run import Run
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.hands.hand import Hand
from factory.floor.layout.hands.in_the_way import IN_THE_WAY
from factory.floor.layout.hands.misses import THERE, NoGrip
from factory.floor.layout.layout import Layout
from factory.pipeline import Project, read
from tests.layout_values import with_visits
from tests.paths import EXAMPLES, ROOT
from tests.slow import slow_but

AT_MOST_MM = 0.1
"""Nothing that is drawn is deeper in anything."""

GRIP_MM = 0.5
"""A grip closes within this."""


@cache
def with_hands(name: str) -> Layout:
    """An example laid out with hands."""
    plan = factory.compile(factory.load_pag(EXAMPLES / f"{name}.pag"))
    return factory.lay_out(plan)


def looked_at(layout: Layout, units: int = 3) -> tuple[Simulation, HiddenPenetrations]:
    """A run of a layout, with everything solid looked at."""
    simulation = Simulation(layout, RunRequest(units=units, jitter=0.3))
    hidden = HiddenPenetrations.of(simulation)
    simulation.run([lambda state: hidden.look(state.observation.qpos, state.time)], max_time=120.0)
    return simulation, hidden


@pytest.mark.parametrize(
    "name", slow_but(["paper"], ["paper", "lamp", "stool", "truck", "chair", "balanced"])
)
def test_what_holds_touches_and_goes_through_nothing(name: str) -> None:
    simulation, hidden = looked_at(with_hands(name))
    figures = simulation.physical.figures()
    assert simulation.world.delivered() == 3
    assert figures.unintended_contacts == 0
    assert figures.grip_gap_max_mm is not None and figures.grip_gap_max_mm < GRIP_MM
    assert hidden.deepest() < AT_MOST_MM


@pytest.mark.slow
@pytest.mark.parametrize("way", [-2e-3, 2e-3])
def test_a_run_fails_by_the_name_of_what_a_moved_hand_does(way: float) -> None:
    """Each hand of the paper's example in turn: away from what it holds, and into it."""
    layout = with_hands("paper")
    for robot, hand in enumerate(layout.hands):
        if hand is None:
            continue
        moved = replace(hand, places=tuple((x, y, z + way) for x, y, z in hand.places))
        hands = tuple(moved if r == robot else h for r, h in enumerate(layout.hands))
        simulation = Simulation(replace(layout, hands=hands), RunRequest(jitter=0.3, shown=False))
        run = watched(simulation, (), 60.0)
        codes = {failure.code for failure in run.verdict.failures}
        assert codes & ({"GripGap"} if way < 0 else {"Contact", "Dropped"}), (robot, codes)


BOX = """root = r; r = mate ( a, b ); a = mate ( low, left, right, front, rear, lid );
low = atomic ( box = (0.06, 0.06, 0.01), pos = (0, 0, 0.005) );
left = atomic ( box = (0.01, 0.06, 0.03), pos = (-0.025, 0, 0.025) );
right = atomic ( box = (0.01, 0.06, 0.03), pos = (0.025, 0, 0.025) );
front = atomic ( box = (0.0398, 0.01, 0.03), pos = (0, -0.025, 0.025) );
rear = atomic ( box = (0.0398, 0.01, 0.03), pos = (0, 0.025, 0.025) );
lid = atomic ( box = (0.06, 0.06, 0.01), pos = (0, 0, 0.045) );
b = atomic ( box = (0.03, 0.03, 0.02), pos = (0.06, 0, 0.01) )"""
"""Walls that are lowered one after the other, by robots from either side."""


def laid_out(text: str, folder: Path) -> Layout:
    """A product laid out with hands."""
    file = folder / "product.pag"
    file.write_text(text)
    return read(file).layout


def test_hands_from_either_side_wait_for_each_other(tmp_path: Path) -> None:
    asked = RunRequest(units=2, jitter=0.3, seed=1, distributed=False)
    run = watched(Simulation(laid_out(BOX, tmp_path), asked), (), 60.0)
    assert run.succeeded, run.verdict.failures
    assert run.products == 2


GEARBOX = ROOT / "examples" / "gearbox.pag"


def found(file: Path) -> tuple[NoGrip, ...]:
    return read(file).no_grips


@cache
def of_the_gearbox() -> tuple[NoGrip, ...]:
    """Of the gearbox whose shafts have their gears before they are lowered into the tub."""
    text = GEARBOX.read_text()
    for shaft, gear, whole in (("long", "pinion", "input"), ("short", "gear", "output")):
        text = text.replace(f"{shaft}_shaft, {gear},", f"{whole},", 1)
        text += f";\n{whole} = mate ( {shaft}_shaft, {gear} )"
    with TemporaryDirectory() as folder:
        copytree(GEARBOX.with_suffix(""), Path(folder) / "gearbox")
        file = Path(folder) / "gearbox.pag"
        file.write_text(text)
        return found(file)


def test_a_miss_is_met_by_all_that_it_names() -> None:
    grip = next(grip for grip in of_the_gearbox() if grip.label == "output")
    assert {miss.kind for miss in grip.misses} == {"below", "behind", "above"}
    for miss in grip.misses:
        assert miss.at is not None and miss.obstacles
        assert np.abs(miss.tried - miss.at).max(axis=1).min() < 1e-6
        for obstacle in miss.obstacles:
            if not obstacle.part:
                assert obstacle.why in ("weak", "hands", "feeder")
                continue
            low = np.maximum(obstacle.ways[:, 0], obstacle.bodies[:, 0])
            high = np.minimum(obstacle.ways[:, 1], obstacle.bodies[:, 1])
            assert len(low) and (high > low).all()
            assert obstacle.part in (*grip.parts, *grip.beside)


def test_every_obstacle_of_a_hand_has_words() -> None:
    assert {*THERE} == {*IN_THE_WAY}


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


def test_a_label_that_is_held_2_mm_off_fails_the_run() -> None:
    run = run_of(moved(project("shelf").layout, (0.002, 0.0, 0.0)))
    assert not run.succeeded
    codes = {failure.code for failure in run.verdict.failures}
    assert "GripGap" in codes, codes
