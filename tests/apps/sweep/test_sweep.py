"""Sweeps: the grid, the rows, interruptions and kills, and the figures of the summary."""

from __future__ import annotations

import random
import signal
import sqlite3
import subprocess
import sys
import threading
from dataclasses import replace
from functools import partial
from pathlib import Path
from subprocess import PIPE
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from factory.apps.sweep import Recipe, points, pool, read_axes, summarise
from factory.apps.sweep.grid import Value
from factory.apps.sweep.store import COLUMNS, Store
from factory.apps.sweep.sweeping import Tally, outcomes_of, sweep
from factory.apps.sweep.work import FIGURES, Outcome, Runner
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.pipeline import read
from factory.support.errors import InputError, RunError
from factory.support.settings import Settings
from tests.command_line import Terminal
from tests.deadly import Deadly, Stillborn
from tests.paths import PAPER, ROOT, files_in
from tests.waiting import until

FACTORY = [sys.executable, "-m", "factory"]
SOON = 90.0


def recipe_of(kind: type[Recipe] = Recipe, **fixed: Value) -> Recipe:
    project = read(PAPER)
    settings = {name: getattr(Settings(), name) for name in Settings.__dataclass_fields__}
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


# The grid


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("seed=0:4", (0, 1, 2, 3)),
        ("seed=5", (5,)),
        ("seed=0:10:4,7,0", (0, 4, 8, 7)),
        ("jitter=0.1,0.3", (0.1, 0.3)),
        ("speed=0.2:0.6:0.1", (0.2, 0.3, 0.4, 0.5)),
        ("speed=1,1.0,1e0", (1.0,)),
        ("world=ideal,mujoco", ("ideal", "mujoco")),
        (" wip = 1 : 3 , 9", (1, 2, 9)),
    ],
)
def test_axes_are_lists_and_ranges(text: str, values: tuple[Value, ...]) -> None:
    (axis,) = read_axes([text])
    assert axis.values == values
    assert [type(value) for value in axis.values] == [type(value) for value in values]


@given(st.integers(0, 50), st.integers(1, 50), st.integers(1, 9))
def test_a_range_is_pythons(start: int, length: int, step: int) -> None:
    (axis,) = read_axes([f"seed={start}:{start + length}:{step}"])
    assert axis.values == tuple(range(start, start + length, step))
    (axis,) = read_axes([f"speed={1 + start / 10}:{1 + (start + length) / 10}:{step / 10}"])
    assert axis.values == tuple(round(1 + n / 10, 9) for n in range(start, start + length, step))


def test_seeds_vary_fastest_and_settings_slowest() -> None:
    axes = read_axes(["seed=0:2", "units=3,4", "clearance=0.02,0.03"])
    found = list(points(axes))
    assert len(found) == len(set(found)) == 8
    assert [tuple(dict(p).values()) for p in found[:5]] == [
        (0.02, 3, 0),
        (0.02, 3, 1),
        (0.02, 4, 0),
        (0.02, 4, 1),
        (0.03, 3, 0),
    ]


# Rows


def test_runs_that_share_a_model_are_the_runs_alone() -> None:
    """A run writes into its model; no other run may see that."""
    runner = Runner(recipe_of(world="mujoco", jitter=0.3, units=2))
    layout = read(PAPER).layout
    for seed in (3, 1, 3):
        shared = runner.run((("seed", seed),))
        alone = Simulation(layout, RunRequest("mujoco", units=2, seed=seed, jitter=0.3)).run()
        assert shared.events == alone.events
        assert alone.physics is not None  # a sweep chooses its timestep for all runs
        assert shared.physics == replace(alone.physics, timestep_chosen=False)


def test_a_row_is_what_run_tells(run: Terminal, out: Path, here: None) -> None:
    database = out / "r.db"
    words = ("--world", "ideal", "--jitter", "0.3", "--speed", "0.4")
    done = run("sweep", PAPER, "--vary", "seed=7,8", *words, "-o", database, "--json")
    assert done.status == 0
    assert (done.json["runs"], done.json["done"], done.json["failed"]) == (2, 2, 0)
    alone = run("run", PAPER, "--seed", "8", "--units", "4", *words, "--json").json
    timed = ("wall_time_s", "supervisor_time_s", "realtime_factor")
    kept = [name for name in FIGURES if name not in timed]
    row = rows_of(database, ",".join(kept))[1]
    assert dict(zip(kept, row, strict=True)) == {name: alone[name] for name in kept}
    keys = rows_of(database, "point, status, seed, jitter, speed, units, world, wip, clearance")
    assert keys[1] == ('{"seed":8}', "done", 8, 0.3, 0.4, 4, "ideal", None, 0.02)
    assert files_in(out).keys() == {"r.db"}


def test_the_database_is_in_wal_mode_and_open_to_readers(tmp_path: Path, here: None) -> None:
    recipe, axes = recipe_of(), read_axes(["seed=0:3"])
    database = tmp_path / "r.db"
    sweep(recipe, axes, database)
    with sqlite3.connect(database) as connection:
        assert connection.execute("PRAGMA journal_mode").fetchone() == ("wal",)
    connection.close()
    with Store(database, recipe.identity(axes)) as store:
        store.add(Outcome((("seed", 9),), "Broken it is"), recipe.at(()))
        assert summarise(database).failed == 1  # committed already, and not hidden


def test_a_sweep_goes_on_where_it_was(tmp_path: Path, here: None) -> None:
    recipe, database = recipe_of(), tmp_path / "r.db"
    first = sweep(recipe, read_axes(["seed=0:3"]), database)
    kept = rows_of(database, "*")
    more = sweep(recipe, read_axes(["seed=1:6"]), database)
    assert (first.done, first.there, more.done, more.there) == (3, 0, 3, 2)
    assert rows_of(database, "*")[:3] == kept
    assert sweep(recipe, read_axes(["seed=0:6"]), database).done == 0


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


def test_runs_that_failed_before_are_not_forgotten(
    run: Terminal, tmp_path: Path, here: None
) -> None:
    """Only those of the grid count, in the exit status too."""
    database = tmp_path / "r.db"
    words = ["sweep", PAPER, "--world", "ideal", "-o", database, "--floor", "4x4", "--vary"]
    assert run(*words, "clearance=0.02,5,6").status == 1
    again = run(*words, "clearance=0.02,5,6")
    assert again.status == 1
    failed = "3 of 3 already done, of which 2 failed; --retry runs them again"
    assert again.out == f"0 runs, 0 failed ({failed}): {database}\n"
    part = run(*words, "clearance=0.02,5,0.03", "--json")
    assert part.status == 1
    assert [part.json[key] for key in ("there", "there_failed", "done", "failed")] == [2, 1, 1, 0]
    good = run(*words, "clearance=0.02,0.03")
    assert good.status == 0
    assert good.out == f"0 runs, 0 failed (2 of 2 already done): {database}\n"


def test_another_sweep_is_refused(tmp_path: Path, run: Terminal, here: None) -> None:
    database = tmp_path / "r.db"
    words = ["sweep", "--world", "ideal", "-o", database, "--vary", "seed=0:1"]
    assert run(*words, PAPER).status == 0
    before = database.read_bytes()
    product = tmp_path / "paper.pag"
    product.write_text(PAPER.read_text().replace("part3 = atomic()", "part3 = atomic(mass=2)"))
    for more, message in (
        ([product], "another product, plan, mesh, template or robot type"),
        ([PAPER, "--speed", "0.3"], "speed 0.5 there, 0.3 here"),
        ([PAPER, "--vary", "units=1"], "varied seed there, seed, units here"),
        ([PAPER, "--max-time", "9"], "max_time - there, 9.0 here"),
        ([ROOT / "examples" / "lamp.pag"], "product sub3 there, lamp here"),
    ):
        refused = run(*words, *more)
        assert refused.status == 2
        assert f"BadFile {database}: it holds another sweep: {message}\n" in refused.err
    assert database.read_bytes() == before
    product.write_text("// the same\n" + PAPER.read_text())
    assert run(*words, product).status == 0


@pytest.mark.parametrize("seeds", ["seed=0:3", "units=1"])
def test_two_sweeps_may_begin_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, seeds: str
) -> None:
    """One creates the tables after the other has opened the database."""
    database, recipe = tmp_path / "r.db", recipe_of()
    other = recipe.identity(read_axes([seeds]))
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


def test_a_sweep_waits_for_another_that_begins(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One has created the tables; before it sets the mode, the other locks the database."""
    database, identity = tmp_path / "r.db", recipe_of().identity(read_axes(["seed=0:2"]))
    connect, locks, timers = sqlite3.connect, list[str](), list[threading.Timer]()

    class Late(sqlite3.Connection):
        def execute(self, sql: str, *values: Any) -> sqlite3.Cursor:
            if sql.startswith("BEGIN"):
                locks.append(sql)
            if sql.startswith("PRAGMA journal_mode") and not timers:
                other = connect(database, isolation_level=None, check_same_thread=False)
                other.execute(locks[0])
                timers.append(threading.Timer(0.2, other.close))
                timers[0].start()
            return super().execute(sql, *values)

    monkeypatch.setattr(sqlite3, "connect", partial(sqlite3.connect, factory=Late))
    Store(database, identity).close()
    assert timers


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
        "DROP TABLE runs",
        "DELETE FROM sweep",
        "UPDATE sweep SET value = '[\"x\"]' WHERE key = 'varied'",
        "UPDATE sweep SET value = '{x' WHERE key = 'wip'",
        f"UPDATE sweep SET value = '{'[' * 50_000}'",
        "UPDATE runs SET cycle_time_s = 'abc'",
        "UPDATE runs SET speed = NULL WHERE seed = 1",
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


def test_bytes_that_are_not_what_they_were(run: Terminal, tmp_path: Path, here: None) -> None:
    database, draw = tmp_path / "r.db", random.Random(5)
    words = [PAPER, "--world", "ideal", "--units", "1", "-o", database, "--vary", "seed=0:2"]
    assert run("sweep", *words, "-q").status == 0
    right = database.read_bytes()
    statuses = []
    for _ in range(150):
        wrong = bytearray(right)
        for _ in range(30):
            wrong[draw.randrange(len(wrong))] = draw.randrange(256)
        database.write_bytes(wrong)
        done = run("sweep", database, "--summary", "--json")
        assert done.status == 0 or done.codes == ["BadFile"]
        statuses.append(done.status)
    assert statuses.count(2) > 20


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([PAPER, "-o", "r.db"], "Usage there is nothing to vary"),
        (["-o", "r.db", "--vary", "seed=1"], "Usage there is no FILE.pag"),
        ([PAPER, "--vary", "seed=1"], "Usage there is no database for the results"),
        (["--summary"], "Usage there is no database"),
        (["r.db", "--summary"], "BadFile r.db: there is no such file"),
        ([PAPER, "-o", "r.db", "--vary", "sed=1"], "UnknownParameter unknown key 'sed'"),
        ([PAPER, "-o", "r.db", "--vary", "seed=1", "--seed", "2"], "both given and varied"),
        ([PAPER, "-o", "nowhere/r.db", "--vary", "seed=1"], "'nowhere' does not exist"),
        (["no.pag", "-o", "r.db", "--vary", "seed=1"], "no.pag"),
        (
            [PAPER, "-o", "r.db", "--vary", "seed=1", "--world", "ideal", "--fuse"],
            "Usage the ideal world has no bodies that could become one",
        ),
        ([PAPER, "-o", "r.db", "--vary", "world=ideal", "--fuse"], "has no bodies that could"),
        (
            [PAPER, "-o", "r.db", "--vary", "speed=0.5", "--seed", 10**400],
            "Usage Invalid value for '--seed'",
        ),
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


# Processes that die


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


def test_workers_that_die_as_they_start_end_the_sweep() -> None:
    recipe = recipe_of()
    stillborn = Stillborn(recipe.factory, recipe.product, recipe.fixed)
    with pytest.raises(RunError, match=r"die as they start \(exit status 7\)"):
        list(outcomes_of(stillborn, list(points(read_axes(["seed=0:9"]))), 1))


def children(pid: int) -> list[int]:
    """The processes below a process."""
    found = subprocess.run(["ps", "-eo", "pid=,ppid="], capture_output=True, text=True).stdout
    return [int(line.split()[0]) for line in found.splitlines() if int(line.split()[1]) == pid]


def all_dead(processes: list[int]) -> bool:
    return not any(map(alive, processes))


def alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
def test_a_stopped_sweep_keeps_its_rows_and_goes_on(
    tmp_path: Path, run: Terminal, here: None
) -> None:
    """After Ctrl-C and after kill -9. Its workers end too."""
    database = tmp_path / "r.db"
    words = ["sweep", str(PAPER), "--vary", "seed=0:40", "--jitter", "0.3", "--world", "ideal"]
    words += ["--units", "10", "-o", str(database)]
    kept: list[tuple[Any, ...]] = []
    for number, status in ((signal.SIGINT, 130), (signal.SIGKILL, -9)):
        process = subprocess.Popen([*FACTORY, *words, "--jobs", "1"], cwd=ROOT, stderr=PIPE)
        until(partial(has_rows, database, len(kept) + 3))
        workers = children(process.pid)
        process.send_signal(number)
        _, errors = process.communicate(timeout=SOON)
        assert process.returncode == status
        assert errors.strip() == (b"Interrupted stopped by the user" if status == 130 else b"")
        assert workers
        until(partial(all_dead, workers))
        rows = rows_of(database, "*")
        assert rows[: len(kept)] == kept
        assert len(kept) + 3 <= len(rows) < 40
        kept = rows
    assert run(*words, "--json").json["there"] == len(kept)
    assert rows_of(database, "*")[: len(kept)] == kept
    assert sorted(rows_of(database, "seed")) == [(n,) for n in range(40)]
    assert files_in(tmp_path).keys() == {"r.db"}


# The summary


def test_the_summary_is_numpys(tmp_path: Path, here: None) -> None:
    database = tmp_path / "r.db"
    axes = read_axes(["seed=0:8", "jitter=0.3,0.1"])
    sweep(recipe_of(), axes, database)
    found = summarise(database)
    assert [group.values for group in found.groups] == [(("jitter", 0.1),), (("jitter", 0.3),)]
    for group in found.groups:
        jitter = dict(group.values)["jitter"]
        rows = rows_of(database, "jitter, cycle_time_s")
        values = np.array([row[1] for row in rows if row[0] == jitter])
        told = group.figures["cycle_time_s"]
        low, high = stats.t.interval(
            0.95, len(values) - 1, loc=values.mean(), scale=stats.sem(values)
        )
        assert (group.done, group.failed, told.n) == (8, 0, 8)
        assert told.mean == pytest.approx(values.mean(), rel=1e-12)
        assert told.deviation == pytest.approx(values.std(ddof=1), rel=1e-12)
        assert (told.confidence_low, told.confidence_high) == pytest.approx((low, high), rel=1e-9)
        assert (told.least, told.greatest) == (values.min(), values.max())
        assert "handoffs" not in group.figures  # there are none in the ideal world


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


def test_summaries_are_printed(tmp_path: Path, run: Terminal, here: None) -> None:
    database = tmp_path / "r.db"
    words = ["--world", "ideal", "--vary", "seed=0:3", "--vary", "speed=0.3,0.5"]
    quiet = run("sweep", PAPER, *words, "-o", database, "-q")
    assert quiet.err == "" and quiet.out.startswith("6 runs, 0 failed")
    told = run("sweep", database, "--summary")
    assert "speed 0.3: 3 runs, 0 failed" in told.out
    rows = [line.split()[0] for line in told.out.splitlines() if line.split()]
    assert rows[rows.index("figure") + 2] == "cycle_time_s" and "realtime_factor" not in rows
    summary = run("sweep", "--summary", "-o", database, "--json").json["summary"]
    assert [g["values"] for g in summary["groups"]] == [{"speed": 0.3}, {"speed": 0.5}]
    assert summary["groups"][0]["figures"]["cycle_time_s"]["n"] == 3


def test_columns_are_named_once() -> None:
    assert set(FIGURES) < set(COLUMNS)
    assert {"seed", "jitter", "world", "clearance", "reason", "row_time_s"} < set(COLUMNS)


# What fails


def test_the_rate_of_faults_may_vary(here: None, tmp_path: Path) -> None:
    """Without faults the runs are as ever; with them as many units are made, more slowly."""
    path, axes = tmp_path / "db", read_axes(["fault_rate=0,0.1", "seed=0:3"])
    tally = sweep(recipe_of(units=12), axes, path)
    assert (tally.done, tally.failed) == (6, 0)
    rows = rows_of(path, "fault_rate, products, failures, cycle_time_s, transitions_undone")
    assert {row[1] for row in rows} == {12}
    good, bad = ([row for row in rows if row[0] == rate] for rate in (0.0, 0.1))
    assert {row[2] for row in good} == {row[4] for row in good} == {0}
    assert all(row[2] > 0 and row[4] > 0 for row in bad)
    (plain,) = {row[3] for row in good}
    assert all(row[3] >= plain - 1e-9 for row in bad) and max(row[3] for row in bad) > plain
    groups = summarise(path).groups
    assert [dict(group.values) for group in groups] == [{"fault_rate": 0.0}, {"fault_rate": 0.1}]
    assert groups[1].figures["failures"].mean == pytest.approx(np.mean([row[2] for row in bad]))


def test_a_sweep_without_faults_keeps_nothing_of_them(here: None, tmp_path: Path) -> None:
    sweep(recipe_of(units=2), read_axes(["seed=0:2"]), tmp_path / "db")
    with sqlite3.connect(tmp_path / "db") as connection:
        names = [row[1] for row in connection.execute("PRAGMA table_info(runs)")]
    assert names == list(COLUMNS) and "fault_rate" not in names and "failures" not in names


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
