"""Hands from geometry: they touch what they hold, and go through nothing on any way."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import factory
from factory.apps.fidelity.hidden import HiddenPenetrations
from factory.apps.runs.watched import watched
from factory.engine.mjcf import names
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.clearance import certify
from factory.floor.layout.exclusions import awaited_positions, coordinated
from factory.floor.layout.hands.bores import bores
from factory.floor.layout.hands.choosing import Hands
from factory.floor.layout.hands.holding import held
from factory.floor.layout.hands.limbs import limbs
from factory.floor.layout.hands.reach import AIR
from factory.floor.layout.hands.surfaces import Surfaces, hit, retreat, swept
from factory.floor.layout.layout import Layout
from factory.pipeline import read
from tests.paths import EXAMPLES

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
    "name",
    [
        "paper",
        "lamp",
        "stool",
        pytest.param("truck", marks=pytest.mark.slow),
        pytest.param("chair", marks=pytest.mark.slow),
        pytest.param("balanced", marks=pytest.mark.slow),
    ],
)
def test_what_holds_touches_and_goes_through_nothing(name: str) -> None:
    simulation, hidden = looked_at(with_hands(name))
    figures = simulation.physical.figures()
    assert simulation.world.delivered() == 3
    assert figures.unintended_contacts == 0
    assert figures.grip_gap_max_mm is not None and figures.grip_gap_max_mm < GRIP_MM
    assert hidden.deepest() < AT_MOST_MM


def test_a_large_ball_is_held_at_its_surface(tmp_path: Path) -> None:
    """What collides is round; its polytope, 0.5 % further out, is not what pads are put to."""
    file = tmp_path / "balls.pag"
    file.write_text(
        "root = two; two = mate(one, other);"
        "one = atomic(sphere = 0.2); other = atomic(sphere = 0.2, pos = (0.45, 0, 0))"
    )
    simulation, hidden = looked_at(factory.lay_out(factory.compile(factory.load_pag(file))), 1)
    figures = simulation.physical.figures()
    assert figures.grip_gap_max_mm is not None and 0.0 < figures.grip_gap_max_mm < GRIP_MM
    assert hidden.deepest() < AT_MOST_MM


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_hand_moved_by_2_mm_is_seen(axis: int) -> None:
    layout = with_hands("lamp")
    robot, hand = next(
        (r, h) for r, h in enumerate(layout.hands) if h is not None and h.kind == "behind"
    )
    x, y, z = np.array(hand.places[0]) + 2e-3 * np.eye(3)[axis]
    moved = replace(hand, places=((float(x), float(y), float(z)),))
    hands = tuple(moved if r == robot else h for r, h in enumerate(layout.hands))
    simulation, hidden = looked_at(replace(layout, hands=hands), units=1)
    heading = np.array([*layout.guidepaths[robot].heading, 0.0])
    if abs(heading[axis]) < 0.5:
        return  # along the face it still touches
    gap = simulation.physical.figures().grip_gap_max_mm
    assert gap is not None
    assert gap > GRIP_MM or hidden.deepest() > AT_MOST_MM


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


def test_pads_are_off_the_surface_by_the_air_between() -> None:
    for name in ("paper", "lamp", "stool", "shelf"):
        layout = with_hands(name)
        surfaces = Surfaces(layout.product)
        for robot, hand in enumerate(layout.hands):
            if hand is None or hand.kind != "below":
                continue
            label = held(layout.factory, robot)
            parts = layout.factory.contents[label]
            first = -surfaces.outermost(parts, np.array(hand.places), (2, -1))
            reach = hand.radius * 0.25
            assert np.all(first - np.array(hand.places)[:, 2] <= reach + 1e-9)
            pads = [limb for limb in limbs(layout, robot) if limb.name.endswith("pad")]
            assert len(pads) == len(hand.places)
            up = layout.visits[layout.factory.robots[robot].operations[0], robot].elevation
            low = layout.product.low[2] - 0.1 - up
            tops = sorted(limb.high[2] + low for limb in pads)
            assert np.allclose(tops, sorted(z - AIR for _, _, z in hand.places), atol=1e-6)


def test_layouts_with_hands_are_certified() -> None:
    for name in ("paper", "lamp", "stool", "shelf", "chest"):
        layout = with_hands(name)
        assert certify(layout).holds
        hands = {region.robot for region in layout.certificate.regions if region.kind == 9}
        assert hands == {r for r, hand in enumerate(layout.hands) if hand is not None}


def test_those_that_wait_for_a_hand_wait_for_one_that_leaves() -> None:
    layout = with_hands("truck")
    orders = coordinated(layout).orders
    waited = {order.past.axis for order in orders if order.past is not None}
    assert waited
    for axis in waited:
        assert axis < len(layout.factory.axes)


def test_hands_of_carriers_depend_on_their_heading_alone() -> None:
    layout = with_hands("truck")
    hands = Hands(layout.factory, layout.product)
    for robot, path in enumerate(layout.guidepaths[1:], start=1):
        t = layout.guidepaths[hands.holding.on[robot]].heading
        back = -t[0], -t[1]
        if hands.holding.is_carrier(robot):
            assert hands.hand(robot, path.heading, t) == hands.hand(robot, path.heading, back)


def test_boxes_are_swept_and_hit() -> None:
    low, high = np.array([[0.0, 0.0, 0.0]]), np.array([[1.0, 1.0, 1.0]])
    box = np.array([[[3.0, 0.2, 0.2], [4.0, 0.8, 0.8]]])
    assert not hit(low, high, box)[0]
    assert hit(*swept(low, high, (1.0, 0.0)), box)[0]
    assert not hit(*swept(low, high, (-1.0, 0.0)), box)[0]
    aside = box + np.array([-3.5, 5.0, 0.0])
    assert not hit(*swept(low, high, (1.0, 0.0)), aside)[0]
    assert retreat(low, high, aside, ((1.0, 0.0), (0.0, 1.0)))[0] == pytest.approx(0.5)
    assert retreat(low, high, aside, ((-1.0, 0.0), (0.0, 1.0)))[0] == pytest.approx(1.5)
    assert retreat(low, high, aside, ((1.0, 0.0), (0.0, -1.0)))[0] == 0.0


def test_a_hand_is_drawn_of_limbs_that_collide() -> None:
    simulation = Simulation(with_hands("lamp"), RunRequest(units=1))
    m = simulation.physical.m
    drawn = [m.geom(i) for i in range(m.ngeom) if names.pad_of(m.geom(i).name).startswith("r")]
    assert len(drawn) == sum(hand is not None for hand in with_hands("lamp").hands)
    assert all(int(geom.contype[0]) and int(geom.conaffinity[0]) for geom in drawn)


def test_bores_are_where_pins_hold() -> None:
    layout = with_hands("truck")
    found = list(bores(layout))
    pinned = {
        r.name for r in layout.factory.robots if (h := layout.hand(r.index)) and h.tip == "pin"
    }
    assert found and {bore.robot for bore in found} == pinned
    boxes = Surfaces(layout.product)
    for bore in found:
        around = boxes.boxes(layout.factory.contents[bore.label])
        near = (around[:, 0] - 1e-3 <= bore.at) & (around[:, 1] + 1e-3 >= bore.at)
        assert near.all(axis=1).any() and 0 < bore.diameter <= 0.02
    assert not list(bores(replace(layout, hands=())))


def test_robots_do_not_go_back_from_home_to_where_they_would_wait() -> None:
    """A robot begins at its B end: it has not yet delivered what its hand has to go back from."""
    layout = with_hands("gearbox")
    awaited = awaited_positions(layout)
    short = {r for r, at in awaited.items() if at < layout.guidepaths[r].length - 0.01}
    made = Simulation(layout, RunRequest(units=1))
    assert short and all(made.world.sense()[0][robot] > awaited[robot] for robot in short)
    for _ in range(3):
        assert not made.supervisor.active.ahead
        made.supervisor.step()


def test_however_deep_a_product_is_its_hands_are_found(tmp_path: Path) -> None:
    """Each robot brings what it made to the next: none is looked for inside another."""
    deep, pitch = 150, 0.06
    rows: list[str] = []
    for n in range(deep):
        joined = f"insert ( p{n}, s{n - 1} )" if n > 1 else "insert ( p1, p0 )"
        rows += [f"s{n} = {joined}"] if n else []
        rows.append(f"p{n} = atomic ( box = (0.05, 0.05, 0.02), pos = ({n * pitch}, 0, 0.01) )")
    file = tmp_path / "deep.pag"
    file.write_text(f"root = s{deep - 1}; " + "; ".join(rows))
    project = read(file)
    hands = Hands(project.plain, project.product)
    deepest = len(project.plain.robots) - 1
    u, t = next(hands.holding.frames(deepest))
    assert hands.hand(deepest, u, t) is not None
