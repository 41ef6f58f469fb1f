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
from factory.apps.fidelity.hidden import HiddenPenetrations
from factory.apps.runs.watched import watched
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.hands.in_the_way import IN_THE_WAY
from factory.floor.layout.hands.misses import THERE, NoGrip
from factory.floor.layout.layout import Layout
from factory.pipeline import read
from tests.paths import EXAMPLES, ROOT

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
