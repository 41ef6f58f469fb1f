"""What a template says is done about a failure is done: `again`, `scrap`, `stop`, of the tests that
look at robots and feeders."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from factory.apps.deviations import Campaign, Deviation
from factory.apps.recovery import Recovery, recover
from factory.engine.record.state import State
from factory.engine.simulation.request import RunRequest, WorldName
from factory.engine.simulation.run import Run
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.layout import Layout
from factory.pipeline import read
from tests.paths import PAPER, ROOT

WORLDS = "ideal", "mujoco"

STEPS = """root = s2; s1 = insert ( base, a ); s2 = insert ( s1, b );
base = atomic ( box = ( 0.16, 0.1, 0.02 ), pos = ( 0, 0, 0.01 ) );
a = atomic ( box = ( 0.03, 0.03, 0.02 ), pos = ( -0.04, 0, 0.03 ) );
b = atomic ( box = ( 0.03, 0.03, 0.03 ), pos = ( 0.04, 0, 0.035 ) )"""
"""Two robots with lifts put parts of two heights onto a base."""


@pytest.fixture
def steps(tmp_path: Path) -> Layout:
    """Their layout."""
    (tmp_path / "steps.pag").write_text(STEPS)
    return read(tmp_path / "steps.pag").layout


def laid_out(folder: Path, template: str, failure: str) -> Layout:
    """The paper's example with another `failure` in one of its templates."""
    text = (ROOT / "templates" / f"{template}.op").read_text("utf-8")
    begin = text.index("failure = ")
    text = text[:begin] + f"failure = {{ {failure} }};" + text[text.index(";", begin) + 1 :]
    (folder / f"{template}.op").write_text(text, "utf-8")
    return read(PAPER, [folder]).layout


def stopped(
    layout: Layout,
    world: WorldName,
    *faults: Deviation,
    spares: int = 0,
    late: int = 8,
    label: str = "sub1",
) -> tuple[Run, Recovery]:
    """A run in which faults strike robots in the second operation of a `label`, so many ticks
    `late`: when they are on their way."""
    simulation = Simulation(layout, RunRequest(world, 4, recovers=True))
    recovery = recover(simulation, Campaign(clear=1.0, spares=spares, swap=2.0))
    number, struck = layout.factory.by_label[label], list[float]()

    def strike(state: State) -> None:
        supervisor = simulation.supervisor
        if supervisor.fired[number.start] == 2 and number.index in supervisor.active.operations:
            struck.append(state.time)
            if len(struck) == late:
                for fault in faults:
                    recovery.strike(fault)

    return simulation.run([strike], 200.0), recovery


STANDS = Deviation("down", robot="r5", at=0.0, seconds=12.0)
"""For longer than a robot that is not dead may be late."""


def test_a_robot_whose_lift_still_waits_has_left(steps: Layout) -> None:
    """One of its axes on its way is enough: it is stuck, and not dead."""
    run, recovery = stopped(steps, "ideal", replace(STANDS, robot="r2"), label="s2")
    assert (run.products, run.trouble) == (4, None)
    assert [(one.robot, one.response) for one in recovery.found] == [("", "again")]


@pytest.mark.parametrize("world", WORLDS)
@pytest.mark.parametrize(
    ("responses", "units", "made"),
    [
        ("scrap", (2, 2, 3), 4),
        ("stop", (2,), 1),
        ("again 1 then stop", (2, 3), 4),
        ("again 1 then stop", (2, 2), 1),
    ],
)
def test_what_lies_askew_stops_the_run_where_the_template_says_so(
    tmp_path: Path, world: WorldName, responses: str, units: tuple[int, ...], made: int
) -> None:
    """Failures on end count, and what is good ends them."""
    layout = laid_out(tmp_path, "atomic", f"misplaced > 2e-3 : {responses}, lost : scrap")
    faults = tuple(Deviation("misplaced", label="part1", unit=unit) for unit in units)
    simulation = Simulation(layout, RunRequest(world, 4, recovers=True))
    recovery = recover(simulation, Campaign(faults, clear=1.0))
    run = simulation.run(max_time=200.0)
    if made == 4:
        assert (run.products, run.trouble) == (4, None)
        assert [one.test for one in recovery.found] == ["misplaced"] * len(units)
    else:
        assert run.products <= made and run.trouble is not None
        assert run.trouble.message == "'part1' fails the test 'misplaced'"
        *before, last = recovery.found
        assert (last.response, last.done) == ("stop", "the run ends")
        assert [one.response for one in before] == ["scrap"] * (len(units) - 1)
        report = recovery.report()
        assert (report.missed, report.false_alarms) == (0, 0)


@pytest.mark.parametrize("name", ["mate", "insert", "weld", "press", "glue"])
def test_shipped_templates_that_join_test_for_what_is_stuck(name: str) -> None:
    text = (ROOT / "templates" / f"{name}.op").read_text("utf-8")
    assert "jammed : again 2 then scrap" in text
