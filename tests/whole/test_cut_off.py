"""Runs that are cut off say so wherever they are told of: in the log, the monitor's verdict, the
report, JSON and the exit status. Two runs do not write one file, and what finds no room on the disk
is named."""

from __future__ import annotations

import json
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from factory.apps.log import LogWriter, read_log
from factory.engine.record.ending import CutOff
from factory.engine.record.state import State
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.support.claim import claimed, is_claimed
from factory.support.errors import InputError, MissingError
from factory.support.gl import probe
from factory.support.pictures.video import VideoFile
from tests.command_line import Terminal, started
from tests.layout_values import paper_layout
from tests.paths import PAPER, ROOT, files_in
from tests.report_values import Page
from tests.waiting import grown


@contextmanager
def running(log: Path, size: int = 30_000) -> Iterator[subprocess.Popen[str]]:
    """A run in a process of its own, whose log has grown to so many bytes."""
    words = ["run", PAPER, "--units", 10**6, "--log", log, "--json"]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with started(*words, **pipes) as process:
        grown(log, size, process)
        yield process


@pytest.fixture(scope="module")
def killed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The log of a run of 1,000,000 units that was killed; not to be written."""
    log = tmp_path_factory.mktemp("killed") / "run.log"
    with running(log, 200_000) as process:
        process.kill()
        process.communicate(timeout=60)
    return log


def cut_off(log: Path) -> CutOff:
    """How far the run in a log came, which was cut off."""
    found = read_log(log)
    assert found.cut_off is not None
    assert found.cut_off.t == (found.time[-1] if len(found) else 0)
    assert found.cut_off.products == (found.delivered[-1] if len(found) else 0)
    return found.cut_off


def assert_told(run: Terminal, log: Path, html: Path) -> None:
    """By the monitor and by the report, as text and as JSON, with status 1."""
    cut = cut_off(log)
    assert str(cut) == f"cut off at {cut.t:.2f} s: {cut.products} of {cut.units} units"
    told = run("monitor", log)
    assert told.status == 1
    assert f"consistent with the net up to its end, {cut}\n" in told.out
    assert f"CutOff '{log}' is {cut.with_cause}\n" in told.err
    document = run("monitor", log, "--json")
    assert document.status == 1 and document.json["refines_net"]
    assert document.json["cut_off"] == cut.as_json()
    told = run("report", log, "-o", html, "--json")
    assert told.status == 1 and told.json["cut_off"] == cut.as_json()
    assert cut.with_cause in told.err
    words = Page(html.read_text("utf-8")).words
    assert f"C{cut.with_cause[1:]}." in words and f"✗ cut off at {cut.t:.2f} s" in words
    assert words.index(f"C{cut.with_cause[1:]}.") < words.index("Replay")
    assert not any("✓ follows the net" in text for text in words)


def test_a_signal(run: Terminal, out: Path) -> None:
    log = out / "run.log"
    with running(log) as process:
        process.send_signal(signal.SIGINT)
        answer, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert read_log(log).complete and len(read_log(log)) > 10
    assert list(files_in(out)) == ["run.log"] and "Traceback" not in errors
    cut = cut_off(log)
    assert (cut.units, cut.code, cut.message) == (10**6, "Interrupted", "stopped by the user")
    (error,) = json.loads(answer)["errors"]
    assert error["code"] == "Interrupted" and f"factory run --resume {log}" in error["hint"]
    assert error["message"] == f"stopped by the user, {cut}" and error["message"] in errors
    assert_told(run, log, out / "a.html")


def test_an_error_of_another_observer(out: Path) -> None:
    log, simulation = out / "run.log", Simulation(paper_layout(), RunRequest(units=1))

    def fail(state: State) -> None:
        raise RuntimeError("no more")

    with pytest.raises(RuntimeError), LogWriter(log, simulation) as writer:
        simulation.run([writer.observe, fail])
    assert read_log(log).complete
    assert (cut_off(log).code, cut_off(log).message) == ("Internal", "RuntimeError: no more")


KILLED_AT_ONCE = """
import os, signal, sys
from factory.apps.log import LogWriter
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
import factory
layout = factory.lay_out(factory.compile(factory.load_pag("examples/paper.pag")))
simulation = Simulation(layout, RunRequest(units=20))
def kill(state):
    if state.time > 0.3:
        os.kill(os.getpid(), signal.SIGKILL)
with LogWriter(sys.argv[1], simulation) as writer:
    simulation.run([writer.observe, kill])
"""


def test_a_run_killed_in_its_first_second_is_not_of_the_ideal_world(
    run: Terminal, out: Path
) -> None:
    log = out / "run.log"
    done = subprocess.run([sys.executable, "-c", KILLED_AT_ONCE, log], cwd=ROOT)
    assert done.returncode == -signal.SIGKILL
    cut = cut_off(log)
    assert str(cut) == "cut off at 0.00 s: 0 of 20 units" and "killed" in cut.message
    for words in (["monitor", log], ["report", log, "-o", out / "a.html"]):
        done = run(*words, "--json")
        assert (done.status, done.codes) == (2, ["BadLog"])
        message = done.json["errors"][0]["message"]
        assert message == f"the log is cut off before its first simulated second: {cut.message}"
    assert list(files_in(out)) == ["run.log"]


def test_two_runs_do_not_write_one_film(out: Path) -> None:
    path = out / "a.mp4"
    pixels = np.zeros((48, 64, 3), np.uint8)
    with VideoFile(path, (64, 48), 10) as film:
        film.write(pixels)
        with pytest.raises(InputError, match="is being written by another run"):
            VideoFile(path, (64, 48), 10)
        assert is_claimed(path)
    assert not is_claimed(path) and path.stat().st_size > 500
    with VideoFile(path, (64, 48), 10) as film:
        film.write(pixels)


def test_what_is_no_file_is_not_claimed(out: Path) -> None:
    for _ in range(2):
        with claimed(Path("/dev/null")) as one, claimed(Path("/dev/null")) as other:
            assert one.write(b"a") == other.write(b"b") == 1
    assert not is_claimed(Path("/dev/null")) and not is_claimed(out / "nothing")


def with_room(room: int, *words: object) -> subprocess.CompletedProcess[str]:
    """A command that can write so many bytes into each file."""
    return subprocess.run(
        [sys.executable, "-m", "factory", *(str(word) for word in words)],
        cwd=ROOT,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (room, room)),
        capture_output=True,
        text=True,
        timeout=120,
    )


@pytest.mark.parametrize(
    ("words", "name"),
    [
        (["run", "--log"], "a.log"),
        (["build", "--mjcf"], "a.xml"),
        (["export", "--format", "pnml", "-o"], "a.pnml"),
        (["report", "--units", 1, "-o"], "a.html"),
        (["render", "--size", "320x240", "-o"], "a.png"),
    ],
    ids=["log", "build", "export", "report", "still"],
)
def test_what_has_no_room_is_named(out: Path, words: list[object], name: str) -> None:
    if "--size" in words:
        try:
            probe()
        except MissingError:
            pytest.skip("no GL here")
    room = {"a.log": 2000, "a.html": 300_000, "header.mp4": 100}.get(name, 8000)
    done = with_room(room, words[0], PAPER, *words[1:], out / name, "-q")
    assert done.returncode == 2
    assert name in done.stderr and "File too large" in done.stderr
    assert "BadFile" in done.stderr and "Traceback" not in done.stderr
    assert list(files_in(out)) == (["a.mp4"] if name == "a.mp4" else [])


def test_a_device_without_room_is_named(run: Terminal) -> None:
    done = run("run", PAPER, "--log", "/dev/full", "--json")
    assert (done.status, done.codes) == (2, ["BadFile"])
    told = "'/dev/full' cannot be written: No space left on device"
    assert done.json["errors"][0]["message"] == told
    for words in (["check", PAPER], ["check", PAPER, "--json"], ["--version"]):
        command = [sys.executable, "-m", "factory", *map(str, words)]
        with open("/dev/full", "w") as full:
            said = subprocess.run(command, cwd=ROOT, stdout=full, stderr=subprocess.PIPE, text=True)
        assert said.returncode == 2
        assert said.stderr.startswith("BadFile what is printed: No space left on device\n")


def test_the_demo_leaves_the_checkout_clean() -> None:
    """What it writes is ignored by git, and tracked by name no more."""
    if shutil.which("git") is None or not os.path.exists(ROOT / ".git"):
        pytest.skip("no git checkout")
    text = (ROOT / "Makefile").read_text("utf-8")
    written = set(re.findall(r"renders/\w+\.\w+", text))
    assert written >= {"renders/paper.mp4", "renders/paper.png"}
    listed = ["git", "ls-files", "renders"]
    tracked = subprocess.run(listed, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert tracked.split() == ["renders/.gitkeep"]
    for name in written:
        assert subprocess.run(["git", "check-ignore", "-q", name], cwd=ROOT).returncode == 0, name
