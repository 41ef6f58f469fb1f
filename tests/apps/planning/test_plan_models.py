"""Products with known answers, and an audit of every way that is accepted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from manifold3d import Manifold

from factory.apps.planning.plan import CannotAssemble, Planned, PlannedJoin, PlanOptions, plan
from tests.plan_models import MODELS, Model, model_source
from tests.plan_puzzles import Box, Parts, block, dovetail, ring, source, tub

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


def test_a_dovetail_that_was_drawn_in_is_still_a_dovetail(tmp_path: Path) -> None:
    found = planned(tmp_path, dovetail(gap=-0.1))
    assert [abs(x) for x in direction(found, "tail")] == [1, 0, 0]
    assert found.operations[0].clearance < 0


def test_what_is_in_the_way_later_counts(tmp_path: Path) -> None:
    """The bolt leaves its guide on the first step, but its way out ends at a wall."""
    found = planned(tmp_path, FAR_WALL, replace(QUICK, screws=None))
    join = found.operations[together(found, "bolt", "guide")]
    assert not {"east", "west"} <= {*join.pile, *join.come}


def test_tongues_and_grooves_that_open_one_way_need_no_relay(tmp_path: Path) -> None:
    """They come along x: without a relay two at a time, if x is upright. As drawn, one relay."""
    found = planned(tmp_path, PLANKS, replace(QUICK, up=(0, +1)))
    assert found.figures.relays == 0
    assert found.orientation[2] == pytest.approx((1, 0, 0))
    assert planned(tmp_path, PLANKS).figures.relays == 1
    assert all(abs(join.direction[0]) == 1 for join in found.operations)


@dataclass(frozen=True)
class Answer:
    """What is known of the same puzzle laid out."""

    parts: Parts
    robots: int


ANSWERS: Mapping[str, Answer] = {"nest": Answer(NEST, 0)}


@pytest.mark.parametrize("name", ANSWERS)
def test_what_the_planner_calls_free_check_calls_free(tmp_path: Path, name: str) -> None:
    found = plan(source(tmp_path, ANSWERS[name].parts), PlanOptions(seconds=5))
    assert isinstance(found, Planned) and found.project is not None
    matings = found.project.matings
    assert matings is not None and not matings.of_kind("blocked")
    assert found.figures.cycle is not None and found.figures.cycle > 0
