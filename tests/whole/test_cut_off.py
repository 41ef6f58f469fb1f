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
from factory.apps.report import page, recording_of
from factory.apps.runs.executing import carry_out
from factory.engine.record.ending import CutOff
from factory.engine.record.state import State
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.film.video import VideoFile
from factory.support.claim import claimed, is_claimed
from factory.support.errors import InputError, MissingError
from factory.support.gl import probe
from tests.apps.log.test_log import block_ends
from tests.apps.log.test_log_damage import put_together, taken_apart
from tests.command_line import Terminal, started
from tests.layout_values import paper_layout
from tests.paths import PAPER, ROOT, files_in
from tests.report_values import EVIL, Page
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


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The log of a run that made its 2 units; not to be written."""
    path = tmp_path_factory.mktemp("whole") / "run.log"
    simulation = Simulation(paper_layout(), RunRequest(units=2))
    carry_out(simulation, True, None, [lambda: LogWriter(path, simulation)])
    return path


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


# --- how a run may end ----------------------------------------------------------------------------


def test_a_run_that_makes_its_units_is_not_cut_off(run: Terminal, whole: Path, out: Path) -> None:
    log = read_log(whole)
    assert log.complete and log.cut_off is None
    done = run("monitor", whole)
    assert done.status == 0 and not done.err
    assert done.out.endswith("; consistent with the net\nthe run succeeded\n")
    assert run("monitor", whole, "--json").json["cut_off"] is None
    assert run("report", whole, "-o", out / "a.html").status == 0
    words = Page((out / "a.html").read_text("utf-8")).words
    assert "✓ follows the net" in words and not any("cut off" in text.lower() for text in words)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=lambda n: n.name)
def test_a_signal(run: Terminal, out: Path, number: signal.Signals) -> None:
    log = out / "run.log"
    with running(log) as process:
        process.send_signal(number)
        answer, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert read_log(log).complete and len(read_log(log)) > 10
    assert list(files_in(out)) == ["run.log"] and "Traceback" not in errors
    cut = cut_off(log)
    assert (cut.units, cut.code, cut.message) == (10**6, "Interrupted", "stopped by the user")
    (error,) = json.loads(answer)["errors"]
    assert error["code"] == "Interrupted" and f"factory run --resume {log}" in error["hint"]
    assert error["message"] == f"stopped by the user, {cut}" and error["message"] in errors
    if number is signal.SIGTERM:
        assert_told(run, log, out / "a.html")


def test_a_killed_run(run: Terminal, killed: Path, out: Path) -> None:
    assert not read_log(killed).complete
    cut, size = cut_off(killed), killed.stat().st_size
    assert cut.code == "BadLog" and re.search(rf"the log ends at byte {size}\b", cut.message)
    assert_told(run, killed, out / "a.html")


def test_the_longest_time(run: Terminal, out: Path) -> None:
    log = out / "run.log"
    words = "run", PAPER, "--units", 50, "--max-time", 1.5, "--monitor", "--log", log
    done = run(*words)
    assert done.status == 1
    assert f"consistent with the net up to its end, {cut_off(log)}\n" in done.out
    assert cut_off(log).t == pytest.approx(1.5, abs=0.011)
    assert cut_off(log).code == "Timeout" and "r3 in weld(sub2)" in cut_off(log).message
    assert_told(run, log, out / "a.html")
    document = run(*words, "--json").json
    assert document["cut_off"] == cut_off(log).as_json()
    assert run("run", PAPER, "--json").json["cut_off"] is None


def test_a_stall(run: Terminal, out: Path) -> None:
    """Planted fault: robot r5's drive does nothing."""
    simulation = Simulation(paper_layout(), RunRequest(units=3))
    m = simulation.physical.m
    m.actuator_biasprm[4, 1:3] = m.actuator_gaintype[4] = m.actuator_gainprm[4] = 0.0
    log = out / "run.log"
    carry_out(simulation, True, None, [lambda: LogWriter(log, simulation)])
    assert cut_off(log).code == "Stalled" and "nothing fired for" in cut_off(log).message
    done = run("monitor", log)
    assert done.status == 1 and "Altered: 'actuator_biasprm' of r5/drive is 0" in done.out
    assert cut_off(log).message in done.out
    assert run("report", log, "-o", out / "a.html").status == 1
    words = Page((out / "a.html").read_text("utf-8")).words
    assert f"C{cut_off(log).with_cause[1:]}." in words
    # what was fired is a beginning of what the net allows: it is the machine that is another
    assert "✗ bodies differ" in words
    assert any(one.startswith("The record of firings refines the net.") for one in words)


def test_an_error_of_another_observer(out: Path) -> None:
    log, simulation = out / "run.log", Simulation(paper_layout(), RunRequest(units=1))

    def fail(state: State) -> None:
        raise RuntimeError("no more")

    with pytest.raises(RuntimeError), LogWriter(log, simulation) as writer:
        simulation.run([writer.observe, fail])
    assert read_log(log).complete
    assert (cut_off(log).code, cut_off(log).message) == ("Internal", "RuntimeError: no more")


def test_a_log_that_does_not_say_what_ended_its_run(whole: Path, out: Path) -> None:
    """Those of older versions; whether the run was cut off, its products tell."""
    header, blocks = taken_apart(whole)
    plain = [*blocks[:-1], (b"E", {})]
    assert read_log(put_together(out / "a.log", header, plain)).cut_off is None
    cut = cut_off(put_together(out / "b.log", {**header, "units": 5}, plain))
    assert (cut.products, cut.units, cut.code, cut.message) == (2, 5, "", "")
    assert cut.with_cause == str(cut)


def test_what_ended_a_run_is_text(whole: Path, out: Path) -> None:
    header, blocks = taken_apart(whole)
    texts = {"code": EVIL, "message": EVIL}
    end = {name: np.frombuffer(text.encode(), "u1") for name, text in texts.items()}
    log = put_together(out / "evil.log", header, [*blocks[:-1], (b"E", {**blocks[-1][1], **end})])
    found, usual = Page(page(recording_of(log))), Page(page(recording_of(whole)))
    assert len(found.tags) == len(usual.tags) + 3
    assert {tag for tag, _ in found.tags} == {tag for tag, _ in usual.tags}
    assert found.code == usual.code and any(EVIL in words for words in found.words)
    bad = {name: np.frombuffer(b"\xff", "u1") for name in texts}
    put_together(log, header, [*blocks[:-1], (b"E", bad)])
    with pytest.raises(InputError, match="BadLog"):
        read_log(log)


# --- files that end too early ---------------------------------------------------------------------


def test_a_file_cut_at_any_byte_is_never_judged_as_whole(
    run: Terminal, whole: Path, out: Path
) -> None:
    data, log = whole.read_bytes(), out / "cut.log"
    header, model, *ticks, last = block_ends(data)
    assert last == len(data)
    for at in (20, header - 1, header, model - 1, model, ticks[0] - 1):
        log.write_bytes(data[:at])
        done = run("monitor", log, "--json")
        assert (done.status, done.codes) == (2, ["BadLog"]), at
        message = done.json["errors"][0]["message"]
        assert "ideal" not in message
        assert f"byte {at}" in message, message
        assert run("report", log, "-o", out / "a.html").status == 2
    for at in (ticks[0], ticks[0] + 3, ticks[1] - 1, ticks[-1], last - 1):
        log.write_bytes(data[:at])
        cut = cut_off(log)
        assert cut.code == "BadLog" and f"ends at byte {at}" in cut.message
        begins = max(end for end in ticks if end <= at)
        assert ("killed" in cut.message) == (at == begins)
        assert at == begins or f"block that begins at byte {begins}" in cut.message
        assert run("monitor", log).status == 1
    assert_told(run, log, out / "a.html")


def test_a_damaged_block_is_told_where_it_is(run: Terminal, whole: Path, out: Path) -> None:
    data, log = bytearray(whole.read_bytes()), out / "bad.log"
    _, _, first, second, *_ = block_ends(bytes(data))
    data[first + 30] ^= 0x40
    log.write_bytes(data)
    assert second < len(data)
    found = f"the log is damaged in the block that begins at byte {first} of {len(data)}"
    assert cut_off(log).message == found
    assert_told(run, log, out / "a.html")


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


def test_what_is_made_of_a_log_is_made_with_a_warning(
    run: Terminal, killed: Path, out: Path
) -> None:
    told = f"CutOff warning: '{killed}' is {cut_off(killed).with_cause}"
    csv, png = out / "a.csv", out / "a.png"
    commands: list[list[object]] = [
        ["export", killed, "--format", "csv", "-o", csv],
        ["analyze", PAPER, "--measured", killed],
    ]
    try:
        probe()
        commands.append(["render", killed, "-o", png, "--size", "64x64"])
    except MissingError:
        pass
    for words in commands:
        done = run(*words)
        assert done.status == 0 and done.err.count(told) == 1, done
        assert not run(*words, "-q").err
        done = run(*words, "--json")
        assert not done.err and done.json["cut_off"] == cut_off(killed).as_json()


# --- one file, one run ----------------------------------------------------------------------------


def test_two_runs_do_not_write_one_log(run: Terminal, out: Path) -> None:
    """The second is refused and leaves the first one's log alone; once that run is gone, however
    it went, the name is free."""
    log = out / "run.log"
    with running(log) as process:
        before = log.stat().st_size
        for words in (["--log", log], ["--video", out / "a.mp4", "--log", log]):
            done = run("run", PAPER, *words, "--json")
            assert (done.status, done.codes) == (2, ["BadFile"])
            assert done.json["errors"][0]["message"] == f"'{log}' is being written by another run"
        assert log.stat().st_size >= before and not (out / "a.mp4").exists()
        with pytest.raises(InputError, match="is being written by another run"):
            LogWriter(log, Simulation(paper_layout(), RunRequest("ideal")))
        assert log.stat().st_size >= before
        assert "its run is still in progress" in cut_off(log).message
        assert run("monitor", log).status == 1
        process.kill()
        process.communicate(timeout=60)
    assert "killed" in cut_off(log).message
    assert run("run", PAPER, "--log", log, "-q").status == 0
    assert read_log(log).cut_off is None


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


# --- full disks -----------------------------------------------------------------------------------


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


def test_a_log_that_has_no_more_room_is_closed_and_says_so(run: Terminal, out: Path) -> None:
    log = out / "run.log"
    done = with_room(60_000, "run", PAPER, "--units", 50, "--log", log, "--json")
    assert done.returncode == 2
    (error,) = json.loads(done.stdout)["errors"]
    assert error["code"] == "BadFile"
    assert error["message"] == f"'{log}' cannot be written: File too large"
    assert error["message"] in done.stderr
    kept = read_log(log)
    assert kept.complete and len(kept) > 100
    assert (cut_off(log).code, cut_off(log).message) == ("BadFile", error["message"])
    assert_told(run, log, out / "a.html")


@pytest.mark.parametrize(
    ("words", "name"),
    [
        (["run", "--log"], "a.log"),
        (["build", "--mjcf"], "a.xml"),
        (["export", "--format", "pnml", "-o"], "a.pnml"),
        (["report", "--units", 1, "-o"], "a.html"),
        (["run", "--units", 9, "--size", "320x240", "--video"], "a.mp4"),
        (["render", "--size", "320x240", "-o"], "header.mp4"),
        (["render", "--size", "320x240", "-o"], "a.png"),
    ],
    ids=["log", "build", "export", "report", "film", "header", "still"],
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


# --- the demo -------------------------------------------------------------------------------------


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
