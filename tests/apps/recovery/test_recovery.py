"""Runs in which things go wrong, and go on: each kind of fault, what no test looks for, what cannot
be helped, what a planted fault changes, and files of faults."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest

import factory.apps.recovery.responding as responding
from factory.apps.deviations import Campaign, Deviation
from factory.apps.deviations.deviation import ASKEW, KINDS, SLIPPED
from factory.apps.few_robots.sharing import with_lines
from factory.apps.recovery import recover
from factory.apps.recovery.mujoco.plant import MujocoPlant, Senses
from factory.apps.recovery.standing import MotionHold
from factory.apps.recovery.undo import undo
from factory.engine.record.failures import Failures
from factory.engine.simulation.compiled import compiled
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.run import Run, entries_of
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.layout import Layout
from factory.pipeline import read
from factory.support.errors import InputError
from factory.theory.nets.replay import replay
from factory.theory.nets.undone import Undone
from factory.theory.plant.factory import Factory
from factory.theory.problem.template import Failure
from tests.command_line import Terminal
from tests.examples import with_hands
from tests.good_runs import assert_good
from tests.paths import PAPER
from tests.simulation_values import layout_of

WORLDS = "mujoco", "ideal"
UNITS = 3

CAMPAIGN = Campaign()


@cache
def ready(name: str, asked: RunRequest) -> Any:
    """What runs share."""
    return compiled(layout_of(name), asked)


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


# --- each kind ------------------------------------------------------------------------------------

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


def test_every_kind_is_here() -> None:
    faults = {kind.name for kind in KINDS.values() if not kind.is_disturbance}
    assert {fault.kind for fault, *_ in EACH.values()} == faults


@pytest.mark.parametrize("world", WORLDS)
@pytest.mark.parametrize("name", EACH)
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


@pytest.mark.parametrize(
    ("fault", "way"),
    [
        (Deviation("misplaced", label="part2", unit=1), ASKEW),
        (Deviation("misplaced", label="part2", unit=1, degrees=180), SLIPPED),
        (Deviation("misplaced", label="part2", unit=1, degrees=180, metres=0.0), 0.0),
        (Deviation("bad_joint", label="sub1", unit=1), SLIPPED),
        (Deviation("bad_joint", label="sub1", unit=1, metres=2e-3), 2e-3),
    ],
)
def test_how_far_a_part_is_off(fault: Deviation, way: float) -> None:
    """As is asked for, or so far that a test finds it; where it is turned that is enough."""
    assert fault.way == way


@pytest.mark.parametrize("world", WORLDS)
def test_an_empty_campaign_changes_nothing(world: Any) -> None:
    """The same events at the same times as a run without recovery."""
    request = RunRequest(world, 4, jitter=0.3)
    plain = Simulation(layout_of("paper"), request).run()
    run, failures = run_with(world=world, units=4, jitter=0.3)
    assert run.events == plain.events and run.dropoffs == plain.dropoffs
    assert failures == Failures()
    simulation = Simulation(layout_of("paper"), request)
    recover(simulation)
    assert simulation.run().events == plain.events


# --- other factories ------------------------------------------------------------------------------


def test_a_truck_with_several_faults() -> None:
    """Tools, further inputs, and three faults one after the other; parts are fused."""
    faults = (
        Deviation("drop", label="cab", unit=1),
        Deviation("bad_part", label="log2", unit=1),
        Deviation("bad_joint", label="axles", unit=1),
    )
    run, failures = run_with(*faults, layout=layout_of("truck"), units=1, fuse=True, jitter=0.2)
    assert_recovered(run, failures, {"drop": 1, "bad_part": 1, "bad_joint": 1})
    assert sorted(one.test for one in failures.found) == ["lost", "rejected", "residual"]


def test_what_comes_after_a_part_that_lies_askew_hangs_straight() -> None:
    """However many lie askew at once: the next ones touch no housing."""
    layout = with_hands("truck")
    leaves = layout.factory.leaves
    faults = tuple(Deviation("misplaced", label=leaf.label, unit=1) for leaf in leaves)
    run, failures = run_with(*faults, layout=layout, units=1)
    assert_recovered(run, failures, {"misplaced": len(leaves)})


SHIFTED, TURNED = {"metres": 5e-3}, {"degrees": 15.0}


@pytest.mark.parametrize(
    ("name", "label", "off"),
    [("stool", "seat", SHIFTED), ("stool", "seat", TURNED), ("shelf", "back", TURNED)],
)
def test_no_robot_dies_of_what_lies_askew(name: str, label: str, off: dict[str, Any]) -> None:
    """A seat below the hand that waits for it as a run begins, and a board wider than its housing
    once it is turned: both go back, and what they touched is counted. What is only shifted touches
    no robot."""
    fault = Deviation("misplaced", label=label, unit=1, **off)
    layout = with_hands(name)
    simulation = Simulation(layout, RunRequest("mujoco", 1, recovers=True, shown=False))
    recovery = recover(simulation, replace(CAMPAIGN, faults=(fault,)))
    run = simulation.run(max_time=60.0)
    assert_recovered(run, recovery.report(), {"misplaced": 1})
    assert [one.test for one in recovery.report().found] == ["misplaced"]
    world = simulation.physical
    touched = [world.m.geom(g).name for pair in world.inspection.pressing.touched for g in pair]
    assert recovery.report().contacts == len(touched) // 2 > 0
    robots = {robot.name for robot in layout.factory.robots}
    if off is SHIFTED:
        assert robots.isdisjoint(name.partition("/")[0] for name in touched)
    elif label == "seat":  # the engine leaves out the pad that holds it
        assert "feeder/seat/pad" in touched
    assert not world.m.geom_margin.any() and not world.m.geom_gap.any()


OFFS = ({"metres": 3e-4}, {"metres": 1.5e-3}, {"degrees": 0.02, "metres": 0.0}, {"degrees": 2.0})


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


@pytest.mark.parametrize("fuse", [False, True])
def test_a_folded_factory(fuse: bool) -> None:
    """Robots with several labels, whose magazines show again what was lost."""
    faults = (
        Deviation("drop", label="part3", unit=1),
        Deviation("bad_part", label="part2", unit=2),
        Deviation("bad_joint", label="sub3", unit=2),
        Deviation("dead", robot="r2", at=12.0),
    )
    spare = Campaign(spares=1, swap=2.0)
    run, failures = run_with(
        *faults, layout=folded(), units=4, campaign=spare, jitter=0.3, fuse=fuse
    )
    struck = {"drop": 1, "bad_part": 1, "bad_joint": 1, "dead": 1}
    assert_recovered(run, failures, struck)
    assert failures.spares == 1


@cache
def folded() -> Layout:
    """The paper's example with three robots."""
    from factory.apps.few_robots.aim import Aim
    from factory.apps.few_robots.search import allocated

    return allocated(read(PAPER), Aim(3)).layout


def test_scrap_goes_back_as_high_as_it_came(tmp_path: Path) -> None:
    """One robot brings `low`, which is tall, after `high`, which is lost then. Its lift is
    set for `high` only after it has thrown `low` away, past the magazine that both have."""
    file = tmp_path / "shelf.pag"
    file.write_text("""root = s2; s1 = insert ( post, high ); s2 = insert ( s1, low );
post = atomic ( box = ( 0.06, 0.04, 0.12 ), pos = ( 0, 0, 0.06 ) );
high = atomic ( box = ( 0.02, 0.02, 0.02 ), pos = ( 0, 0.03, 0.1 ) );
low = atomic ( box = ( 0.02, 0.02, 0.08 ), pos = ( 0, 0.03, 0.04 ) )""")
    layout = with_lines(read(file), [("high", "low")]).layout
    assert layout.factory.adjusted
    run, failures = run_with(Deviation("drop", label="s1", unit=1), layout=layout, units=1)
    assert_recovered(run, failures, {"drop": 1})


OFTEN = {"metres": 3e-3, "seconds": 2.0}
"""The parameters of kinds that have them."""


@pytest.mark.parametrize(("world", "seed"), [("mujoco", 1), *(("ideal", n) for n in range(4))])
def test_faults_at_rates(world: Any, seed: int) -> None:
    """All kinds at once, drawn; the same draw gives the same run."""
    faults = [
        Deviation(kind, rate=0.04, **{name: OFTEN[name] for name in OFTEN if name in kept})
        for kind in ("drop", "misplaced", "bad_part", "no_part", "bad_joint", "blackout")
        if (kept := KINDS[kind].keys)
    ]
    asked = {"world": world, "units": 8, "jitter": 0.3, "campaign": Campaign(seed=seed, clear=3.0)}
    run, failures = run_with(*faults, **asked)
    assert len(failures.struck) >= 4
    assert_recovered(run, failures, dict(failures.struck))
    if world == "ideal":
        assert run_with(*faults, **asked)[0].events == run.events


# --- what is not found, and what cannot be helped -------------------------------------------------


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


@pytest.mark.parametrize("world", WORLDS)
def test_again_twice_then_scrap(world: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """A joint that always slips is tried three times, and its inputs are scrapped with the third;
    20 scraps on end stop the run, which names the label; in the engine 3, which is quicker."""
    most = 3 if world == "mujoco" else responding.SCRAPS
    monkeypatch.setattr(responding, "SCRAPS", most)
    run, failures = run_with(
        Deviation("bad_joint", label="sub1", rate=1.0),
        world=world,
        campaign=Campaign(clear=0.5),
        max_time=2000,
    )
    made = [one.response for one in failures.found]
    assert made == ["again", "again", "scrap"] * most
    assert {one.scrapped for one in failures.found} == {(), ("part1", "part2")}
    assert failures.scrapped == 2 * most
    assert run.trouble is not None and run.trouble.code == "Failed"
    assert re.fullmatch(f"'part[12]' was scrapped {most} times on end", run.trouble.message)
    assert run.trouble.position is not None
    assert run.products == 0 and run.replays and not run.succeeded


def test_a_feeder_that_gives_bad_parts_only() -> None:
    run, failures = run_with(Deviation("bad_part", label="part3", rate=1.0), max_time=2000)
    assert run.trouble is not None
    assert run.trouble.message == "'part3' was scrapped 20 times on end"
    assert failures.scrapped == 20 and failures.missed == 0


def test_scraps_that_are_not_on_end_do_not_stop_a_run() -> None:
    """Each in a unit of its own."""
    bad = (Deviation("bad_part", label="part3", unit=unit) for unit in range(1, 26))
    run, failures = run_with(*bad, world="ideal", units=25)
    assert_recovered(run, failures, {"bad_part": 25})


@pytest.mark.parametrize("world", WORLDS)
def test_a_dead_robot_without_a_spare(world: Any) -> None:
    """What can be finished without it is, and then the run says which it was."""
    dead = Deviation("dead", robot="r6", unit=3)
    assert layout_of("paper").factory.robots[5].name == "r6"
    run, failures = run_with(dead, world=world, units=6)
    assert run.trouble is not None and run.trouble.code == "Failed"
    assert run.trouble.message == "r6 is dead, and there is no spare"
    assert [one.response for one in failures.found] == ["no spare"]
    assert run.products == 2 and run.replays and not run.succeeded


def test_a_tool_that_is_never_asked_to_move_is_not_missed() -> None:
    """It stays at its station from its first operation on."""
    run, failures = run_with(Deviation("dead", robot="r4", unit=3))
    robot = layout_of("paper").factory.robots[3]
    assert robot.type == "tool"
    assert_recovered(run, failures, {"dead": 1})


def test_robots_with_programs_of_their_own_do_not_recover() -> None:
    simulation = Simulation(layout_of("paper"), RunRequest("ideal", 1, distributed=True))
    with pytest.raises(InputError, match="do not recover"):
        recover(simulation)


# --- planted faults -------------------------------------------------------------------------------


def test_one_transition_too_few_undone_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a record of a run with a failure, whichever it is; and no run comes to its end in which
    the net itself goes back too little."""
    fault = Deviation("drop", label="sub2", unit=2)
    events = run_with(fault, world="ideal")[0].events
    made = layout_of("paper").factory
    at, undone = next((n, e) for n, e in enumerate(events) if isinstance(e, Undone))
    assert len(undone.transitions) > 2 and replays(made, events)
    for spared in range(len(undone.transitions)):
        fewer = undone.transitions[:spared] + undone.transitions[spared + 1 :]
        changed = (*events[:at], replace(undone, transitions=fewer), *events[at + 1 :])
        assert not replays(made, changed)

    def too_few(net: Any, fired: Any, asked: Any, joins: Any) -> tuple[int, ...]:
        right = undo(net, fired, asked, joins)
        spared = next(t for t, n in enumerate(right) if n < fired[t] and t not in asked)
        return tuple(n + (t == spared) for t, n in enumerate(right))

    monkeypatch.setattr(responding, "undo", too_few)
    with pytest.raises(AssertionError, match="not all are enabled that fire"):
        run_with(fault, world="ideal")


def replays(made: Factory, events: Any) -> bool:
    """Whether a record is a run of the net."""
    return replay(made.net, entries_of(events), None, made.joins).refines


BLIND: dict[str, tuple[type, str, Any, str]] = {
    "drop": (MujocoPlant, "lost", lambda plant: (), "jammed"),
    "bad_joint": (MujocoPlant, "residual", lambda plant, operation: 0.0, ""),
    "dead": (MotionHold, "jammed", lambda standing, now, excused: [], ""),
    "askew": (Senses, "is_askew", lambda *_: False, ""),
}
"""A sense that is taken from the factory, and what is found in place of that; "" for nothing."""


@pytest.mark.parametrize("name", BLIND)
def test_blind_sensors_never_succeed_unnoticed(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each fault is missed, and counted as such, or the run stalls."""
    where, method, blind, instead = BLIND[name]
    fault = EACH[name][0]
    monkeypatch.setattr(where, method, blind)
    run, failures = run_with(fault, campaign=Campaign(spares=1), max_time=100)
    assert {one.test for one in failures.found} <= {instead}
    stalled = run.trouble is not None and run.trouble.code == "Stalled"
    assert stalled if name == "dead" else failures.missed == 1


# --- files of faults ------------------------------------------------------------------------------

WRONG: dict[str, tuple[str, str, str]] = {
    "unknown key": ("sed = 1", "UnknownParameter", "unknown key 'sed'"),
    "unknown key of a sensor": ("[sensors]\nnoize = 1", "UnknownParameter", "in [sensors]"),
    "unknown key of a fault": ("UNIT\nlable = 'x'", "UnknownParameter", "'lable' of a fault"),
    "no whole number": ("seed = 1.5", "BadValue", "seed must be a whole number from 0 to"),
    "no number": ("clear = 'x'", "BadValue", "clear must be a number from 0 to"),
    "true for a number": ("clear = true", "BadValue", "clear must be a number"),
    "negative": ("clear = -1", "BadValue", "clear must be a number from 0 to"),
    "not finite": ("clear = inf", "BadValue", "clear must be a number from 0 to"),
    "not a number": ("[sensors]\nnoise = nan", "BadValue", "noise must be a number from 0 to"),
    "too great": (f"clear = 1{400 * '0'}", "BadValue", "clear must be a number from 0 to"),
    "too great, of a fault": (f"UNIT\nat = 1{400 * '0'}", "BadValue", "at must be a number from"),
    "too many digits": (f"clear = 1{5000 * '0'}", "Syntax", "too many digits"),
    "negative, of a fault": ("UNIT\nmetres = -1.0", "BadValue", "metres must be a number from 0"),
    "no truth": ("UNIT\nhidden = 1", "BadValue", "hidden must be true or false"),
    "no text": ("[[fault]]\nkind = 3", "BadValue", "kind must be a text"),
    "sensors are no table": ("sensors = 3", "BadValue", "sensors must be a table"),
    "one table": ("[fault]\nkind = 'drop'", "BadValue", "fault must be a list of tables [[fault]]"),
    "a list of numbers": ("fault = [3]", "BadFault", "a fault is a table"),
    "unknown kind": ("[[fault]]\nkind = 'dorp'", "BadFault", "there is no fault 'dorp'"),
    "no kind": ("[[fault]]\nunit = 1", "BadFault", "this fault has no 'kind'"),
    "no time": ("[[fault]]\nkind = 'blackout'", "BadFault", "one of 'unit', 'at' and 'rate'"),
    "two times": ("UNIT\nat = 1.0", "BadFault", "one of 'unit', 'at' and 'rate'"),
    "unit 0": ("[[fault]]\nkind = 'blackout'\nunit = 0", "BadFault", "counted from 1"),
    "no share": ("[[fault]]\nkind = 'drop'\nrate = 1.5", "BadFault", "a share from 0 to 1"),
    "no label": ("[[fault]]\nkind = 'drop'\nunit = 1", "BadFault", "'drop' needs a 'label'"),
    "no robot": ("[[fault]]\nkind = 'dead'\nat = 1", "BadFault", "'dead' needs a 'robot'"),
    "a robot for nothing": (
        "[[fault]]\nkind = 'bad_part'\nlabel = 'part1'\nrobot = 'r1'\nunit = 1",
        "BadFault",
        "'bad_part' concerns no 'robot'",
    ),
    "a number for nothing": ("UNIT\nmetres = 1e-3", "BadFault", "'drop' takes no 'metres'"),
    "no size": ("[[fault]]\nkind = 'mass'", "BadFault", "'mass' needs a 'factor'"),
    "no direction": (
        "[[fault]]\nkind = 'push'\nbody = 'r1/carriage'\nforce = [1.0, 0.0]",
        "BadValue",
        "force must be a list of three numbers",
    ),
    "a factor of 0": (
        "[[fault]]\nkind = 'gain'\nfactor = 0.0",
        "BadFault",
        "'factor' is 0.0: a positive number is needed",
    ),
    "a time for what always holds": (
        "[[fault]]\nkind = 'mass'\nfactor = 2.0\nat = 1.0",
        "BadFault",
        "'mass' takes no 'at'",
    ),
    "bodies that are not there": (
        "[[fault]]\nkind = 'noise'\nmetres = 1e-4",
        "BadFault",
        "the ideal world has none",
    ),
    "no such label": ("UNIT\nlabel = 'sub9'", "BadFault", "'drop' names 'sub9'"),
    "no such robot": (
        "[[fault]]\nkind = 'down'\nrobot = 'r77'\nunit = 1",
        "BadFault",
        "'down' names 'r77', which is none of the robots",
    ),
    "no part": (
        "[[fault]]\nkind = 'bad_part'\nlabel = 'sub1'\nunit = 1",
        "BadFault",
        "'sub1', which is none of the parts",
    ),
    "nothing joined": (
        "[[fault]]\nkind = 'bad_joint'\nlabel = 'sub2'\nunit = 1",
        "BadFault",
        "'sub2', which is none of the joined labels",
    ),
    "broken": ("[[fault", "Syntax", ""),
    "binary": ("\xff", "Syntax", ""),
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


def test_a_file_that_is_not_there(run: Terminal, tmp_path: Path) -> None:
    for path in (tmp_path / "none.toml", tmp_path):
        done = run("run", PAPER, "--faults", path, "--json")
        assert done.status != 0 and done.codes == ["BadFile"]


def test_faults_do_not_go_with_distributed(run: Terminal, tmp_path: Path) -> None:
    (tmp_path / "f.toml").write_text("")
    for options in (("--faults", tmp_path / "f.toml"), ("--spares", 1)):
        done = run("run", PAPER, *options, "--distributed", "--json")
        assert done.status != 0 and done.codes == ["BadValue"]


# --- the command line -----------------------------------------------------------------------------


def test_what_a_run_with_faults_says(run: Terminal, tmp_path: Path) -> None:
    """In words and as JSON; an empty file changes nothing."""
    file = tmp_path / "faults.toml"
    how = ("run", PAPER, "--world", "ideal", "--units", UNITS)
    file.write_text(f"{WELL}\nlabel = 'sub2'\n")
    done = run(*how, "--faults", file)
    assert done.status == 0
    assert "faults: 1 drop; 0 missed, 0 false alarms" in done.out
    told = run(*how, "--faults", file, "--json").json["failures"]
    assert told["struck"] == {"drop": 1} and told["found"] == 1
    assert told["failures"][0]["scrapped"] == ["sub2"]
    file.write_text("")
    empty, plain = run(*how, "--faults", file, "--json").json, run(*how, "--json").json
    assert empty["events"] == plain["events"] and "failures" not in plain


def test_a_dead_robot_in_words(run: Terminal, tmp_path: Path) -> None:
    """Without a spare the status is 1 and the message names it; with one, units are made."""
    file = tmp_path / "faults.toml"
    file.write_text("[[fault]]\nkind = 'dead'\nrobot = 'r6'\nunit = 2\n")
    how = ("run", PAPER, "--world", "ideal", "--units", UNITS, "--faults", file)
    done = run(*how)
    assert done.status == 1
    assert "r6 is dead, and there is no spare" in done.err
    assert run(*how, "--spares", 1, "--swap", 3).status == 0
