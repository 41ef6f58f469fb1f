"""Sweeps on a Dask cluster: what is killed loses no row, and the rows are those of processes."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from factory.apps.fidelity import measure
from factory.apps.sweep import read_axes
from factory.apps.sweep.sweeping import sweep
from factory.pipeline import read
from factory.support.errors import InputError, RunError
from tests.apps.sweep.test_sweep import FACTORY, has_rows, recipe_of, rows_of
from tests.paths import PAPER, ROOT
from tests.waiting import until

SOON = 90.0
RUNS = 40
SWEEP = ["--vary", f"seed=0:{RUNS}", "--jitter", "0.3", "--units", "2", "--world", "ideal"]
SAME = "point, status, reason, sim_time_s, cycle_time_s, transitions_fired"


def free_port() -> int:
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])


@dataclass
class Cluster:
    """A Dask scheduler and workers on loopback, each a process of its own."""

    folder: Path
    port: int = field(default_factory=free_port)
    started: list[subprocess.Popen[bytes]] = field(default_factory=list)

    @property
    def address(self) -> str:
        return f"tcp://127.0.0.1:{self.port}"

    def start(self, *words: str) -> subprocess.Popen[bytes]:
        path = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
        command = [sys.executable, "-m", "dask", *words, "--no-dashboard"]
        env = {**os.environ, "PYTHONPATH": path}
        with (self.folder / f"{len(self.started)}.log").open("wb") as log:
            process = subprocess.Popen(command, cwd=self.folder, env=env, stdout=log, stderr=log)
        self.started.append(process)
        return process

    def scheduler(self) -> subprocess.Popen[bytes]:
        return self.start("scheduler", "--host", "127.0.0.1", "--port", str(self.port), "--no-show")

    def worker(self) -> subprocess.Popen[bytes]:
        return self.start("worker", self.address, "--nthreads", "1", "--no-nanny")


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[Cluster]:
    """A scheduler with two workers."""
    distributed = pytest.importorskip("distributed")
    made = Cluster(tmp_path)
    made.scheduler()
    made.worker()
    made.worker()
    try:
        with distributed.Client(made.address, timeout=SOON, set_as_default=False) as client:
            client.wait_for_workers(2, timeout=SOON)
        yield made
    finally:
        for process in made.started:
            process.kill()
            process.wait()


def by_processes(folder: Path) -> list[tuple[Any, ...]]:
    """The rows of the same sweep by processes of this machine."""
    sweep(recipe_of(jitter=0.3, units=2), read_axes([f"seed=0:{RUNS}"]), folder / "home.db", 2)
    return sorted(rows_of(folder / "home.db", SAME))


def test_a_worker_is_killed(tmp_path: Path, cluster: Cluster) -> None:
    database = tmp_path / "far.db"
    begun = subprocess.Popen(
        [*FACTORY, "sweep", PAPER, "-o", database, *SWEEP, "--on", cluster.address]
    )
    until(lambda: has_rows(database, 3))
    cluster.started[1].kill()
    assert begun.wait(SOON) == 0
    assert sorted(rows_of(database, SAME)) == by_processes(tmp_path)


@pytest.mark.parametrize("victim", ["client", "scheduler"])
def test_the_client_or_the_scheduler_is_killed(
    tmp_path: Path, cluster: Cluster, victim: str
) -> None:
    database = tmp_path / "far.db"
    command = [*FACTORY, "sweep", PAPER, "-o", database, *SWEEP, "--on", cluster.address]
    begun = subprocess.Popen(command, stderr=subprocess.PIPE)
    until(lambda: has_rows(database, 3))
    if victim == "client":
        begun.kill()
        assert begun.wait(SOON) == -signal.SIGKILL
    else:
        for process in cluster.started:
            process.kill()
        _, told = begun.communicate(timeout=SOON)
        assert begun.returncode == RunError.exit_status, told
        assert b"the Dask scheduler was lost" in told
        cluster.scheduler()
        cluster.worker()
    assert len(rows_of(database)) < RUNS
    assert subprocess.run(command, timeout=SOON).returncode == 0
    assert sorted(rows_of(database, SAME)) == by_processes(tmp_path)


def test_a_campaign_has_the_same_figures(cluster: Cluster) -> None:
    layout = read(PAPER).layout
    here, there = (measure(layout, range(2), 2, on=on) for on in (None, cluster.address))
    assert [r.figures for r in here.seeds] == [r.figures for r in there.seeds]


def test_the_points_of_a_front_are_run_there(tmp_path: Path, cluster: Cluster) -> None:
    words = [*FACTORY, "pareto", PAPER, "--validate", "2", "--effort", "3", "--json"]
    here, there = (
        json.loads(subprocess.run([*words, *on], stdout=subprocess.PIPE, timeout=SOON).stdout)
        for on in ((), ("--on", cluster.address))
    )
    assert sum(point["validated"] for point in there["points"]) == 2
    assert there["points"] == here["points"]


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (OSError("Stream is closed"), "cannot report its versions: OSError('Stream is closed')"),
        ({"mujoco": "1.0"}, "has {'mujoco': '1.0'}, not {"),
    ],
)
def test_a_worker_that_is_not_fit(answer: object, message: str) -> None:
    """A worker that dies as it is asked for its versions is not one of another version."""
    from factory.apps.sweep.cluster import check_workers

    client: Any = SimpleNamespace(run=lambda *_, **__: {"tcp://w:1": answer})
    with pytest.raises(RunError) as caught:
        check_workers(client)
    assert f"the worker at tcp://w:1 {message}" in caught.value.diagnostics[0].message


def test_no_address() -> None:
    from factory.apps.sweep.cluster import connected

    with pytest.raises(InputError, match="--on takes the address of a scheduler"):
        connected("tcp://")


def test_no_scheduler_at_the_address(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed")
    from factory.apps.sweep import cluster

    monkeypatch.setattr(cluster, "PATIENCE", "0.3s")
    address = f"tcp://127.0.0.1:{free_port()}"
    with pytest.raises(RunError, match=f"no Dask scheduler answers at {address}"):
        sweep(recipe_of(), read_axes(["seed=0:2"]), tmp_path / "r.db", on=address)
