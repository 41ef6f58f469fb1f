"""Staging: what waits empty-handed goes ahead; the net is the same, the pace is the predicted one,
and nothing comes near what it should not."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from factory.apps.analyze import Timing
from factory.apps.analyze.timed import timed_net
from factory.apps.monitor import beside
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.engine.timing.timing import Change
from factory.floor.layout.bounds import cycle_time_bound
from factory.floor.layout.durations import Pace
from factory.floor.layout.layout import Layout
from factory.support.settings import Settings
from tests.examples import without_hands
from tests.layout_values import STYLES, random_layout
from tests.pag_values import SHAPES
from tests.paths import PAPER

STAGED, STILL = Settings(stage=1), Settings()


def laid_out(file: Path) -> Layout:
    return without_hands(file.stem)


@pytest.fixture(scope="module")
def paper() -> Layout:
    return laid_out(PAPER)


def test_the_bound_is_one_for_staged_robots(paper: Layout) -> None:
    """The paper's example comes near it, as it does without."""
    for chosen in (STILL, STAGED):
        pace = Pace.of(chosen)
        cycle = max(pace.gear_times(paper))
        bound = cycle_time_bound(paper.factory, paper.product, paper.clearance, pace)
        assert cycle - 0.02 < bound <= cycle


def test_ways_in_the_timed_net(paper: Layout) -> None:
    """As many robots are on a way as wait beside it, and no operation ends before they have come
    that set out at the beginning."""
    timing = Timing(paper, STAGED)
    net = timed_net(timing, Change(copies={2: 3}))
    assert {key[0]: net.net.tokens[place] for key, place in net.ways.items()} == {0: 1, 2: 3}
    assert set(net.ready) == set(net.ways.values())
    late = replace(net)
    vars(late)["ready"] = dict.fromkeys(net.ready, 50.0)
    for _, number in net.ways:
        end = timing.factory.operations[number].end
        assert net.firings(1)[0, end] < 50.0 <= late.firings(1)[0, end]


@pytest.mark.slow
@pytest.mark.parametrize("number", range(40))
def test_random_factories_in_mujoco(number: int) -> None:
    """At jitter 0.3, every third of them distributed, half of them fused, under the monitor's
    eyes."""
    shape, style = SHAPES[number % len(SHAPES)], STYLES[number % len(STYLES)]
    layout = random_layout(4 + number % 9, number, shape, style)
    made = Simulation(
        layout,
        RunRequest(
            "mujoco",
            units=3,
            seed=number,
            jitter=0.3,
            settings=STAGED,
            distributed=number % 3 == 0,
            fuse=number % 2 == 0,
        ),
    )
    watcher = beside(made)
    record = made.run([watcher.observe])
    assert record.trouble is None and record.refines_net
    assert watcher.report().refines_net and not watcher.report().violations
    assert record.physics is not None and record.physics.unintended_contacts == 0
    assert record.physics.handoff_gap_max_mm < 0.1
