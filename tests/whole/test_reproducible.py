"""The same seed on the same machine gives the same run, bit for bit: in another process, with other
thread counts and hash seeds, beside another run, and whoever looks on."""

from __future__ import annotations

import hashlib
import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from factory.apps.log import MAGIC, LogWriter, read_log
from factory.apps.log.blocks import LENGTH
from factory.support.errors import MissingError
from factory.support.gl import probe
from tests.paths import PAPER, ROOT
from tests.simulation_values import digest, ready, reproduced

DIGEST = """
import sys
from tests.simulation_values import digest, reproduced
print(digest(reproduced()))
"""

LOGGED = """
import sys
from factory.apps.log import LogWriter
from tests.simulation_values import reproduced
made = reproduced(1000000)
def tell(state):
    print(state.time, flush=True)
with LogWriter(sys.argv[1], made, command=["factory"]) as log:
    made.run([log.observe, tell])
"""


@pytest.fixture(scope="module")
def here() -> str:
    """What this process makes of it."""
    return digest(reproduced())


@pytest.mark.parametrize(
    "environment",
    [
        {"PYTHONHASHSEED": "4711", "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
        {
            "PYTHONHASHSEED": "0",
            **dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "7"),
        },
    ],
    ids=["one thread", "seven threads"],
)
def test_another_process_gives_the_same(here: str, environment: dict[str, str]) -> None:
    done = subprocess.run(
        [sys.executable, "-c", DIGEST],
        cwd=ROOT,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == here


def test_a_run_beside_others_gives_the_same(here: str) -> None:
    found: list[str] = []
    threads = [
        threading.Thread(target=lambda: found.append(digest(reproduced()))) for _ in range(3)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == [here] * 3


def test_a_log_changes_nothing_and_is_the_same_every_time(here: str, tmp_path: Path) -> None:
    bodies = []
    for number in range(2):
        path, made = tmp_path / f"{number}.log", reproduced()
        with LogWriter(path, made, command=["factory"]) as log:
            assert digest(made, [log.observe]) == here
        bodies.append(path.read_bytes())
    assert bodies[0] == bodies[1]


def test_a_film_changes_nothing(here: str, tmp_path: Path) -> None:
    try:
        probe()
    except MissingError:
        pytest.skip("no GL here")
    from factory.film import Film, Picture

    made = reproduced()
    with Film(made, tmp_path / "f.mp4", Picture((64, 48)), 2.0) as film:
        assert digest(made, [film.observe]) == here


def test_another_seed_is_another_run(here: str) -> None:
    assert digest(ready("paper", seed=6)) != here


def test_a_log_says_what_made_it(tmp_path: Path) -> None:
    path = tmp_path / "run.log"
    words = ["run", str(PAPER), "--seed", "9", "--world", "ideal", "--log", str(path), "-q"]
    subprocess.run([sys.executable, "-m", "factory", *words], cwd=ROOT, check=True)
    header = read_log(path).header
    assert header["seed"] == 9
    assert header["command"][1:] == words
    assert header["pag"]["sha256"] == hashlib.sha256(Path(PAPER).read_bytes()).hexdigest()
    assert {"python", "mujoco", "numpy"} <= set(header["versions"])


def test_a_killed_run_leaves_a_log_up_to_its_last_second(tmp_path: Path) -> None:
    """kill -9; what is there is what an undisturbed run logs."""
    path = tmp_path / "killed.log"
    with subprocess.Popen(
        [sys.executable, "-c", LOGGED, str(path)], cwd=ROOT, stdout=subprocess.PIPE, text=True
    ) as child:
        assert child.stdout is not None
        for line in child.stdout:
            if float(line) > 6.5:
                break
        os.kill(child.pid, signal.SIGKILL)
        told = [float(line), *map(float, child.stdout.read().split("\n")[:-1])]
    kept = read_log(path)
    assert not kept.complete
    assert told[-1] - 1.02 <= kept.time[-1] <= told[-1] + 0.02

    again = reproduced(1000000)
    with LogWriter(tmp_path / "whole.log", again, command=["factory"]) as log:
        again.run([log.observe], max_time=float(kept.time[-1]) + 0.5)
    whole = read_log(tmp_path / "whole.log")
    count = len(kept)
    assert len(whole) > count > 500
    assert (whole.qpos[:count] == kept.qpos).all() and (whole.qvel[:count] == kept.qvel).all()
    assert whole.events[: len(kept.events)] == kept.events and len(kept.events) > 10
    head = len(MAGIC) + LENGTH.size
    assert (tmp_path / "whole.log").read_bytes()[:head] == path.read_bytes()[:head]
