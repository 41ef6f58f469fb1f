"""A run as it starts: where parts are, which ends are seen, how long it lasts."""

from __future__ import annotations

import pytest

from factory.engine.mjcf.weld_frames import gaps
from factory.engine.record.subject import MonitorSubject
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.engine.timing.timing import Change, Timing
from factory.film.history import History
from factory.support.settings import Settings
from tests.good_runs import random_marking
from tests.layout_values import paper_layout


def test_parts_are_in_the_hands_that_hold_them_at_the_start() -> None:
    layout = paper_layout()
    simulation = Simulation(layout, RunRequest(units=1, start=random_marking(layout, 0)))
    world = simulation.physical
    (on,) = world.d.eq_active.nonzero()
    assert len(on) and gaps(world.m, on, world.d.xpos, world.d.xmat).max() < 1e-6


def test_the_end_of_an_operation_is_seen_where_a_part_changes_hands() -> None:
    layout = paper_layout()
    moves = MonitorSubject.of(layout, Settings()).moves_parts
    seen = {o.label for o in layout.factory.operations if moves[o.index]}
    assert seen == {"part1", "part2", "part3", "sub1", "sub3", "dropoff"}


def test_the_time_of_who_looks_on_is_none_of_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    """By a clock that goes on only while somebody looks on."""
    simulation = Simulation(paper_layout(), RunRequest("ideal", units=1))
    looked = list[object]()
    for module in ("simulation", "world"):
        clock = f"factory.engine.simulation.{module}.perf_counter"
        monkeypatch.setattr(clock, lambda: float(len(looked)))
    hooks = simulation.world.hooks
    hooks.state = lambda at_end: simulation.state()
    hooks.ended.append(looked.append)
    hooks.ticks.append(hooks.tell_ended)
    assert simulation.run().wall_time_s == 0.0 and looked


def test_of_an_operation_that_fires_it_is_counted_how_often() -> None:
    history = History(MonitorSubject.of(paper_layout(), Settings()))
    for time, event in ((0.1, 2), (0.2, 3), (0.3, 2)):
        history.fire(time, event)
    assert (history.fired[2], history.fired[3], history.fired.total()) == (2, 1, 3)


def test_a_faster_robot_is_faster_on_all_its_axes_alone() -> None:
    timing = Timing(paper_layout(), Settings())
    plain, change = timing._limits([0, 1], [0, 1], Change()), Change(speed={1: 1.5})
    assert timing._limits([0, 1], [0, 1], change).speed == pytest.approx(plain.speed * [1.0, 1.5])
    assert (timing._limits([0], [0], change).speed == plain.speed[:1]).all()


def test_one_unit_is_made_unless_more_are_asked_for() -> None:
    assert RunRequest().units == 1
