"""Hands from geometry: they touch what they hold, and go through nothing on any way."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import pytest

import factory
from factory.apps.fidelity.hidden import HiddenPenetrations
from factory.apps.runs.watched import watched
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.layout import Layout
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
