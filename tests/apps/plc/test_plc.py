"""A PLC runs the cell: the exported programs, executed as they stand in lock step with the plant,
fire what the supervisor fires; what is planted in them is found, by name."""

from __future__ import annotations

import re
from functools import cache
from typing import Any

import pytest
from lark.exceptions import LarkError

from factory.apps.exports.iec.cell import cell, scan_time
from factory.apps.exports.iec.structured_text import write
from factory.apps.plc.driven import DrivenSupervisor, drive
from factory.apps.runs.watched import watched
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.run import Run
from factory.engine.simulation.simulation import Simulation
from factory.support.errors import InputError
from factory.support.settings import Settings
from tests.examples import with_hands
from tests.slow import slow_but
from tests.structured_text import Plc

PRODUCTS = ("paper", "truck", "gearbox", "chair", "chest")


@cache
def text(name: str, scan: int = 10) -> str:
    return write(cell(with_hands(name), Settings(), name, scan))


def driven(
    name: str, program: str, monitor: bool = True, **asked: Any
) -> tuple[Run, DrivenSupervisor]:
    """A run of the plant that a program drives, and what supervised it."""
    simulation, plc = Simulation(with_hands(name), RunRequest(**asked)), Plc(program)
    supervisor = drive(simulation, plc, plc.interval)
    run = watched(simulation, every_tick=True) if monitor else simulation.run()
    return run, supervisor


def by_robot(name: str, run: Run) -> dict[str, list[str]]:
    """What each robot took part in, in the order of its program, as often as units were made: it
    may have begun the next one."""
    factory = with_hands(name).factory
    transitions = factory.net.threaded.transitions
    done = {}
    for robot in factory.robots:
        own = {transitions[2 * o + end].name for o in robot.operations for end in (0, 1)}
        steps = [event.transition for event in run.lasting if event.transition in own]
        done[robot.name] = steps[: run.units // factory.period * len(own)]
    return done


def agree(name: str, scan: int = 10, monitor: bool = True, **asked: Any) -> None:
    """The run under the PLC fires what the one under the supervisor does, up to the order of what
    robots do that have nothing to do with each other; and its bodies agree."""
    reference = Simulation(with_hands(name), RunRequest(**asked)).run()
    run, supervisor = driven(name, text(name, scan), monitor, **asked)
    assert (run.trouble, run.products, supervisor.refusals) == (None, asked["units"], [])
    assert run.succeeded, run.verdict
    assert by_robot(name, run) == by_robot(name, reference)
    count = len(with_hands(name).factory.net.threaded.transitions)
    assert len({*(event.transition for event in run.lasting)}) == count
    if run.physics is not None:
        assert run.physics.handoff_gap_max_mm <= 0.1
        assert run.physics.unintended_contacts == 0


@pytest.mark.parametrize(
    ("name", "world"),
    slow_but(
        [("paper", "ideal"), ("paper", "mujoco")],
        [*((n, "ideal") for n in PRODUCTS), ("paper", "mujoco"), ("truck", "mujoco")],
    ),
)
def test_a_plc_fires_what_the_supervisor_fires(name: str, world: str) -> None:
    agree(name, units=3, world=world, jitter=0.3, seed=1)


@pytest.mark.slow
@pytest.mark.parametrize("scan", [4, 20])
@pytest.mark.parametrize("name", PRODUCTS)
def test_twenty_products_at_two_scan_times(name: str, scan: int) -> None:
    agree(name, scan, monitor=False, units=20, jitter=0.3)


FAULTS = {
    "a swapped wait": (
        "paper",
        r"Cells\[3\]\.Finished = Unit \* 3 \+ 2\s+AND Cells\[3\]\.Carries = 3 \(\* sub2 \*\)",
        "Cells[2].Finished = Unit * 2 + 1",
        "r1 takes up mate sub3, but r3 is not there with what is brought",
    ),
    "no wait at all": (
        "paper",
        r"IF Cells\[5\]\.Finished = Unit \* 2 \+ 1\s+AND[^T]*THEN",
        "IF TRUE THEN",
        "r3 takes up mate sub1, but r5 and r6 are not there with what is brought",
    ),
    "a miscounted cell": (
        "paper",
        r"Cells\[3\]\.Finished := Cells\[3\]\.Finished \+ 1",
        "Cells[3].Finished := Cells[3].Finished + 2",
        "Stalled",
    ),
    "a grip that does not close": (
        "paper",
        r"(BLOCK ROBOT_r3[\s\S]*?)Grip := TRUE",
        r"\1Grip := FALSE",
        "r6 in mate(sub1), r3 in mate(sub1)",
    ),
    "a grip that does not open": (
        "paper",
        r"(BLOCK ROBOT_r5[\s\S]*?)Grip := FALSE",
        r"\1Grip := TRUE",
        "Stalled",
    ),
    "a grip whose sensor is not asked": (
        "paper",
        r"(BLOCK ROBOT_r5[\s\S]*?)Grip := FALSE([\s\S]*?)IF NOT Held",
        r"\1Grip := TRUE\2IF TRUE",
        "r5 leaves mate sub1 before its grip has opened",
    ),
    "a grip that opens too early": (
        "paper",
        r"(BLOCK ROBOT_r5[\s\S]*?mate sub1 \*\))",
        r"\1 Grip := FALSE;",
        "r5 opens its grip: part1 would fall, since nobody has taken it",
    ),
    "a take from afar": (
        "paper",
        r"< 0\.0002 AND",
        "< 0.1 AND",
        " mm from where it has to be, and a grip reaches 1 mm",
    ),
    "`Ready` stuck at TRUE": (
        "paper",
        r"IF Ready\[2\] THEN",
        "IF TRUE THEN",
        "r5 takes up atomic part1, but its feeder shows no part",
    ),
    "`Ready` stuck at FALSE": ("paper", r"IF Ready\[2\] THEN", "IF FALSE THEN", "Stalled"),
    "no order place": (
        "gearbox",
        r"\s+AND \(COMPLETED[^\n]*Position[^\n]*?\)( THEN)?(?=\n)",
        r"\1",
        "another machine is still in its way",
    ),
    "no gate": (
        "chest",
        r"(Target := (\d\.\d+);\n\s+ELSE\n\s+Axes\[\d+\]\.Target := )\d\.\d+",
        r"\1\2",
        " m: it may go between ",
    ),
}


@pytest.mark.parametrize("fault", slow_but(["a grip that opens too early"], FAULTS))
def test_what_is_planted_in_the_programs_is_found(fault: str) -> None:
    name, pattern, planted, message = FAULTS[fault]
    program, count = re.subn(pattern, planted, text(name))
    assert count
    run, supervisor = driven(name, program, units=3)
    assert not run.succeeded or supervisor.refusals
    told = [refusal.message for refusal in supervisor.refusals]
    told += [f"{run.trouble.code}: {run.trouble.message}"] if run.trouble else []
    assert any(message in line for line in told), told


MISTAKES = {
    "an array of no named type": (r"Held : GRIP_LIST", "Held : ARRAY [1..6] OF BOOL"),
    "a name that differs by case": (r"Begun", "CELLS"),
    "a keyword": (r"Begun", "Step"),
    "a name that is not declared": (r"NOT Begun", "NOT Started"),
    "a type that is not declared": (r"Begun : BOOL", "Begun : BIT"),
    "another type": (r"Begun : BOOL", "Begun : INT"),
    "an in-out that is left out": (r", Axes := Axes\)", ")"),
    "an index past the end": (r"Axes\[1\]", "Axes[7]"),
    "an input that is assigned to": (r"Begun := TRUE", "Held[1] := TRUE"),
    "a case that is there twice": (r"    1: ", "    0: "),
    "a whole number for a real one": (r"Target := \d\.\d+", "Target := 1"),
    "a comment that does not end": (r"END_CONFIGURATION", "(* END_CONFIGURATION"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_the_interpreter_is_strict(mistake: str) -> None:
    program, count = re.subn(*MISTAKES[mistake], text("paper"), count=1)
    assert count
    with pytest.raises((LarkError, SyntaxError, TypeError, IndexError)):
        Plc(program)


def test_whole_numbers_overflow() -> None:
    plc = Plc(text("paper").replace("Finished + 1", "Finished + 4294967296"))
    simulation = Simulation(with_hands("paper"), RunRequest(units=2, world="ideal"))
    drive(simulation, plc, plc.interval)
    with pytest.raises(OverflowError, match="no UDINT"):
        simulation.run()


@pytest.mark.parametrize(("given", "scan"), [("1000ms", 1000)])
def test_the_scan_time_is_that_of_the_task(given: str, scan: int) -> None:
    assert scan_time(given) == scan
    assert Plc(text("paper", scan)).interval == scan / 1000


def test_other_scan_times_are_refused() -> None:
    with pytest.raises(InputError, match="is no scan time"):
        scan_time("ms")
