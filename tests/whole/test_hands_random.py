"""Hands on random products: they hold, and meet nothing."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from factory.apps.few_robots.aim import Aim
from factory.apps.few_robots.search import allocated
from factory.apps.fidelity.hidden import HiddenPenetrations
from factory.apps.runs.watched import watched
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.certificate import fault
from factory.floor.layout.embedding import certified
from factory.pipeline import Project, read
from factory.support.errors import RunError
from factory.support.settings import LEAST
from tests.random_products import random_blocks, random_product

AT_MOST_MM, GRIP_MM = 0.1, 0.5
"""How deep anything that is drawn may be in anything, and how far a grip may be."""


def project_of(text: str, folder: Path) -> Project:
    """The project of a text."""
    file = folder / "product.pag"
    file.write_text(text)
    return read(file)


def succeeds(project: Project, seed: int, units: int, jitter: float) -> None:
    """A run of a project succeeds, with everything made solid, too."""
    request = RunRequest(units=units, seed=seed, jitter=jitter)
    simulation = Simulation(project.layout, request)
    hidden = HiddenPenetrations.of(simulation)
    look = [lambda state: hidden.look(state.observation.qpos, state.time)]
    run = watched(simulation, look, 600.0)
    assert run.succeeded, run.verdict.failures
    assert run.physics is not None
    assert (run.physics.grip_gap_max_mm or 0.0) < GRIP_MM
    assert (run.physics.grip_strength_share_max or 0.0) < 1
    deep = hidden.found()
    assert max((p.depth_mm for p in deep), default=0.0) < AT_MOST_MM, deep


def test_a_missing_hand_is_the_reason_why_robots_meet(tmp_path: Path) -> None:
    text = """
    root = c; c = mate ( a, s ); a = atomic ( box = ( 0.05, 0.05, 0.05 ), pos = ( 0, 0, 0.025 ) );
    s = atomic ( sphere = 0.0006, pos = ( 0.0256, 0, 0.025 ) );
    """
    layout = project_of(text, tmp_path).layout
    (bare,) = (n for n, hand in enumerate(layout.hands) if hand and hand.kind == "none")
    assert layout.certificate is not None
    for robots, code in (((0, bare), "NoGrip"), ((0, 1), "Layout")):
        met = fault(layout.factory, "they meet", *robots)
        with pytest.raises(RunError, match=code):
            certified(layout, None, replace(layout.certificate, faults=(met,)))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100, 160))
def test_hands_hold_and_meet_nothing(seed: int, tmp_path: Path) -> None:
    text = random_blocks(seed) if seed % 4 == 0 else random_product(seed)
    succeeds(project_of(text, tmp_path), seed, 3 - 2 * (seed // 2 % 2), 0.3 * (seed % 2))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(200, 220))
def test_hands_of_few_robots_meet_nothing(seed: int, tmp_path: Path) -> None:
    project = allocated(project_of(random_blocks(seed), tmp_path), Aim(LEAST, effort=12))
    succeeds(project, seed, 3, 0.3 * (seed % 2))


@pytest.mark.slow
def test_a_tool_may_be_farther_than_its_goal_when_an_operation_begins(tmp_path: Path) -> None:
    """On its way home from the one before, for which it stopped later: factories with it that the
    search looks at were refused as NotPrepared, and with them the product."""
    project = project_of(random_product(2611330026), tmp_path)
    succeeds(allocated(project, Aim(LEAST, effort=12)), 2611330026, 2, 0.3)
