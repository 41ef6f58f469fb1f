"""Sweeps: the grid, the rows, interruptions and kills, and the figures of the summary."""

from __future__ import annotations

import json
import os
import signal
import socket
import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass, field, fields
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from factory.apps.fidelity import measure
from factory.apps.sweep import Recipe, points, pool, read_axes, summarise
from factory.apps.sweep.grid import Value
from factory.apps.sweep.pool import over_processes
from factory.apps.sweep.store import COLUMNS, Store
from factory.apps.sweep.sweeping import Tally, outcomes_of, sweep
from factory.apps.sweep.work import FIGURES, Outcome
from factory.pipeline import read
from factory.support.errors import Diagnostic, InputError, RunError
from factory.support.settings import Settings
from tests.command_line import Terminal
from tests.deadly import Deadly
from tests.paths import PAPER, ROOT, files_in
from tests.waiting import until

FACTORY = [sys.executable, "-m", "factory"]


def recipe_of(kind: type[Recipe] = Recipe, **fixed: Value) -> Recipe:
    project = read(PAPER)
    settings = {one.name: one.default for one in fields(Settings)}
    return kind(project.plain, project.product, {**settings, "world": "ideal", **fixed})


def rows_of(path: Path, columns: str = "point") -> list[tuple[Any, ...]]:
    connection = sqlite3.connect(path)
    try:
        return connection.execute(f"SELECT {columns} FROM runs ORDER BY rowid").fetchall()
    finally:
        connection.close()


def has_rows(path: Path, least: int) -> bool:
    """Whether there are at least so many rows."""
    try:
        return len(rows_of(path)) >= least
    except sqlite3.OperationalError:
        return False


def test_a_run_that_fails_is_a_row_with_its_reason(
    run: Terminal, tmp_path: Path, here: None
) -> None:
    database = tmp_path / "r.db"
    words = ["sweep", PAPER, "--world", "ideal", "-o", database, "--vary"]
    done = run(*words, "clearance=0.02,5", "--max-time", "30", "--floor", "4x4", "--summary")
    assert done.status == 1
    (good, bad) = rows_of(database, "clearance, status, reason, sim_time_s")
    assert good[:3] == (0.02, "done", None) and good[3] > 0
    assert bad[1] == "failed" and bad[2].startswith("Layout the factory takes ") and bad[3] is None
    assert "1 failed: Layout" in done.err
    database.unlink()
    done = run(*words, "seed=0:2", "--max-time", "1")
    assert done.status == 1
    reason = "Timeout not finished after 1.00 s of simulated time; "
    for row in rows_of(database, "status, reason, sim_time_s"):
        assert row[0] == "failed" and row[1].startswith(reason) and row[2] == 1.0
    assert run(*words, "seed=0:3", "--max-time", "1", "--json").json["there"] == 2
    retried = run(*words, "seed=0:3", "--max-time", "1", "--json", "--retry").json
    assert (retried["there"], retried["there_failed"], retried["failed"]) == (0, 0, 3)


def test_two_sweeps_may_begin_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One creates the tables after the other has opened the database."""
    database, recipe = tmp_path / "r.db", recipe_of()
    other = recipe.identity(read_axes(["units=1"]))
    begun = []

    class Late(sqlite3.Connection):
        def execute(self, sql: str, *values: Any) -> sqlite3.Cursor:
            if sql == "BEGIN EXCLUSIVE" and not begun:
                begun.append(sql)
                Store(database, other).close()
            return super().execute(sql, *values)

    monkeypatch.setattr(sqlite3, "connect", partial(sqlite3.connect, factory=Late))
    mine = recipe.identity(read_axes(["seed=0:2"]))
    if mine == other:
        with Store(database, mine) as kept:
            assert kept.points("done") == set()
    else:
        with pytest.raises(InputError, match="it holds another sweep: varied units there, seed"):
            Store(database, mine)
    assert begun


def test_files_of_others_are_left_alone(tmp_path: Path, run: Terminal, here: None) -> None:
    text, other = tmp_path / "text", tmp_path / "other.db"
    text.write_text("no database at all, but long enough to be taken for one " * 20)
    with sqlite3.connect(other) as connection:
        connection.execute("CREATE TABLE runs (x)")
    connection.close()
    before = files_in(tmp_path)
    for path, message in (
        (text, "it cannot be used: file is not a database"),
        (other, "it is the database of another program"),
    ):
        for words in (["-o", path, PAPER, "--vary", "seed=0:2"], [path, "--summary"]):
            refused = run("sweep", *words)
            assert (refused.status, refused.err.splitlines()[0]) == (
                2,
                f"BadFile {path}: {message}",
            )
    assert files_in(tmp_path) == before


@pytest.mark.parametrize(
    "change",
    [
        "ALTER TABLE runs DROP COLUMN handoffs",
        "UPDATE runs SET point = CAST(x'ff' AS TEXT) WHERE seed = 1",
    ],
)
def test_a_damaged_database_is_refused(
    run: Terminal, tmp_path: Path, here: None, change: str
) -> None:
    """By the summary; by a sweep that would continue it, where it reads what is damaged."""
    database = tmp_path / "r.db"
    words = [PAPER, "--world", "ideal", "--units", "1", "-o", database]
    words += ["--vary", "seed=0:2", "--vary", "speed=0.5"]
    assert run("sweep", *words, "-q").status == 0
    with sqlite3.connect(database) as connection:
        connection.execute(change)
    connection.close()
    refused = run("sweep", database, "--summary")
    assert refused.status == 2
    assert refused.err.startswith(f"BadFile {database}: it cannot be used: ")
    assert "if the database is damaged, delete it and run the sweep again" in refused.err
    continued = run("sweep", *words, "--json")
    assert continued.status == 0 or continued.codes == ["BadFile"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([PAPER, "-o", "r.db"], "Usage there is nothing to vary"),
        (["-o", "r.db", "--vary", "seed=1"], "Usage there is no FILE.pag"),
        ([PAPER, "--vary", "seed=1"], "Usage there is no database for the results"),
        (["--summary"], "Usage there is no database"),
        (["r.db", "--summary"], "BadFile r.db: there is no such file"),
        ([PAPER, "-o", "r.db", "--vary", "seed=1", "--seed", "2"], "both given and varied"),
        ([PAPER, "-o", "r.db", "--vary", "world=ideal", "--fuse"], "has no bodies that could"),
    ],
)
def test_bad_command_lines_write_nothing(
    run: Terminal,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    words: list[object],
    message: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    refused = run("sweep", *words)
    assert refused.status == 2
    assert message in refused.err
    assert not files_in(tmp_path)


def test_a_killed_worker_loses_the_run_under_way_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pool, "TRIES", 2)
    recipe = recipe_of()
    deadly = Deadly(recipe.factory, recipe.product, recipe.fixed, mark=tmp_path / "mark")
    grid = list(points(read_axes(["seed=2,0,3,1,4:8"])))
    found = {dict(o.point)["seed"]: o for o in outcomes_of(deadly, grid, 2)}
    assert sorted(found) == list(range(8))
    assert found[1].reason == "Killed the process died in 2 tries (exit status -9)"
    assert found[2].reason == "" and found[2].tries == 2
    assert all(found[n].reason == "" and found[n].tries == 1 for n in (0, 3, 4, 5, 6, 7))


def test_failed_runs_count_and_nothing_more(tmp_path: Path) -> None:
    recipe, axes = recipe_of(), read_axes(["seed=0:3"])
    database = tmp_path / "r.db"
    with Store(database, recipe.identity(axes)) as store:
        for seed, reason, cycle in ((0, "", 2.0), (1, "Stalled so", 99.0), (2, "Stalled so", None)):
            outcome = Outcome((("seed", seed),), reason, {"cycle_time_s": cycle})
            store.add(outcome, recipe.at(outcome.point))
    found = summarise(database)
    (group,) = found.groups
    assert (group.done, group.failed) == (1, 2)
    assert found.reasons == {"Stalled so": 2}
    told = group.figures["cycle_time_s"]
    assert (told.n, told.mean, told.deviation, told.confidence_low) == (1, 2.0, None, None)


def test_columns_are_named_once() -> None:
    assert set(FIGURES) < set(COLUMNS)
    assert {"seed", "jitter", "world", "clearance", "reason", "row_time_s"} < set(COLUMNS)


def squared(number: int) -> int:
    if number < 0:
        raise InputError(Diagnostic("BadValue", f"{number} is below 0"))
    return number**2


def test_results_come_with_the_numbers_of_their_items() -> None:
    items = [5, 3, 9, 0]
    with closing(over_processes(squared, items, 2)) as results:
        found = {one.number: one.result for one in results}
    assert found == {n: item**2 for n, item in enumerate(items)}


def test_an_error_of_the_work_is_raised() -> None:
    with pytest.raises(InputError, match="-1 is below 0"):
        list(over_processes(squared, [2, -1], 1))


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


def test_the_time_of_workers_is_divided_into_run_loops_and_the_rest() -> None:
    tally, (point,) = Tally(3, 0), points(read_axes(["seed=1"]))
    tally.count(Outcome(point, figures={"wall_time_s": 2.0}, row_time_s=3.0))
    tally.count(Outcome(point, figures={"wall_time_s": 1.0}, row_time_s=1.0))
    tally.count(Outcome(point, "it died", row_time_s=7.0))
    assert (tally.loops_time_s, tally.rows_time_s, tally.overhead) == (3.0, 4.0, 0.25)


@pytest.mark.parametrize(
    ("text", "example"),
    [
        ("timestep=0.001,x", "--vary timestep=auto,0.002"),
        ("substeps=2,x", "--vary substeps=1,5"),
        ("wip=", "--vary wip=1:4"),
    ],
)
def test_the_hint_is_an_example_of_the_key(text: str, example: str) -> None:
    with pytest.raises(InputError) as caught:
        read_axes([text])
    assert caught.value.diagnostics[0].hint == f"for example {example}"
