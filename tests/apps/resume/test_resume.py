"""Runs that were killed go on from their logs: to the bit as if nothing had happened. What does not
come again as it is logged is refused with a diagnostic."""

from __future__ import annotations

import json
import signal
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest

from factory.apps.log import LogWriter, read_log
from factory.apps.log.blocks import Arrays
from factory.apps.log.checks import HEADER
from factory.apps.log.content import RECORD, content_of
from factory.apps.log.reader import digest_of, header_in
from factory.apps.log.writer import rows_of_a_block
from factory.apps.resume.continued import last_full
from factory.apps.resume.resuming import Resumed
from factory.engine.simulation.compiled import Compiled
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.support.claim import claimed, claimed_again
from factory.support.errors import InputError
from tests.apps.log.test_log import block_ends, put_together, taken_apart
from tests.command_line import Terminal, spawn, started
from tests.paths import PAPER, ROOT
from tests.simulation_values import FINE, layout_of
from tests.waiting import grown

UNITS = 2
JITTER = "--seed", 7, "--jitter", 0.2
EXAMPLES = ROOT / "examples"


def ticks_of(path: Path) -> tuple[bytes, dict[str, object]]:
    """All of a log but its header, which has the command line: its ticks, and what ended it with
    the figures of its bodies, less the digest of the header."""
    data, (_, end) = path.read_bytes(), taken_apart(path)[1][-1]
    told = {name: bytes(values).decode() for name, values in end.items()}
    header, first = header_in(data)
    figures = json.loads(told.pop("figures", "{}"))
    assert figures.pop(HEADER, None) == (digest_of(header) if figures else None)
    return data[first : block_ends(data)[-2]], {**told, **figures}


def cut(whole: Path, path: Path, size: int) -> Path:
    """The first so many bytes of a log."""
    path.write_bytes(whole.read_bytes()[:size])
    return path


def go_on(made: Simulation, path: Path, max_time: float | None = None) -> float:
    """Let a simulation that has not begun come to where its log ends, and go on; gives when that
    is [s]."""
    end, since = last_full(content_of(path, RECORD), rows_of_a_block(made.request.settings.tick))
    going = Resumed(path, made, read_log(path), claimed_again(path), end, since)
    with going.recorder() as recorder:
        recorder.end(made.run([recorder.observe], max_time, (), recorder.since).trouble)
    return since


@cache
def request_of(name: str) -> tuple[RunRequest, Compiled]:
    """A run of a factory whose robots differ, and what is made for it."""
    given: dict[str, Any] = {"world": "ideal"} if name == "lamp" else {"fuse": name == "truck"}
    alone = name == "fence"
    asked = RunRequest(units=20, seed=3, jitter=0.3, settings=FINE, distributed=alone, **given)
    return asked, Compiled.of(layout_of(name), asked)


def made(name: str) -> Simulation:
    """That run, ready to go."""
    return Simulation(layout_of(name), *request_of(name))


def test_a_run_that_goes_on_is_the_same_to_the_last_bit(tmp_path: Path) -> None:
    """From any byte of its log, which nobody looked at until there: all that is logged after that
    is the same, and so are the figures in its end. One is of robots that run by themselves."""
    name = "lamp"
    whole, log, simulation = tmp_path / "whole.log", tmp_path / "run.log", made(name)
    until = 450 * simulation.request.settings.tick
    with LogWriter(whole, simulation) as writer:
        writer.end(simulation.run([writer.observe], until).trouble)
    size = len(whole.read_bytes())
    for share in (0.6, 0.95):
        assert 0 < go_on(made(name), cut(whole, log, round(share * size)), until) < until
        assert log.read_bytes() == whole.read_bytes()
    with pytest.raises(InputError, match="come to its end: not finished"):
        go_on(made(name), log, 0.5)
    assert log.read_bytes() == whole.read_bytes()


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The log of a run that was not cut off; not to be written."""
    path = tmp_path_factory.mktemp("whole") / "run.log"
    done = spawn("run", PAPER, "--units", UNITS, "--seed", 7, "--jitter", 0.2, "--log", path, "-q")
    assert done.status == 0, done.err
    return path


@pytest.fixture(scope="module")
def ideal(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same in the ideal world."""
    path = tmp_path_factory.mktemp("ideal") / "run.log"
    words = ("run", PAPER, "--units", UNITS, *JITTER, "--world", "ideal", "--log", path, "-q")
    assert spawn(*words).status == 0
    return path


def test_a_run_that_is_at_its_end(run: Terminal, whole: Path, tmp_path: Path) -> None:
    log = cut(whole, tmp_path / "run.log", whole.stat().st_size)
    then = log.stat().st_mtime_ns
    done = run("run", "--resume", log)
    assert done.status == 0 and f"is complete, {UNITS} of {UNITS} units" in done.out
    assert run("run", "--resume", log, "--json").json["products"] == UNITS
    assert log.stat().st_mtime_ns == then and log.read_bytes() == whole.read_bytes()


def test_what_cannot_be_gone_on_with(
    run: Terminal, whole: Path, ideal: Path, tmp_path: Path
) -> None:
    log = tmp_path / "run.log"
    header, blocks = taken_apart(whole)

    def refused(words: str, code: str = "BadLog", path: Path = log) -> None:
        before = path.read_bytes() if path.is_file() else b""
        done = run("run", "--resume", path)
        assert done.status == 2 and code in done.err and words in done.err, done
        assert not path.is_file() or path.read_bytes() == before

    refused("is no file")
    refused("is no file", path=tmp_path)
    refused("is no log", path=PAPER)
    cut(whole, log, whole.stat().st_size // 2)
    with claimed(tmp_path / "other.log"):
        refused("is being written by another run", "BadFile", tmp_path / "other.log")
    rest = {name: value for name, value in header.items() if name != "chosen"}
    refused("'chosen'", path=put_together(log, rest, blocks[:4]))
    old = {**header, "versions": {**header["versions"], "mujoco": "2.0.0"}}
    refused("was kept with mujoco 2.0.0", path=put_together(log, old, blocks[:4]))
    model = {**blocks[0][1], "xml": np.append(blocks[0][1]["xml"], np.uint8(32))}
    refused("is of another model", path=put_together(log, header, [(b"M", model), *blocks[1:4]]))
    stalled = {k: np.frombuffer(b"Stalled", "u1") for k in ("code", "message")}
    refused("would end again", path=put_together(log, header, [*blocks[:3], (b"E", stalled)]))
    for words in (("--units", 3), ("--log", tmp_path / "b"), ("--speed", 1)):
        done = run("run", "--resume", whole, *words)
        assert done.status == 2 and "Usage" in done.err and str(words[0]) in done.err


Change = Callable[[dict[str, Any], Arrays], None]
"""Changes a header, or a block of ticks."""


def missing(header: dict[str, Any], ticks: Arrays) -> None:
    for name in ("fired", "fired_t", "fired_at"):
        ticks[name] = ticks[name][:0]


def between(header: dict[str, Any], ticks: Arrays) -> None:
    ticks["time"] = ticks["time"] + 1e-6


def one_more(header: dict[str, Any], ticks: Arrays) -> None:
    ticks["delivered"] = ticks["delivered"] + 1


def fewer(header: dict[str, Any], ticks: Arrays) -> None:
    header["units"] = 1


def reseeded(header: dict[str, Any], ticks: Arrays) -> None:
    header["seed"] = 8


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (missing, "' at "),
        (between, "no state of that time"),
        (one_more, "2 products, and the run made again has 1"),
        (fewer, "no such event"),
        (reseeded, "made again has"),
    ],
)
def test_what_does_not_come_again_is_refused(
    run: Terminal, ideal: Path, tmp_path: Path, change: Change, words: str
) -> None:
    """It says when, what is logged and what comes; and the log is as it was."""
    header, blocks = taken_apart(ideal)
    blocks = [(kind, {**arrays}) for kind, arrays in blocks[:-2]]
    while len(blocks[-1][1]["fired"]) < 2:
        blocks.pop()
    change(header, blocks[-1][1])
    log = put_together(tmp_path / "run.log", header, blocks)
    before = log.read_bytes()
    done = run("run", "--resume", log, "--json")
    assert done.status == 2 and done.codes == ["BadLog"] and words in done.err + done.out, done
    assert log.read_bytes() == before


def killed_and_gone_on(
    folder: Path, words: tuple[object, ...], kills: int, chance: Random, size: int
) -> list[float]:
    """A run that is killed so many times, each at a random time until its log has as large a share
    of its whole `size` as of its kills; gives when [simulated s]. It is let come to its
    end."""
    log, came = folder / "run.log", list[float]()
    command: tuple[object, ...] = ("run", *words, "--log", log, "-q")
    for kill in range(kills):
        wanted = size * chance.uniform(kill + 0.05, kill + 0.9) / kills
        with started(*command) as process:
            grown(log, wanted, process)
            process.send_signal(signal.SIGKILL)
            assert process.wait() == -signal.SIGKILL
        came.append([0.0, *read_log(log).time.tolist()][-1])
        command = "run", "--resume", log, "-q"
    done = spawn(*command[:-1], "--json")
    assert done.status == 0, done.err
    assert done.json["unintended_contacts"] == 0 and done.json["refines_net"]
    told = spawn("monitor", log, "--json")
    assert told.status == 0 and told.json["refines_net"] and told.json["verdict"]["succeeded"]
    return came


FACTORIES: tuple[tuple[object, ...], ...] = (
    (PAPER, "--units", 60, "--jitter", 0.3),
    (EXAMPLES / "truck.pag", "--units", 4, "--fuse"),
    (EXAMPLES / "gearbox.pag", "--units", 3, "--jitter", 0.2),
    (PAPER, "--units", 60, "--robots", 3),
)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="there is no SIGKILL")
@pytest.mark.parametrize("number", range(len(FACTORIES)))
def test_twenty_kills(tmp_path: Path, number: int) -> None:
    """Five in a row of one run each, at random times, and each is gone on with: in the end all
    units are made, and the log is that of a run that was never killed."""
    words = (*FACTORIES[number], "--seed", number)
    whole = tmp_path / "whole.log"
    assert spawn("run", *words, "--log", whole, "-q").status == 0
    came = killed_and_gone_on(tmp_path, words, 5, Random(number), whole.stat().st_size)
    assert ticks_of(tmp_path / "run.log") == ticks_of(whole)
    print(number, read_log(whole).time[-1], came)
