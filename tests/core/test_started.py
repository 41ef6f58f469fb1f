"""A run as it starts: where parts are, which ends are seen, how long it lasts."""

from __future__ import annotations

from time import sleep

from factory.engine.mjcf.weld_frames import gaps
from factory.engine.record.subject import MonitorSubject
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
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


def test_the_time_of_who_looks_on_is_none_of_the_run() -> None:
    simulation = Simulation(paper_layout(), RunRequest("ideal", units=1))
    looked = list[float]()

    def look(_: object) -> None:
        if len(looked) < 3:
            looked.append(0.1)
            sleep(0.1)

    hooks = simulation.world.hooks
    hooks.state = lambda at_end: simulation.state()
    hooks.ended.append(look)
    hooks.ticks.append(hooks.tell_ended)
    assert simulation.run().wall_time_s < sum(looked)
