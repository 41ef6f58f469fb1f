"""A running factory that goes on after failures, and is made to fail: by hand, and in the page."""

from __future__ import annotations

import json
import re
import signal
from collections.abc import Iterator
from dataclasses import replace
from importlib import resources
from math import inf
from subprocess import PIPE
from typing import Any

import pytest

from factory.apps.deviations import KINDS, Campaign, Deviation, FaultInjector
from factory.apps.live.commands import FAULTS, KEYS, LASTS, Command
from factory.apps.live.interventions import Interventions
from factory.apps.live.outages import Outages
from factory.engine.record.state import State
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.support.errors import InputError
from tests.command_line import started
from tests.layout_values import paper_layout
from tests.live_sessions import Running
from tests.paths import PAPER

websockets = pytest.importorskip("websockets.sync.client", reason="pip install websockets")

CAMPAIGN = Campaign(clear=1.0, spares=1, swap=2.0)
DROPS = replace(CAMPAIGN, faults=(Deviation("drop", robot="r6", at=5.0),))


@pytest.fixture
def running() -> Iterator[Running]:
    made = Running(campaign=DROPS)
    yield made
    made.close()


def test_every_command_to_fail_is_a_kind_of_fault() -> None:
    assert KINDS.keys() >= FAULTS.keys()


def test_every_command_strikes_what_it_names(monkeypatch: pytest.MonkeyPatch) -> None:
    """The robot, for as long as the page says."""
    struck = list[Deviation]()
    monkeypatch.setattr(FaultInjector, "strike", lambda _, fault, now: struck.append(fault))
    running = Running(campaign=CAMPAIGN)
    try:
        for name in FAULTS:
            running.session.send(Command(name, robot=2))
        running.until(lambda f: len(struck) == len(FAULTS))
    finally:
        running.close()
    assert struck == [
        Deviation("down", robot="r3", at=0.0, seconds=LASTS),
        Deviation("dead", robot="r3", at=0.0),
    ]


def test_a_run_that_is_made_to_fail_goes_on() -> None:
    simulation = Simulation(paper_layout(), RunRequest(units=6, recovers=True))
    hands, ticks = Interventions(simulation, CAMPAIGN), 0

    def act(_: State) -> None:
        nonlocal ticks
        ticks += 1
        match ticks:
            case 50:
                hands.slow(4, 0.5)
                hands.fail("bad_part", label="part1")
            case 150:
                hands.fail("drop", 5)
            case 700:
                hands.fail("down", 1, seconds=1.0)
            case 900:
                hands.slow(4, 1.0)
                hands.fail("dead", 4)

    run = simulation.run([act])
    assert run.products == 6 and run.trouble is None and run.refines_net
    assert hands.recovery is not None
    report = hands.recovery.report()
    assert report.struck == {"bad_part": 1, "drop": 1, "down": 1, "dead": 1, "slow": 2}
    assert {one.test for one in report.found} == {"rejected", "lost", "jammed"}
    assert report.spares == 1 and report.missed == report.false_alarms == 0


def test_a_robot_that_is_slow_stays_slow_when_others_stand() -> None:
    simulation = Simulation(paper_layout(), RunRequest(units=6, recovers=True))
    hands = Interventions(simulation, CAMPAIGN)
    full = simulation.limits.speed.copy()
    hands.slow(1, 0.5)
    hands.fail("down", 2, seconds=0.1)
    for _ in range(3):
        simulation.supervisor.step()
        for act in simulation.world.hooks.ticks:
            act()
    assert simulation.limits.speed[2] < 1e-6
    hands.slow(3, 0.25)
    assert simulation.limits.speed[2] < 1e-6, "it still stands"
    for _ in range(20):
        simulation.supervisor.step()
        for act in simulation.world.hooks.ticks:
            act()
    assert (simulation.limits.speed / full)[:4].tolist() == pytest.approx([1, 0.5, 1, 0.25])


def test_without_a_campaign_nothing_fails() -> None:
    hands = Interventions(Simulation(paper_layout(), RunRequest(units=1)))
    with pytest.raises(InputError, match="does not go on after failures"):
        hands.fail("drop", 1)


@pytest.mark.parametrize(
    ("outages", "told"),
    [
        (
            Outages(dead={"r1": 6.2, "r4": inf}),
            [
                ("dead", "r1 is dead: a spare replaces it in 7 s"),
                ("dead", "r4 is dead: nothing replaces it"),
            ],
        ),
        (
            Outages(closed=("r1",), lying=2.5, zones=((0.0, 0.0, 0.1),)),
            [("closed", "r1 stands still: a fallen part nearby is cleared away in 3 s")],
        ),
        (
            Outages(lying=0.0, zones=((0.0, 0.0, 0.1),), standing=("r1", "r2")),
            [("closed", "a fallen part is cleared away soon"), ("standing", "r1, r2 stand still")],
        ),
        (
            Outages(dark=1.2, empty={"part1": 3.0}),
            [
                ("dark", "all sensors are off: they return in 2 s"),
                ("empty", "the feeder of part1 is empty: it is refilled in 3 s"),
            ],
        ),
    ],
)
def test_what_is_out_of_order_in_words(outages: Outages, told: list[tuple[str, str]]) -> None:
    assert [*outages.messages()] == told
    json.dumps(outages.as_json(), allow_nan=False)


def received(watcher: Any) -> dict[str, Any]:
    """The next frame that a watcher gets."""
    message = watcher.recv(10)
    return json.loads(message[4 : 4 + int.from_bytes(message[:4], "little")])


def test_with_spares_robots_can_die() -> None:
    words = ("view", PAPER, "--spares", 1, "--swap", 30, "--port", 0, "--json")
    with started(*words, stdout=PIPE, stderr=PIPE, text=True) as process:
        address = json.loads(process.stdout.readline())["address"].replace("http", "ws") + "live"
        with websockets.connect(address, proxy=None) as watcher:
            watcher.send('{"do": "speed", "factor": 0}')
            watcher.send('{"do": "dead", "robot": 3}')
            while not (dead := received(watcher)["outages"]["dead"]):
                pass
            assert dead == ["r4"]
            while received(watcher)["outages"]["dead"]:
                pass
        process.send_signal(signal.SIGINT)
        assert process.wait(20) == 130


def test_every_button_sends_a_command_with_its_keys() -> None:
    """By the text of the page's program: commands have the keys that are read, and no others."""
    text = resources.files("factory.apps.live").joinpath("assets/live.js").read_text("utf-8")
    found = re.findall(r"{ do: '(\w+)'((?:, \w+(?:: [^,}]+)?)*) }", text)
    every = {**KEYS, **FAULTS}
    assert {name for name, _ in found} >= {*FAULTS, "push", "slow", "block"}
    for name, keys in found:
        assert {*re.findall(r", (\w+)", keys)} == {*every[name]}, name
