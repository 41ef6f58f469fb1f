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
from threading import Barrier, Event, get_ident
from types import SimpleNamespace

import pytest

from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.support import progress
from factory.support.interruption import awaited, side_by_side
from factory.support.progress import Progress, Waiting, paced
from tests.examples import without_hands
from tests.paths import ROOT
from tests.screen import Screen
from tests.waiting import left_alone, until


def watch(progress: Progress) -> None:
    with progress:
        for n in range(4):
            progress.observe(SimpleNamespace(time=float(n), made=n))


@pytest.mark.parametrize("stream", [io.StringIO(), Screen()])
def test_it_is_silent_when_quiet(monkeypatch, stream) -> None:
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setattr(progress, "LINES", 0.0)
    watch(Progress(3, True, 5.0))
    assert stream.getvalue() == ""


def test_a_short_run_says_nothing_without_a_terminal(monkeypatch) -> None:
    stream = io.StringIO()
    monkeypatch.setattr(sys, "stderr", stream)
    watch(Progress(3, False, 5.0))
    assert stream.getvalue() == ""


def test_a_long_run_writes_a_line_now_and_then_without_a_terminal(monkeypatch) -> None:
    stream = io.StringIO()
    monkeypatch.setattr(sys, "stderr", stream)
    clock = count(0, 20)
    monkeypatch.setattr(progress, "perf_counter", lambda: next(clock))
    watch(Progress(3, False, 5.0))
    first, second = stream.getvalue().splitlines()
    assert first == "1 of 3 units, 1.0 s simulated, 0.025 x real time, at most 2:40 min left"
    assert second.startswith("3 of 3 units, 3.0 s simulated")


def test_a_slow_run_says_how_slow() -> None:
    assert [paced(factor) for factor in (34.31, 0.1, 0.0876, 0.00412)] == [
        *("34.3", "0.1", "0.088", "0.0041"),
    ]


def test_it_shows_units_and_speed(monkeypatch) -> None:
    stream = Screen()
    monkeypatch.setattr(sys, "stderr", stream)
    watch(Progress(3))
    assert "3/3" in stream.getvalue() and "real time" in stream.getvalue()


@pytest.mark.parametrize(("stream", "said"), [(Screen(), "at work"), (io.StringIO(), "so far")])
def test_what_takes_long_is_said(monkeypatch, stream, said: str) -> None:
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setattr(progress, "LINES", 0.01)
    with Waiting("at work"):
        until(lambda: said in stream.getvalue())
    with Waiting("quiet work", quiet=True), Waiting("other work"):
        until(lambda: "other work" in stream.getvalue())
    assert "quiet" not in stream.getvalue()


@pytest.mark.parametrize("name", ["paper", "gearbox"])
def test_a_run_takes_no_longer_than_expected(name: str) -> None:
    layout = without_hands(name)
    for units in (1, 4):
        made = Simulation(layout, RunRequest("ideal", units))
        assert made.run().sim_time_s <= made.duration <= 2 * made.run().sim_time_s + 5


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


def test_what_fails_in_awaited_work_is_raised() -> None:
    assert awaited(lambda: 7) == 7
    with pytest.raises(ValueError, match="no such"):
        awaited(lambda: int("no such"))


def test_works_are_done_side_by_side_and_given_in_order(monkeypatch: pytest.MonkeyPatch) -> None:
    """Either of two ends only once the other has begun; the third is done by one of their
    threads."""
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    both = Barrier(2)

    def meet(number: int) -> tuple[int, int]:
        both.wait(60)
        return number, get_ident()

    found = side_by_side([partial(meet, 1), partial(meet, 2), lambda: (3, get_ident())])
    assert [number for number, _ in found] == [1, 2, 3]
    assert len({thread for _, thread in found}) == 2
    assert side_by_side([]) == []


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
