"""What a template says is done about a failure is done: `again`, `scrap`, `stop`, of the tests that
look at robots and feeders."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from factory.apps.deviations import Campaign, Deviation
from factory.apps.recovery import Recovery, recover
from factory.apps.recovery.recovery import summed
from factory.engine.record.failures import Failing
from factory.engine.record.state import State
from factory.engine.simulation.mujoco.feeders import Feeders
from factory.engine.simulation.request import RunRequest, WorldName
from factory.engine.simulation.run import Run
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.layout import Layout
from factory.pipeline import read
from factory.theory.nets.undone import Undone
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


@pytest.mark.parametrize("world", WORLDS)
@pytest.mark.parametrize(
    ("responses", "response", "undone"),
    [
        ("again 1 then stop", "again", {"sub1_s"}),
        ("scrap", "scrap", {"sub1_s", "part1_s", "part1_e", "part2_s", "part2_e"}),
    ],
)
def test_what_is_stuck_is_done_again_or_scrapped(
    tmp_path: Path, world: WorldName, responses: str, response: str, undone: set[str]
) -> None:
    """The robot moves again while it is to go back, so it is not taken for dead."""
    layout = laid_out(tmp_path, "mate", f"jammed : {responses}, lost : scrap")
    run, recovery = stopped(layout, world, STANDS)
    assert (run.products, run.trouble, run.refines_net) == (4, None, True)
    (one,) = recovery.found
    assert (one.test, one.operation, one.robot, one.response) == ("jammed", "sub1", "", response)
    assert str(one).startswith("sub1 is jammed: ") and not one.is_death
    (entry,) = (e for e in run.events if isinstance(e, Undone))
    assert {*entry.transitions} >= undone
    report = recovery.report()
    assert (report.missed, report.false_alarms, report.spares) == (0, 0, 0)
    assert run.physics is None or run.physics.unintended_contacts == 0


@pytest.mark.parametrize("world", WORLDS)
def test_robots_that_are_stuck_together_fail_once(tmp_path: Path, world: WorldName) -> None:
    """One failure for both: none is taken for dead as it is to go back already."""
    layout = laid_out(tmp_path, "mate", "jammed : again 1 then stop, lost : scrap")
    run, recovery = stopped(layout, world, STANDS, replace(STANDS, robot="r6"))
    assert (run.products, run.trouble) == (4, None)
    assert [(one.robot, one.response) for one in recovery.found] == [("", "again")]
    assert {robots for _, robots in recovery.stood} >= {("r5", "r6")}


def test_a_robot_whose_lift_still_waits_has_left(steps: Layout) -> None:
    """One of its axes on its way is enough: it is stuck, and not dead."""
    run, recovery = stopped(steps, "ideal", replace(STANDS, robot="r2"), label="s2")
    assert (run.products, run.trouble) == (4, None)
    assert [(one.robot, one.response) for one in recovery.found] == [("", "again")]


def test_who_does_not_test_for_it_takes_the_robot_for_dead(tmp_path: Path) -> None:
    layout = laid_out(tmp_path, "mate", "lost : scrap")
    run, recovery = stopped(layout, "ideal", STANDS)
    assert run.trouble is not None and "r5 is dead, and there is no spare" in run.trouble.message
    assert [one.is_death for one in recovery.found] == [True]


@pytest.mark.parametrize(
    ("world", "late", "found"),
    [("ideal", 8, ["", "r5"]), ("mujoco", 8, ["", "r5"]), ("mujoco", 1, ["r5"])],
)
def test_a_robot_that_does_not_go_back_is_dead(
    tmp_path: Path, world: WorldName, late: int, found: list[str]
) -> None:
    """One that had not begun to move is taken for dead at once: going back would tell nothing."""
    layout = laid_out(tmp_path, "mate", "jammed : again 2 then scrap, lost : scrap")
    dead = Deviation("dead", robot="r5", at=0.0)
    run, recovery = stopped(layout, world, dead, spares=1, late=late)
    assert (run.products, run.trouble, run.refines_net) == (4, None, True)
    assert [(one.test, one.robot) for one in recovery.found] == [("jammed", r) for r in found]
    report = recovery.report()
    assert (report.missed, report.false_alarms, report.spares) == (0, 0, 1)


@pytest.mark.parametrize("responses", ["stop", "again 1"])
def test_the_run_stops_where_the_template_says_so(tmp_path: Path, responses: str) -> None:
    layout = laid_out(tmp_path, "mate", f"jammed : {responses}, lost : scrap")
    long = Deviation("down", robot="r5", at=0.0, seconds=500.0 if responses == "stop" else 12.0)
    run, recovery = stopped(layout, "ideal", long)
    if responses == "stop":
        assert [str(one) for one in recovery.found] == ["sub1 is jammed: the run ends"]
        assert run.trouble is not None and run.trouble.code == "Failed"
        assert run.trouble.message == "'sub1' fails the test 'jammed'"
        assert run.trouble.position is not None, "it says where"
    else:
        assert run.trouble is None and recovery.found[0].response == "again"


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


def test_an_input_that_slipped_may_be_found_as_it_jams() -> None:
    """Nothing was missed where the operation was stuck, and nothing was a false alarm."""
    stuck = Failing(3.0, "jammed", "sub1", "", "again")
    for struck, found, counts in (
        ({"bad_joint": 1}, [stuck], (0, 0)),
        ({"bad_joint": 2}, [stuck], (1, 0)),
        ({}, [stuck], (0, 0)),
        ({"dead": 1}, [stuck, Failing(9.0, "jammed", "sub1", "r5", "spare")], (0, 0)),
        ({}, [Failing(9.0, "jammed", "sub1", "r5", "spare")], (0, 1)),
    ):
        report = summed(found, struck, 0, 0, 0, ())
        assert (report.missed, report.false_alarms) == counts


def test_a_robot_that_dies_where_it_went_ahead(steps: Layout) -> None:
    """No operation waits for it that is under way: it is late all the same, and replaced."""
    simulation = Simulation(steps, RunRequest("mujoco", 6, recovers=True))
    recovery = recover(simulation, Campaign(spares=1, swap=4.0))

    def strike(_: State) -> None:
        world = simulation.physical
        if not recovery.found and world.parts.holdings.hand(2) and world.sense()[0][4] < 0.01:
            recovery.strike(Deviation("dead", robot="r3", at=0.0))

    run = simulation.run([strike], max_time=60.0)
    assert (run.products, run.trouble, run.refines_net) == (6, None, True)
    assert run.physics is not None and not run.physics.unintended_contacts
    assert [(one.robot, one.response) for one in recovery.found] == [("r3", "spare")]


def test_a_part_that_comes_late_waits_for_its_robot(monkeypatch: pytest.MonkeyPatch) -> None:
    """The last product is lost when feeders have nothing to show any more, and a robot whose hand
    holds from above has gone where its next part would come down: it makes way. Planted: it does
    not."""
    layout = read(ROOT / "examples" / "truck.pag").layout
    robot = layout.factory.by_label["roof"].carrier
    lift = layout.factory.up(robot)
    assert lift is not None
    for is_kept in (True, False):
        if not is_kept:
            monkeypatch.setattr(Feeders, "_obstructed", lambda feeders: [])
        simulation = Simulation(layout, RunRequest("mujoco", 1, recovers=True))
        recovery = recover(simulation, Campaign())

        def lose(_: State, made: Simulation = simulation, by: Recovery = recovery) -> None:
            if not by.found and made.supervisor.fired[layout.factory.dropoff.start] == 1:
                made.physical.motion.put({robot: 0.144, lift: layout.rise(robot)})
                by.plant.lose(0)

        run = simulation.run([lose], max_time=120.0)
        assert run.products == 1 and {one.test for one in recovery.found} == {"lost"}
        assert run.physics is not None
        assert (run.physics.unintended_contacts == 0) == is_kept
