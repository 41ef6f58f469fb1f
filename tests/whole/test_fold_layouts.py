"""Layouts of folded factories: each is certified, and a robot never comes back under its feeder."""

from __future__ import annotations

import pytest

from factory.apps.few_robots.folding import folded
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.clearance import certify
from factory.floor.layout.durations import Pace
from factory.floor.layout.embedding import lay_out
from factory.floor.layout.exclusions import exclusions
from factory.floor.layout.layout import Layout
from factory.floor.layout.request import Ground
from factory.pipeline import Project, all_templates
from factory.support.settings import Settings
from factory.theory.compiler.folding import kind_of
from factory.theory.problem.robot_types import load_catalogue
from tests.fold_values import fold_layout, table_of
from tests.layout_values import with_visits

WELDED_AGAIN = (
    ("x6", "weld", ("x5",)),
    ("x5", "weld", ("x4",)),
    ("x4", "weld", ("x3",)),
    ("x3", "insert", ("x2", "p1")),
    ("x2", "weld", ("p0",)),
    ("p0", "atomic", ()),
    ("p1", "atomic", ()),
)
"""One tool works before and after something is inserted."""


def welded_again(settings: Settings) -> Layout:
    """The layout of that product with one tool: its robot comes back to it."""
    project = Project(table_of(WELDED_AGAIN), all_templates(), load_catalogue(), settings)
    factory = project.compiled
    tools = tuple(r.index for r in factory.robots if kind_of(factory, r.index)[0] == "tool")
    made = folded(factory, [tools], project.catalogue)
    return lay_out(made, project.product, pace=Pace.of(settings))


def test_a_robot_that_comes_back_to_a_tool_is_clear_of_its_feeder() -> None:
    """It stalled where it met the next part."""
    settings = Settings()
    layout = welded_again(settings)
    run = Simulation(layout, RunRequest(units=2, world="mujoco", settings=settings)).run()
    assert run.products == 2 and run.succeeded
    assert run.physics is not None and not run.physics.unintended_contacts


def test_one_that_comes_back_under_its_feeder_is_refused() -> None:
    layout = welded_again(Settings())
    operations = layout.factory.by_label
    stations = {operations[label].index: 0.0 for label in ("x2", "x4", "x5", "x6")}
    moved = with_visits(layout, stations)
    assert not certify(moved).holds
    messages = [fault.message for fault in exclusions(moved).faults]
    assert any("p0 of r1, in x4, and p0 of magazine of r1" in message for message in messages)


@pytest.mark.parametrize("seed", [42, 139, 179])
def test_folds_are_laid_out(seed: int) -> None:
    """Seed 139: a pile overlapped the housing as it came back to its tool."""
    assert fold_layout(seed, Settings()).certificate is not None


@pytest.mark.parametrize("seed", [30, 51])
def test_folds_are_laid_out_with_hands(seed: int) -> None:
    """The line of a robot with several tours is that of the hand it has."""
    settings = Settings()
    plain = fold_layout(seed, settings)
    assert Ground().lay_out(plain.factory, plain.product, settings).certificate is not None
