"""A running factory: its commands, their effects, and access to its page."""

from __future__ import annotations

import json
import re
import signal
import socket
from collections.abc import Iterator
from dataclasses import fields, replace
from http.client import HTTPConnection
from importlib import resources
from math import inf
from subprocess import PIPE
from typing import Any

import numpy as np
import pytest

from factory.apps.deviations import KINDS, Campaign, Deviation, FaultInjector
from factory.apps.live import Server, Session
from factory.apps.live.commands import FAULTS, KEYS, LASTS, Command, command_of
from factory.apps.live.interventions import Interventions
from factory.apps.live.outages import Outages
from factory.apps.live.page import page, stage_of
from factory.engine.mjcf import names
from factory.engine.record.replay import replay
from factory.engine.record.state import State
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.support.errors import InputError
from tests.command_line import Terminal, started
from tests.layout_values import paper_layout
from tests.live_sessions import Running
from tests.paths import PAPER

websockets = pytest.importorskip("websockets.sync.client", reason="pip install websockets")

PARTS = ("part1", "part2", "part3")


@pytest.mark.parametrize(
    ("message", "command"),
    [('{"do": "slow", "robot": 0, "factor": 0.1}', Command("slow", robot=0, factor=0.1))],
)
def test_commands_are_read(message: str, command: object) -> None:
    assert command_of(message, 6, PARTS) == command


@pytest.mark.parametrize(
    ("message", "words"),
    [
        (b"\xff\xfe", "JSON object"),
        ("[1]", "JSON object"),
        ('{"do": "push", "robot": 1, "share": 1e9}', "'share' of 'push' is 1000000000.0: one of"),
        ('{"do": "block", "part": "part1", "blocked": 1}', "true or false"),
    ],
)
def test_what_is_no_command_is_explained(message: str | bytes, words: str) -> None:
    with pytest.raises(ValueError) as error:
        command_of(message, 6, PARTS)
    assert words in str(error.value)


@pytest.fixture
def running() -> Iterator[Running]:
    made = Running()
    yield made
    made.close()


def test_pause_step_and_play(running: Running) -> None:
    send = running.session.send
    running.until(lambda f: f.time > 0.2)
    send(Command("pause"))
    still = running.until(lambda f: not f.playing)
    send(Command("slow", robot=1, factor=0.5))
    assert running.until(lambda f: f.slowed).time == still.time, "it looks, and stands"
    send(Command("slow", robot=1, factor=1.0))
    fired = still.count
    for _ in range(4):
        send(Command("step"))
        after = running.until(lambda f, n=fired: f.count > n and not f.playing)
        fired = after.count
        (last,) = {t for t, _ in running.session.fired(after.run, fired - 1, fired)}
        assert after.time - last < 0.011, "it stops within a tick of the firing"
    assert after.time > still.time
    names = [e.transition for e in running.session.simulation.supervisor.events]
    assert replay(paper_layout().factory.net, names).refines
    send(Command("play"))
    running.until(lambda f: f.time > after.time + 0.2)


def test_a_blocked_feeder_stops_the_net_and_frees_it_again(running: Running) -> None:
    send = running.session.send
    send(Command("speed", factor=0.0))
    running.until(lambda f: f.products > 0)
    send(Command("block", part="part2", blocked=True))
    quiet = running.until(lambda f: "feeder of part2" in f.note)
    assert quiet.blocked == ("part2",)
    factory = running.session.simulation.layout.factory
    waits = {factory.net.threaded.places[p].mode for p in quiet.marked}
    assert waits == {"wait"}, "every token waits"
    assert running.until(lambda f: f.time > quiet.time + 1).count == quiet.count
    send(Command("block", part="part2", blocked=False))
    running.until(lambda f: f.products > quiet.products + 1 and not f.note)


def test_it_says_when_the_engine_gives_up(running: Running) -> None:
    running.session.simulation.world.d.qvel[:] = np.nan
    note = running.until(lambda f: bool(f.note)).note
    assert "unstable" in note and "restart it" in note
    running.session.send(Command("restart"))
    running.until(lambda f: f.run == 1 and not f.note and f.time > 0.1)


@pytest.fixture
def server(running: Running) -> Iterator[Server]:
    with Server(running.session, b"<p>the page") as made:
        yield made


def asked(server: Server, path: str, **headers: str) -> tuple[int, str, dict[str, str]]:
    """Status, body and headers of an answer."""
    connection = HTTPConnection("127.0.0.1", server.port, timeout=10)
    connection.putrequest("GET", path, skip_host="Host" in headers)
    for name, value in headers.items():
        connection.putheader(name, value)
    connection.endheaders()
    answer = connection.getresponse()
    return answer.status, answer.read().decode(), dict(answer.getheaders())


def path_of(server: Server) -> str:
    return "/" + server.address.split("/", 3)[3]


def socket_of(server: Server, **options: Any) -> Any:
    address = server.address.replace("http", "ws") + "live"
    return websockets.connect(address, proxy=None, **options)


def unpacked(message: bytes) -> tuple[dict[str, Any], np.ndarray]:
    length = int.from_bytes(message[:4], "little")
    return json.loads(message[4 : 4 + length]), np.frombuffer(message[4 + length :], "<f4")


def test_other_names_and_other_pages_are_refused(server: Server) -> None:
    """A page of another origin whose name resolves to this machine, and one with the address."""
    assert asked(server, path_of(server), Host="evil.example:80")[0] == 403
    assert asked(server, path_of(server), Host="localhost:9000")[0] == 200
    from websockets.exceptions import InvalidStatus

    with pytest.raises(InvalidStatus, match="403"), socket_of(server, origin="http://evil.example"):
        pass
    with socket_of(server, origin=server.address.rsplit("/", 2)[0]) as watcher:
        assert watcher.recv(10)


def test_no_more_may_watch_than_it_can_serve(
    server: Server, monkeypatch: pytest.MonkeyPatch
) -> None:
    from websockets.exceptions import InvalidStatus

    monkeypatch.setattr("factory.apps.live.server.MOST", 2)
    with socket_of(server) as one, socket_of(server) as other:
        assert one.recv(10) and other.recv(10)
        with pytest.raises(InvalidStatus, match="503"), socket_of(server):
            pass


def test_watchers_see_frames_and_are_obeyed(server: Server, running: Running) -> None:
    running.until(lambda f: f.count > 3)
    with socket_of(server) as one, socket_of(server) as other:
        frame, poses = unpacked(one.recv(10))
        assert poses.size == 7 * len(running.session.bodies) and np.isfinite(poses).all()
        assert len(frame["fired"]) == frame["count"] > 3
        other.send('{"do": "slow", "robot": 1, "factor": 0.5}')
        while not frame["slowed"]:
            frame, _ = unpacked(one.recv(10))
        assert frame["slowed"] == {"1": 0.5}
        other.send('{"do": "fly"}')
        while isinstance(message := other.recv(10), bytes):
            pass
        assert "'do' is 'fly'" in json.loads(message)["error"]
        other.send("x" * 100_000)
    running.until(lambda f, n=running.session.frame.number: f.number > n)


def test_it_listens_on_loopback_only(running: Running) -> None:
    for host in ("0.0.0.0", "::", "192.0.2.1", "example.org"):
        with pytest.raises(InputError, match="other machines"):
            Server(running.session, b"", host)
    with Server(running.session, b"") as server:
        assert server._server.socket.getsockname()[0] == "127.0.0.1"
    with Server(running.session, b"", "0.0.0.0", exposed=True) as server:
        path = path_of(server)
        assert asked(server, path, Host="factory.example:80")[0] == 200
        assert asked(server, "/")[0] == 404


def test_a_port_that_is_taken(running: Running) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with pytest.raises(InputError, match=r"cannot listen on 127\.0\.0\.1, port"):
            Server(running.session, b"", port=taken.getsockname()[1])


def test_the_page_names_every_robot_and_part(running: Running) -> None:
    made = page(Session(lambda: Simulation(paper_layout(), RunRequest(units=9)))).decode()
    data = json.loads(made.split('id="data">')[1].split("</script>")[0])
    assert data["parts"] == [o.label for o in paper_layout().factory.leaves]
    assert len(data["frames"]["reach"][0]) == len(data["frames"]["moving"])
    assert "connect-src 'self'" in made and 'class="station"' in made


def test_a_push_answers() -> None:
    """Which robot, with what force, how far it gave way; while the factory stands, that it will."""
    running = Running()
    try:
        running.session.send(Command("pause"))
        running.until(lambda f: not f.playing)
        running.session.send(Command("push", robot=2, share=-1.0))
        running.until(lambda f: "r3 is pushed back with" in f.pushed)
        running.session.send(Command("play"))
        running.until(lambda f: re.fullmatch(ANSWER, f.pushed) is not None)
    finally:
        running.close()


ANSWER = r"r3 was pushed back with \d+ N and displaced by [1-9]\d*\.\d mm"


def test_the_command_serves_until_it_is_interrupted() -> None:
    words = ("view", PAPER, "--port", 0, "--json", "--jitter", 0.2)
    with started(*words, stdout=PIPE, stderr=PIPE, text=True) as process:
        told = json.loads(process.stdout.readline())
        assert told["address"].startswith(f"http://127.0.0.1:{told['port']}/")
        with websockets.connect(
            told["address"].replace("http", "ws") + "live", proxy=None
        ) as watcher:
            assert unpacked(watcher.recv(10))[0]["playing"]
            process.stdout.close()  # nothing reads it from now on
            process.send_signal(signal.SIGINT)
            assert process.wait(20) == 130
        assert process.stderr.read().strip() == "Interrupted stopped by the user"


def test_other_hosts_need_a_word(run: Terminal, monkeypatch: pytest.MonkeyPatch) -> None:
    """The error comes before anything is laid out."""
    monkeypatch.setattr("factory.pipeline.read", None)
    done = run("view", PAPER, "--host", "0.0.0.0", "--json")
    assert done.status == 2 and done.codes == ["BadValue"]
    assert "--expose" in done.json["errors"][0]["hint"]


def test_every_key_of_a_command_is_checked() -> None:
    keys = {key for keys in (*KEYS.values(), *FAULTS.values()) for key in keys}
    assert keys == {field.name for field in fields(Command)} - {"do"}


CAMPAIGN = Campaign(clear=1.0, spares=1, swap=2.0)
DROPS = replace(CAMPAIGN, faults=(Deviation("drop", robot="r6", at=5.0),))


@pytest.fixture
def dropping() -> Iterator[Running]:
    made = Running(campaign=DROPS)
    yield made
    made.close()


def test_every_command_to_fail_is_a_kind_of_fault() -> None:
    assert KINDS.keys() >= FAULTS.keys()


def test_every_command_strikes_what_it_names(monkeypatch: pytest.MonkeyPatch) -> None:
    """The robot, for as long as the page says."""
    struck = list[Deviation]()
    monkeypatch.setattr(FaultInjector, "strike", lambda _, fault, now: struck.append(fault))
    dropping = Running(campaign=CAMPAIGN)
    try:
        for name in FAULTS:
            dropping.session.send(Command(name, robot=2))
        dropping.until(lambda f: len(struck) == len(FAULTS))
    finally:
        dropping.close()
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


def test_the_page_shows_how_far_robots_reach() -> None:
    simulation = Simulation(paper_layout())
    layout, reach = simulation.layout, stage_of(simulation).reach
    for robot in layout.factory.robots:
        stops = [layout.home(robot.index, o) for o in robot.operations]
        low, high = reach[:, simulation.physical.m.body(names.carriage(robot.name)).id]
        assert np.linalg.norm(high - low) == pytest.approx(max(stops) - min(stops))
