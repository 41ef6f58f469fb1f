"""Progress: a bar on a terminal, lines elsewhere, and signals that are heard meanwhile."""

from __future__ import annotations

import io
import os
import signal
import subprocess
import sys
import threading
from functools import partial
from itertools import count
from pathlib import Path
from threading import Barrier, Event
from types import SimpleNamespace

import pytest

from factory.support import progress
from factory.support.interruption import side_by_side
from factory.support.progress import Progress, Waiting
from tests.paths import ROOT
from tests.screen import Screen
from tests.waiting import left_alone, until


def watch(progress: Progress) -> None:
    with progress:
        for n in range(4):
            progress.observe(SimpleNamespace(time=float(n), made=n))


def test_a_long_run_writes_a_line_now_and_then_without_a_terminal(monkeypatch) -> None:
    stream = io.StringIO()
    monkeypatch.setattr(sys, "stderr", stream)
    clock = count(0, 20)
    monkeypatch.setattr(progress, "perf_counter", lambda: next(clock))
    watch(Progress(3, False, 5.0))
    first, second = stream.getvalue().splitlines()
    assert first == "1 of 3 units, 1.0 s simulated, 0.025 x real time, at most 2:40 min left"
    assert second.startswith("3 of 3 units, 3.0 s simulated")


def test_it_shows_units_and_speed(monkeypatch) -> None:
    stream = Screen()
    monkeypatch.setattr(sys, "stderr", stream)
    watch(Progress(3))
    assert "3/3" in stream.getvalue() and "real time" in stream.getvalue()


@pytest.mark.parametrize(("stream", "said"), [(Screen(), "at work")])
def test_what_takes_long_is_said(monkeypatch, stream, said: str) -> None:
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setattr(progress, "LINES", 0.01)
    with Waiting("at work"):
        until(lambda: said in stream.getvalue())
    with Waiting("quiet work", quiet=True), Waiting("other work"):
        until(lambda: "other work" in stream.getvalue())
    assert "quiet" not in stream.getvalue()


@pytest.mark.parametrize(("done", "heard"), [("awaited(work)", True), ("work()", False)])
def test_a_signal_is_heard_while_the_engine_works(tmp_path: Path, done: str, heard: bool) -> None:
    """The work computes for minutes outside the interpreter, as the engine does. The second case
    shows that a signal then waits without `awaited`."""
    script = tmp_path / "works.py"
    script.write_text(
        "from hashlib import pbkdf2_hmac\n"
        "from factory.support.interruption import awaited\n"
        "def work():\n    pbkdf2_hmac('sha256', b'x', b'y', 500_000_000)\n"
        f"try:\n    print('begun', flush=True)\n    {done}\n"
        "except KeyboardInterrupt:\n    print('heard', flush=True)\n"
    )
    command = [sys.executable, str(script)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout is not None and child.stdout.readline() == "begun\n"
        left_alone(0.5)
        child.send_signal(signal.SIGINT)
        if heard:
            assert child.stdout.readline() == "heard\n"
            assert child.wait(10) == 0
        else:
            with pytest.raises(subprocess.TimeoutExpired):
                child.wait(2)
            child.kill()


def test_no_work_is_begun_after_a_stop(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is under way ends by itself."""
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    others, both, stopped, begun = {*threading.enumerate()}, Barrier(3), Event(), list[int]()

    def work(number: int) -> None:
        begun.append(number)
        both.wait(60)
        stopped.wait(60)

    def stop(*_: int) -> None:
        both.wait(60)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        side_by_side([partial(work, number) for number in range(9)], stop)
    ours = {*threading.enumerate()} - others
    stopped.set()
    for thread in ours:
        thread.join(60)
    assert sorted(begun) == [0, 1]


STOPPED = """
import signal, sys
class Finder:
    told = False
    def find_spec(self, name, path=None, target=None):
        if name == sys.argv[1] and not self.told:
            self.told = True
            signal.raise_signal(signal.SIGINT)
sys.meta_path.insert(0, Finder())
"""
"""A signal comes while a module is imported: this begins a program to which that happens."""

ENGINE = f"{STOPPED}from factory.support.engine import mujoco\nraise SystemExit(5)"
EXTRA = (
    f"{STOPPED}from factory.support.version import optional\n"
    "optional('stops', 'it', 'this', 'extra')\nraise SystemExit(5)"
)


def stopped(tmp_path: Path, program: str, name: str) -> subprocess.CompletedProcess[str]:
    """What a program leaves that a signal comes to while it imports a module of a name, where what
    imports that may swallow it: `mujoco`, which was then imported again, and what goes on without a
    package, as trimesh does."""
    (tmp_path / "stops.py").write_text("try:\n    import missing\nexcept BaseException:\n    pass")
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)])}
    command = [sys.executable, "-c", program, name]
    return subprocess.run(command, env=environment, capture_output=True, text=True)


@pytest.mark.parametrize(
    ("program", "name"),
    [
        pytest.param(ENGINE, "mujoco._structs", id="the engine"),
        pytest.param(EXTRA, "missing", id="an extra"),
    ],
)
def test_a_signal_while_something_is_imported(tmp_path: Path, program: str, name: str) -> None:
    done = stopped(tmp_path, program, name)
    assert done.returncode == -signal.SIGINT, done.stderr
