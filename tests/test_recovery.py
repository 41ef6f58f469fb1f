"""Runs in which things go wrong, and go on: each kind of fault, what no test looks for, what cannot
be helped, what a planted fault changes, and files of faults."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest

import factory.simulation.recovery.responding as responding
from factory.layout.layout import Layout
from factory.nets.undo import undo
from factory.nets.undone import Undone
from factory.pipeline import read
from factory.plant.factory import Factory
from factory.problem.template import Failure
from factory.simulation.failures import Failures
from factory.simulation.mujoco.failing.plant import MujocoPlant
from factory.simulation.recovery import Campaign, Sensors, WorldFault, recover
from factory.simulation.recovery.faults import KINDS
from factory.simulation.request import RunRequest
from factory.simulation.run import Run
from factory.simulation.simulation import Simulation, compiled
from factory.simulation.world import World
from factory.support.errors import InputError
from factory.support.settings import Settings
from tests.command_line import PAPER, ROOT, Terminal
from tests.good_runs import assert_good
from tests.simulation_values import layout_of

WORLDS = "mujoco", "ideal"
UNITS = 3


@cache
def ready(name: str, asked: RunRequest) -> Any:
    """What runs share."""
    return compiled(layout_of(name), asked)


def run_with(
    *faults: WorldFault,
    world: Any = "mujoco",
    layout: Layout | None = None,
    units: int = UNITS,
    campaign: Campaign = Campaign(),
    max_time: float = 150.0,
    **asked: Any,
) -> tuple[Run, Failures]:
    """A run of the paper's example, or of another layout, in which faults strike."""
    request = RunRequest(world, units, recovers=True, shown=False, **asked)
    shared = ready("paper", request) if layout is None else None
    simulation = Simulation(layout or layout_of("paper"), request, shared)
    recovery = recover(simulation, replace(campaign, faults=faults))
    run = simulation.run(max_time=max_time)
    return run, recovery.report()


def assert_recovered(run: Run, failures: Failures, struck: dict[str, int]) -> None:
    """All units are made as the net says, nothing but what fell was touched, and all that struck
    was found, and nothing else."""
    assert (run.products, run.trouble) == (run.units, None)
    assert dict(failures.struck) == struck
    assert (failures.missed, failures.false_alarms) == (0, 0)
    if run.world == "mujoco":
        assert_good(run)
    assert run.refines_net and run.succeeded


# --- each kind ------------------------------------------------------------------------------------

EACH: dict[str, tuple[WorldFault, str, str]] = {
    "drop": (WorldFault("drop", label="sub2", unit=2), "lost", "scrap"),
    "askew": (WorldFault("misplaced", label="part2", unit=2, metres=4e-3), "misplaced", "scrap"),
    "flipped": (WorldFault("misplaced", label="part2", unit=2, degrees=180), "misplaced", "scrap"),
    "bad_part": (WorldFault("bad_part", label="part1", unit=2), "rejected", "scrap"),
    "no_part": (WorldFault("no_part", label="part3", unit=2), "", ""),
    "bad_joint": (WorldFault("bad_joint", label="sub1", unit=2), "residual", "again"),
    "blackout": (WorldFault("blackout", at=3.0), "", ""),
    "down": (WorldFault("down", robot="r2", unit=2), "", ""),
    "dead": (WorldFault("dead", robot="r3", unit=2), "jammed", "spare"),
}
"""A fault, the test that finds it, and what is done; "" for faults that are waited out."""


def test_every_kind_is_here() -> None:
    assert {fault.kind for fault, *_ in EACH.values()} == KINDS.keys()


@pytest.mark.parametrize("world", WORLDS)
@pytest.mark.parametrize("name", EACH)
def test_each_kind_of_fault(name: str, world: str) -> None:
    fault, test, response = EACH[name]
    spare = Campaign(spares=1, swap=2.0)
    run, failures = run_with(fault, world=world, campaign=spare, jitter=0.3)
    assert_recovered(run, failures, {fault.kind: 1})
    assert [(one.test, one.response) for one in failures.found] == [(test, response)] * bool(test)
    assert failures.spares == (name == "dead")
    undone = [event for event in run.events if isinstance(event, Undone)]
    assert failures.undone == sum(len(one.transitions) for one in undone)
    if fault.kind in ("drop", "bad_joint"):
        assert failures.undone and undone[0].reason == test
    if not test:  # what lasts for 5 s is waited for
        assert not undone
        assert run.sim_time_s > run_with(world=world, jitter=0.3)[0].sim_time_s + 0.5


@pytest.mark.parametrize("world", WORLDS)
def test_an_empty_campaign_changes_nothing(world: Any) -> None:
    """The same events at the same times as a run without recovery."""
    request = RunRequest(world, 6, jitter=0.3)
    plain = Simulation(layout_of("paper"), request).run()
    run, failures = run_with(world=world, units=6, jitter=0.3)
    assert run.events == plain.events and run.dropoffs == plain.dropoffs
    assert failures == Failures()
    simulation = Simulation(layout_of("paper"), request)
    recover(simulation)
    assert simulation.run().events == plain.events
