"""Runs in which things go wrong, and go on: each kind of fault, what no test looks for, what cannot
be helped, what a planted fault changes, and files of faults."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any

import pytest

from factory.apps.deviations import Campaign, Deviation
from factory.apps.recovery import Recovery, recover
from factory.apps.recovery.mujoco.plant import MujocoPlant, Senses
from factory.apps.recovery.standing import MotionHold
from factory.commands.summaries import say_failures
from factory.engine.record.failures import Failures
from factory.engine.record.state import State
from factory.engine.simulation.compiled import Compiled
from factory.engine.simulation.request import RunRequest, WorldName
from factory.engine.simulation.run import Run
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.layout import Layout
from factory.pipeline import read
from factory.support.errors import InputError
from factory.theory.nets.undone import Undone
from factory.theory.problem.template import Failure
from tests.command_line import Terminal
from tests.examples import with_hands
from tests.good_runs import assert_good
from tests.paths import PAPER, ROOT
from tests.simulation_values import layout_of
from tests.slow import slow_but

WORLDS = "mujoco", "ideal"
UNITS = 3

CAMPAIGN = Campaign()


@cache
def ready(name: str, asked: RunRequest) -> Any:
    """What runs share."""
    return Compiled.of(layout_of(name), asked)


def run_with(
    *faults: Deviation,
    world: Any = "mujoco",
    layout: Layout | None = None,
    units: int = UNITS,
    campaign: Campaign = CAMPAIGN,
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


EACH: dict[str, tuple[Deviation, str, str]] = {
    "drop": (Deviation("drop", label="sub2", unit=2), "lost", "scrap"),
    "askew": (Deviation("misplaced", label="part2", unit=1, metres=4e-3), "misplaced", "scrap"),
    "flipped": (Deviation("misplaced", label="part2", unit=1, degrees=180), "misplaced", "scrap"),
    "bad_part": (Deviation("bad_part", label="part1", unit=2), "rejected", "scrap"),
    "no_part": (Deviation("no_part", label="part3", unit=2), "", ""),
    "bad_joint": (Deviation("bad_joint", label="sub1", unit=2), "residual", "again"),
    "blackout": (Deviation("blackout", at=3.0), "", ""),
    "down": (Deviation("down", robot="r2", unit=2), "", ""),
    "dead": (Deviation("dead", robot="r3", unit=2), "jammed", "spare"),
}
"""A fault, the test that finds it, and what is done; "" for faults that are waited out. A robot
that dies on its way is to go back first."""


@pytest.mark.parametrize(
    ("name", "world"),
    slow_but([("drop", "mujoco"), *product(EACH, ["ideal"])], product(EACH, WORLDS)),
)
def test_each_kind_of_fault(name: str, world: str) -> None:
    fault, test, response = EACH[name]
    spare = Campaign(spares=1, swap=2.0)
    run, failures = run_with(fault, world=world, campaign=spare, jitter=0.3)
    assert_recovered(run, failures, {fault.kind: 1})
    found = [(one.test, one.response) for one in failures.found]
    assert found == [("jammed", "again")] * (name == "dead") + [(test, response)] * bool(test)
    assert failures.spares == (name == "dead")
    undone = [event for event in run.events if isinstance(event, Undone)]
    assert failures.undone == sum(len(one.transitions) for one in undone)
    if fault.kind in ("drop", "bad_joint"):
        assert failures.undone and undone[0].reason == test
    if not test:  # what lasts for 5 s is waited for
        assert not undone
        assert run.sim_time_s > run_with(world=world, jitter=0.3)[0].sim_time_s + 0.5


def test_what_comes_after_a_part_that_lies_askew_hangs_straight() -> None:
    """However many lie askew at once: the next ones touch no housing."""
    layout = with_hands("truck")
    leaves = layout.factory.leaves
    faults = tuple(Deviation("misplaced", label=leaf.label, unit=1) for leaf in leaves)
    run, failures = run_with(*faults, layout=layout, units=1)
    assert_recovered(run, failures, {"misplaced": len(leaves)})


OFFS = ({"metres": 1.5e-3},)


@pytest.mark.parametrize("off", OFFS)
def test_what_no_camera_finds_no_verdict_condemns(off: dict[str, Any]) -> None:
    """Cameras and verdict have one set of limits: 1.5 mm or 2° passed, and failed the run."""
    run, failures = run_with(Deviation("misplaced", label="part1", unit=1, **off), units=1)
    assert run.succeeded, run.verdict.failures
    assert failures.missed == len(failures.unseen) == 1 - len(failures.found)


def test_a_fault_that_no_sensor_finds_is_named_first(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Senses, "is_askew", lambda *_: False)
    fault = Deviation("misplaced", label="part1", unit=1, degrees=2.0)
    run, failures = run_with(fault, units=1)
    run = replace(run, failures=failures)
    first, *others = run.verdict.failures
    assert first.code == "Unseen" and "misplaced 'part1' of unit 1" in first.message
    assert others and not run.succeeded


def with_failures(name: str, *failures: Failure) -> Layout:
    """The layout of the paper's example, whose operations of a template fail otherwise."""
    layout = layout_of("paper")
    made = layout.factory
    operations = tuple(
        replace(o, template=replace(o.template, failures=failures))
        if o.template.name == name
        else o
        for o in made.operations
    )
    return replace(layout, factory=replace(made, operations=operations))


@pytest.mark.parametrize("world", WORLDS)
def test_what_no_test_looks_for_is_not_seen(world: Any) -> None:
    """A joint 3 mm off, in a template without a test of its residual."""
    fault = Deviation("bad_joint", label="sub1", unit=2, metres=3e-3)
    test = layout_of("paper").factory.by_label["sub1"].template.failures[0].test
    assert test == "residual"
    run, failures = run_with(fault, world=world, layout=with_failures("mate"))
    assert (failures.found, failures.missed, failures.false_alarms) == ((), 1, 0)
    assert run.products == UNITS and run.replays
    if run.physics is not None:
        assert run.physics.joining_error_max_mm > 1
        assert not run.succeeded


@pytest.mark.parametrize("world", slow_but(["ideal"], WORLDS))
def test_a_dead_robot_without_a_spare(world: Any) -> None:
    """What can be finished without it is, and then the run says which it was."""
    dead = Deviation("dead", robot="r6", unit=3)
    assert layout_of("paper").factory.robots[5].name == "r6"
    run, failures = run_with(dead, world=world, units=6)
    assert run.trouble is not None and run.trouble.code == "Failed"
    assert run.trouble.message == "r6 is dead, and there is no spare"
    assert [one.response for one in failures.found] == ["no spare"]
    assert run.products == 2 and run.replays and not run.succeeded


def test_robots_with_programs_of_their_own_do_not_recover() -> None:
    simulation = Simulation(layout_of("paper"), RunRequest("ideal", 1, distributed=True))
    with pytest.raises(InputError, match="do not recover"):
        recover(simulation)


BLIND: dict[str, tuple[type, str, Any, str]] = {
    "drop": (MujocoPlant, "lost", lambda plant: (), "jammed"),
    "bad_joint": (MujocoPlant, "residual", lambda plant, operation: 0.0, ""),
    "dead": (MotionHold, "jammed", lambda standing, now, excused: [], ""),
    "askew": (Senses, "is_askew", lambda *_: False, ""),
}
"""A sense that is taken from the factory, and what is found in place of that; "" for nothing."""


@pytest.mark.parametrize("name", slow_but(["askew"], BLIND))
def test_blind_sensors_never_succeed_unnoticed(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each fault is missed, and counted as such, or the run stalls."""
    where, method, blind, instead = BLIND[name]
    fault = EACH[name][0]
    monkeypatch.setattr(where, method, blind)
    run, failures = run_with(fault, campaign=Campaign(spares=1), max_time=100)
    assert {one.test for one in failures.found} <= {instead}
    stalled = run.trouble is not None and run.trouble.code == "Stalled"
    assert stalled if name == "dead" else failures.missed == 1


WRONG: dict[str, tuple[str, str, str]] = {
    "true for a number": ("clear = true", "BadValue", "clear must be a number"),
    "sensors are no table": ("sensors = 3", "BadValue", "sensors must be a table"),
    "a list of numbers": ("fault = [3]", "BadFault", "a fault is a table"),
    "no kind": ("[[fault]]\nunit = 1", "BadFault", "this fault has no 'kind'"),
    "no time": ("[[fault]]\nkind = 'blackout'", "BadFault", "one of 'unit', 'at' and 'rate'"),
    "no share": ("[[fault]]\nkind = 'drop'\nrate = 1.5", "BadFault", "a share from 0 to 1"),
    "no label": ("[[fault]]\nkind = 'drop'\nunit = 1", "BadFault", "'drop' needs a 'label'"),
    "a time for what always holds": (
        "[[fault]]\nkind = 'mass'\nfactor = 2.0\nat = 1.0",
        "BadFault",
        "'mass' takes no 'at'",
    ),
    "nothing joined": (
        "[[fault]]\nkind = 'bad_joint'\nlabel = 'sub2'\nunit = 1",
        "BadFault",
        "'sub2', which is none of the joined labels",
    ),
    "broken": ("[[fault", "Syntax", ""),
}
"""A file, the code of the error, and words of it. UNIT is a fault that is well described."""

WELL = "[[fault]]\nkind = 'drop'\nunit = 1"


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_with_a_file(name: str, run: Terminal, tmp_path: Path) -> None:
    text, code, words = WRONG[name]
    if "label" not in text:
        text = text.replace("UNIT", f"{WELL}\nlabel = 'sub1'")
    file = tmp_path / "faults.toml"
    file.write_bytes(text.replace("UNIT", WELL).encode("latin-1"))
    done = run("run", PAPER, "--world", "ideal", "--faults", file, "--json")
    assert done.status != 0 and done.codes == [code]
    error = done.json["errors"][0]
    assert words in error["message"], error
    assert error["hint"]


def test_all_that_is_wrong_is_said_at_once_and_where(run: Terminal, tmp_path: Path) -> None:
    (tmp_path / "f.toml").write_text("sed = 1\n[[fault]]\nkind = 'dorp'\nunit = 1\n")
    done = run("run", PAPER, "--faults", tmp_path / "f.toml", "--json")
    assert done.codes == ["UnknownParameter", "BadFault"]
    assert [error["line"] for error in done.json["errors"]] == [1, 3]
    assert "drop" in done.json["errors"][1]["hint"]


SLIPS = tuple(Deviation("bad_joint", label="sub1", unit=2, metres=2e-3) for _ in range(3))
"""Done again twice, then the inputs are scrapped."""


def test_scrap_falls_into_its_bin() -> None:
    run, failures = run_with(*SLIPS, jitter=0.3)
    assert_recovered(run, failures, {"bad_joint": 3})
    assert failures.found[-1].scrapped == ("part1", "part2")
    assert (failures.binned, failures.spilled) == (2, ())


@pytest.mark.parametrize(("spilled", "words"), [((), "scrap in bins: 3\n")])
def test_bins_are_told_in_words(
    capsys: pytest.CaptureFixture[str], spilled: tuple[str, ...], words: str
) -> None:
    say_failures(replace(Failures(), binned=3, spilled=spilled), False)
    assert words in "".join(capsys.readouterr())


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


@pytest.mark.parametrize("world", slow_but(["ideal"], WORLDS))
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
