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

import numpy as np
import pytest

from factory.apps.deviations import KINDS, Campaign, Deviation, FaultInjector
from factory.apps.live import Server
from factory.apps.live.commands import FAULTS, KEYS, LASTS, Command, command_of
from factory.apps.live.interventions import Interventions
from factory.apps.live.outages import Outages, Watch
from factory.apps.live.page import page
from factory.engine.record.state import State
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.run import entries_of
from factory.engine.simulation.simulation import Simulation
from factory.support.errors import InputError
from factory.theory.nets.replay import replay
from factory.theory.nets.undone import Undone
from tests import failing_runs
from tests.command_line import started
from tests.layout_values import paper_layout
from tests.live_sessions import Running, a_session
from tests.paths import PAPER

WATCHED = 4.0
"""So many times as fast as real time a session runs in which what lasts a second is to be seen."""

websockets = pytest.importorskip("websockets.sync.client", reason="pip install websockets")

PARTS = ("part1", "part2", "part3")
LOST = "r6 lost part2: made again"
CAMPAIGN = Campaign(clear=1.0, spares=1, swap=2.0)
DROPS = replace(CAMPAIGN, faults=(Deviation("drop", robot="r6", at=5.0),))


@pytest.fixture
def running() -> Iterator[Running]:
    made = Running(campaign=DROPS)
    yield made
    made.close()


@pytest.mark.parametrize("name", FAULTS)
def test_commands_to_fail_are_read_where_it_goes_on_after_failures(name: str) -> None:
    message = json.dumps({"do": name, "robot": 2})
    assert command_of(message, 6, PARTS, True) == Command(name, robot=2)
    with pytest.raises(ValueError, match=f"'do' is '{name}': there are pause"):
        command_of(message, 6, PARTS)
    with pytest.raises(ValueError, match=f"'robot' of '{name}'"):
        command_of(json.dumps({"do": name, "robot": 6}), 6, PARTS, True)


def test_every_command_to_fail_is_a_kind_of_fault() -> None:
    assert KINDS.keys() >= FAULTS.keys()


@pytest.mark.parametrize(
    ("kind", "robot", "label", "tests"),
    [
        ("drop", 5, "", {"lost"}),
        ("down", 1, "", set()),
        ("dead", 4, "", {"jammed"}),
        ("bad_part", None, "part1", {"rejected"}),
        ("misplaced", None, "part1", {"misplaced"}),
        ("no_part", None, "part2", set()),
        ("bad_joint", None, "sub1", {"residual"}),
        ("blackout", None, "", set()),
    ],
)
def test_each_fault_by_hand_is_found(
    kind: str, robot: int | None, label: str, tests: set[str]
) -> None:
    """What it is in words, and that nothing is missed; what takes time takes it."""
    layout = failing_runs.paper_layout()
    simulation = Simulation(layout, RunRequest(units=4, recovers=True))
    hands, told = Interventions(simulation, CAMPAIGN), set[str]()
    assert hands.recovery is not None
    watch, lasts = Watch(hands.recovery), "seconds" in KINDS[kind].keys

    def act(state: State) -> None:
        if state.time == pytest.approx(3.0):
            hands.fail(kind, robot, label, **({"seconds": 6.0} if lasts else {}))
        told.update(mark for mark, _ in watch.now().messages())

    run = simulation.run([act])
    assert (run.products, run.trouble, run.refines_net) == (4, None, True)
    report = hands.recovery.report()
    assert report.struck == {kind: 1} and {one.test for one in report.found} == tests
    assert report.missed == report.false_alarms == 0
    marks = {"blackout": "dark", "no_part": "empty", "down": "standing", "dead": "dead"}
    assert marks.get(kind) in (None, *told)
    if kind in ("down", "no_part", "blackout"):
        alone = Simulation(layout, RunRequest(units=4)).run().sim_time_s
        assert run.sim_time_s > alone + 2.0


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


def test_how_long_it_lasts_still_is_told() -> None:
    """Of a feeder that is empty and of sensors that tell nothing, at every tick."""
    simulation = Simulation(paper_layout(), RunRequest(units=3, recovers=True))
    hands, seen = Interventions(simulation, CAMPAIGN), set[str]()
    assert hands.recovery is not None
    watch = Watch(hands.recovery)

    def act(state: State) -> None:
        now = watch.now()
        for name, left in (("dark", now.dark), ("empty", now.empty.get("part2", 0.0))):
            if left:
                seen.add(name)
                assert left == pytest.approx(5.0 - state.time, abs=1e-6)
        if state.time == pytest.approx(3.0):
            hands.fail("blackout", seconds=2.0)
            hands.fail("no_part", label="part2", seconds=2.0)

    assert simulation.run([act]).products == 3 and seen == {"dark", "empty"}


@pytest.mark.parametrize("order", [(5.0, 1.0), (1.0, 5.0)])
def test_what_lasts_longest_counts(order: tuple[float, float]) -> None:
    """A fault by hand ends none that is there: sensors stay dark, robots stand, and feeders are
    empty until the last of two is over."""
    simulation = Simulation(paper_layout(), RunRequest(units=1, recovers=True))
    hands = Interventions(simulation, CAMPAIGN)
    assert hands.recovery is not None
    for seconds in order:
        hands.fail("blackout", seconds=seconds)
        hands.fail("down", 1, seconds=seconds)
        hands.fail("no_part", label="part2", seconds=seconds)
    now = hands.recovery.condition
    assert (now.dark, now.standing, now.empty) == (5.0, {1: 5.0}, {"part2": 5.0})


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


def test_a_session_tells_what_failed_and_begins_anew(running: Running) -> None:
    session, send = running.session, running.session.send
    send(Command("speed", factor=0.0))
    failed = running.until(lambda f: LOST in f.note)
    assert failed.run == 0 and session.fails
    running.until(lambda f: f.products > failed.products + 2 and not f.outages.standing)
    account = session.simulation.world.hooks.account
    assert account is not None and any("r6" in robots for _, robots in account.stood)
    told = session.fired(0, 0, session.frame.count)
    assert session.failed(0, 0, failed.failed) == [(pytest.approx(failed.time, 1.0), LOST)]
    assert session.failed(0, failed.failed, failed.failed) == session.failed(1, 0, 1) == []
    undone = [event for _, event in told if isinstance(event, list)]
    assert len(undone) == 1
    events = session.simulation.supervisor.events
    entry = next(e for e in events if isinstance(e, Undone))
    assert len(undone[0]) == len(entry.transitions)
    net, joins = paper_layout().factory.net, paper_layout().factory.joins
    assert replay(net, entries_of([*events]), joins=joins).refines
    send(Command("restart"))
    running.until(lambda f: f.run == 1 and not f.outages.standing and f.time > 0.1)
    assert session.fails


def test_a_session_tells_what_is_out_of_order(running: Running) -> None:
    session, send = running.session, running.session.send
    assert session.frame.outages == Outages()
    send(Command("speed", factor=WATCHED))
    lies = running.until(lambda f: f.outages.zones and f.outages.closed).outages
    (x, y, radius), world = lies.zones[0], session.simulation.physical
    assert "r6" in lies.closed and not lies.dead and 0.0 < lies.lying <= CAMPAIGN.clear
    assert min(np.hypot(*(world.d.xpos[:, :2] - (x, y)).T)) < radius
    running.until(lambda f: f.outages == Outages())
    send(Command("dead", robot=1))
    stands = running.until(lambda f: bool(f.outages.standing)).outages
    assert (stands.standing, stands.dead) == (("r2",), {}), "nothing has told of it"
    dead = running.until(lambda f: bool(f.outages.dead)).outages
    assert [*dead.dead] == ["r2"] and dead.standing == ()
    assert 0.0 < dead.dead["r2"] <= CAMPAIGN.swap
    running.until(lambda f: f.outages == Outages())


@pytest.mark.parametrize(
    ("outages", "told"),
    [
        (Outages(), []),
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
            [
                ("closed", "a fallen part is cleared away soon"),
                ("standing", "r1, r2 stand still"),
            ],
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


def test_no_spare_ends_the_run_until_it_begins_anew() -> None:
    running = Running(campaign=Campaign())
    try:
        running.session.send(Command("speed", factor=0.0))
        running.session.send(Command("dead", robot=5))
        running.until(lambda f: "r6 is dead, and there is no spare: restart it" in f.note)
        running.session.send(Command("restart"))
        running.until(lambda f: f.run == 1 and f.products > 0)
    finally:
        running.close()


def received(watcher: Any) -> dict[str, Any]:
    """The next frame that a watcher gets."""
    message = watcher.recv(10)
    return json.loads(message[4 : 4 + int.from_bytes(message[:4], "little")])


def test_watchers_make_it_fail(running: Running) -> None:
    with Server(running.session, b"") as server:
        address = server.address.replace("http", "ws") + "live"
        with websockets.connect(address, proxy=None) as watcher:
            watcher.send('{"do": "down", "robot": 3}')
            while "r4" not in received(watcher)["outages"]["standing"]:
                pass
            watcher.send('{"do": "speed", "factor": 0}')
            told: list[list[Any]] = []
            while not told or not any(isinstance(event, list) for _, event in told[-1]):
                told.append(received(watcher)["fired"])
            events = [event for _, event in told[-1]]
            assert LOST in events and all(
                not isinstance(e, str) for row in told[:-1] for _, e in row
            )
            assert [t for t, _ in told[-1]] == sorted(t for t, _ in told[-1])


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


def test_the_page_has_the_buttons_only_where_it_can_fail() -> None:
    for campaign, word in ((CAMPAIGN, b'"fails":true'), (None, b'"fails":false')):
        text = page(a_session(False, campaign))
        assert word in text.replace(b'"fails": ', b'"fails":')


def test_every_button_sends_a_command_with_its_keys() -> None:
    """By the text of the page's program: commands have the keys that are read, and no others."""
    text = resources.files("factory.apps.live").joinpath("assets/live.js").read_text("utf-8")
    found = re.findall(r"{ do: '(\w+)'((?:, \w+(?:: [^,}]+)?)*) }", text)
    every = {**KEYS, **FAULTS}
    assert {name for name, _ in found} >= {*FAULTS, "push", "slow", "block"}
    for name, keys in found:
        assert {*re.findall(r", (\w+)", keys)} == {*every[name]}, name
