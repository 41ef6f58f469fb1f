"""Products with known answers, and an audit of every way that is accepted."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from manifold3d import Manifold

from factory.apps.planning.plan import CannotAssemble, Planned, PlannedJoin, PlanOptions, plan
from tests.plan_models import MODELS, Model, model_source

QUICK = PlanOptions(lay_out=False)

STEPS = 200
"""So many places of a way are audited."""

CAN = [name for name, model in MODELS.items() if not model.stuck]
CANNOT = [name for name, model in MODELS.items() if model.stuck]


@pytest.fixture(autouse=True)
def no_decomposition(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ways are the same without CoACD, which takes most of the time."""
    monkeypatch.setattr("factory.floor.geometry.decomposition.release", lambda package: "")


@pytest.mark.parametrize("name", CAN)
def test_parts_leave_along_the_ways_that_are_open(name: str, tmp_path: Path) -> None:
    model = MODELS[name]
    found = plan(model_source(tmp_path, model.parts), QUICK)
    assert isinstance(found, Planned)
    for label, way in (model.ways or {}).items():
        assert leaving(found, label) == pytest.approx(way, abs=1e-6), label
    for label, way in (model.both or {}).items():
        assert np.abs(leaving(found, label)) == pytest.approx(np.abs(way), abs=1e-6), label
    worst = max(cuts(model, join) for join in found.operations)
    assert worst <= (1e-6 if name != "press fit" else finished(model) + 1e-6)


@pytest.mark.parametrize("name", CANNOT)
def test_what_cannot_be_joined_is_refused(name: str, tmp_path: Path) -> None:
    model = MODELS[name]
    found = plan(model_source(tmp_path, model.parts), QUICK)
    assert isinstance(found, CannotAssemble)
    (lock,) = found.interlocks
    assert set(lock.labels) == model.stuck
    (clash,) = lock.clashes
    assert {clash.one, clash.other} == model.stuck and clash.depth > 0
    allowed = PlanOptions(lay_out=False, allow=(f"{clash.other}:{clash.one}",))
    best = plan(model_source(tmp_path, model.parts), allowed)
    assert isinstance(best, Planned) and best.figures.blocked == 1


def leaving(found: Planned, label: str) -> tuple[float, ...]:
    """The way along which the first operation with a part takes it out."""
    for join in found.operations:
        if label in join.come:
            return tuple(join.direction)
        if label in join.pile:
            return tuple(-x for x in join.direction)
    raise AssertionError(label)


def cuts(model: Model, join: PlannedJoin) -> float:
    """The greatest volume [mm³] that those that come have in common with the pile on their way, by
    snapshots: what found the way took none."""
    come = Manifold.compose([model.parts[label] for label in join.come])
    pile = Manifold.compose([model.parts[label] for label in join.pile])
    far = 2.1 * max(abs(value) for value in (*come.bounding_box(), *pile.bounding_box()))
    return max(
        (come.translate(tuple(far * step / STEPS * np.array(join.direction))) ^ pile).volume()
        for step in range(STEPS)
    )


def finished(model: Model) -> float:
    """The volume [mm³] that two parts have in common in the finished product."""
    one, other = model.parts.values()
    return float((one ^ other).volume())
