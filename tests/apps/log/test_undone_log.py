"""Logs of runs in which something failed: what they keep, and what a reader refuses."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from factory.apps.analyze.measured import logged_record
from factory.apps.log.reader import Log, read_log
from factory.apps.monitor.record import recorded_subject, verdict_on
from factory.engine.record.replay import replay
from factory.support.errors import InputError
from factory.theory.nets.undone import Undone
from factory.theory.plant.factory import Factory
from tests.apps.log.test_log import put_together, taken_apart
from tests.command_line import spawn
from tests.paths import PAPER

FAULTS = '[[fault]]\nkind = "bad_joint"\nrate = 0.2\n[[fault]]\nkind = "drop"\nrate = 0.1\n'


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a log of a run in the ideal world with failures, and of what was printed."""
    folder = tmp_path_factory.mktemp("failures")
    (folder / "faults.toml").write_text(FAULTS)
    how = ("--world", "ideal", "--units", 12, "--faults", folder / "faults.toml")
    made = spawn("run", PAPER, *how, "--log", folder / "run.log", "--json")
    assert made.status == 0
    (folder / "run.json").write_text(made.out)
    return folder


@pytest.fixture(scope="module")
def log(kept: Path) -> Log:
    return read_log(kept / "run.log")


@pytest.fixture(scope="module")
def factory(log: Log) -> Factory:
    return recorded_subject(log.header).factory


def test_a_log_keeps_what_was_undone(kept: Path, log: Log, factory: Factory) -> None:
    """As the run said, in its place among the firings; and so it replays."""
    said = json.loads((kept / "run.json").read_text())
    assert said["refines_net"]
    rows = [
        entry.as_json() if isinstance(entry, Undone) else {"t": round(t, 6), "transition": entry}
        for t, entry in log.timed_entries
    ]
    assert rows == said["events"]
    assert len(log.events) == said["transitions_fired"] == len(rows) - len(log.undone)
    assert {undone.reason for _, undone in log.undone} >= {"residual", "lost"}
    assert verdict_on(log, factory, None).succeeded
    assert not replay(factory.net, [name for _, name in log.events]).refines
    assert replay(factory.net, [name for _, name in log.lasting]).refines
    assert len(logged_record("it", log, factory).events) == len(log.lasting) < len(log.events)


def test_any_other_undo_fails_the_verdict(log: Log, factory: Factory) -> None:
    """One left out, one less undone, one asked for elsewhere, none at all."""
    at = next(n for n, (_, undone) in enumerate(log.undone) if undone.reason == "lost")
    after, undone = log.undone[at]
    less = replace(undone, transitions=undone.transitions[1:])
    more = replace(undone, asked=(), transitions=())
    rest = log.undone[at + 1 :]
    changed = (rest, ((after, less), *rest), ((after, more), *rest), ((0, undone), *rest))[1]
    assert not verdict_on(replace(log, undone=(*log.undone[:at], *changed)), factory, None).refines


def rewritten(path: Path, to: Path, change: Callable[[list[Any]], Any]) -> Path:
    """The log with other entries in its first block with any."""
    header, blocks = taken_apart(path)
    kind, arrays = next((kind, a) for kind, a in blocks if "undone" in a)
    at = next(n for n, (_, a) in enumerate(blocks) if a is arrays)
    text = json.dumps(change(json.loads(arrays["undone"].tobytes())))
    blocks[at] = kind, {**arrays, "undone": np.frombuffer(text.encode(), "u1")}
    return put_together(to, header, blocks)


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("t", -1, "undone at -1.0 s, before the run"),
        ("after", 10**6, "something is undone after 1000000 firings"),
        ("transitions", ["y_s"], "'y_s' is undone, which is no transition"),
    ],
)
def test_damaged_entries(kept: Path, tmp_path: Path, key: str, value: object, words: str) -> None:
    def change(rows: list[Any]) -> Any:
        after, undone = rows[0]
        row = [value, undone] if key == "after" else [after, {**undone, key: value}]
        return [row, *rows[1:]]

    bad = rewritten(kept / "run.log", tmp_path / "bad", change)
    with pytest.raises(InputError, match="is damaged") as caught:
        read_log(bad)
    assert words in caught.value.diagnostics[0].message


def test_damaged_lists(kept: Path, tmp_path: Path) -> None:
    content = {}
    with pytest.raises(InputError, match="is damaged"):
        read_log(rewritten(kept / "run.log", tmp_path / "bad", lambda _: content))


def test_logs_of_runs_without_faults_have_nothing_of_them(tmp_path: Path) -> None:
    for faulty in (False, True):
        more = ("--spares", 1) if faulty else ()
        spawn("run", PAPER, "--world", "ideal", "--units", 2, *more, "--log", tmp_path / "run.log")
        _, found = taken_apart(tmp_path / "run.log")
        has = [("failures" in arrays) for kind, arrays in found if kind == b"T"]
        assert has == [faulty, *[False] * (len(has) - 1)]


def test_what_is_no_news_of_failures_is_refused(kept: Path, tmp_path: Path) -> None:
    header, found = taken_apart(kept / "run.log")
    arrays = next(arrays for kind, arrays in found if kind == b"T" and "failures" in arrays)
    arrays["failures"] = np.frombuffer(b'{"struck": 3}', "u1")
    path = tmp_path / "bad.log"
    put_together(path, header, [(k, a) for k, a in found if k != b"E"])
    with pytest.raises(InputError, match="struck' must be a table"):
        read_log(path)
