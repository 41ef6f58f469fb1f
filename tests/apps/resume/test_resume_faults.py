"""Runs with faults that were killed go on: to the bit as if nothing had happened."""

from __future__ import annotations

import sys
from pathlib import Path
from random import Random

import pytest

from tests.apps.log.test_log import block_ends, put_together, taken_apart
from tests.apps.resume.test_resume import EXAMPLES, killed_and_gone_on, ticks_of
from tests.command_line import Terminal, spawn
from tests.paths import PAPER

FAULTS = """
clear = 2
[[fault]]
kind = "bad_joint"
rate = 0.1
[[fault]]
kind = "drop"
rate = 0.04
[[fault]]
kind = "bad_part"
rate = 0.03
[[fault]]
kind = "misplaced"
rate = 0.03
degrees = 180
[[fault]]
kind = "no_part"
rate = 0.03
[[fault]]
kind = "dead"
robot = "r6"
unit = 3
"""


@pytest.fixture(scope="module")
def words(tmp_path_factory: pytest.TempPathFactory) -> tuple[object, ...]:
    """The words of a run with faults in the ideal world."""
    file = tmp_path_factory.mktemp("faults") / "faults.toml"
    file.write_text(FAULTS)
    return PAPER, "--world", "ideal", "--units", 9, "--faults", file, "--spares", 1, "--swap", 2


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory, words: tuple[object, ...]) -> Path:
    """The log of it; not to be written."""
    path = tmp_path_factory.mktemp("whole") / "run.log"
    assert spawn("run", *words, "--log", path, "-q").status == 0
    return path


def test_a_run_that_was_cut_off_is_gone_on_with(whole: Path, tmp_path: Path, run: Terminal) -> None:
    """It tells of all that failed, before and after, and its log is that of the whole run."""
    share = 0.5
    data, path = whole.read_bytes(), tmp_path / "run.log"
    ends = block_ends(data)
    path.write_bytes(data[: ends[int(share * (len(ends) - 1))] + 9])
    done = run("run", path, "--resume", "--json")
    assert done.status == 0 and len(done.json["failures"]["failures"]) > 3
    assert ticks_of(path) == ticks_of(whole)


def test_faults_that_are_none_are_refused(whole: Path, tmp_path: Path, run: Terminal) -> None:
    header, blocks = taken_apart(whole)
    for faults in ({"faults": [{"kind": "fire"}]}, {"seed": 1}):
        path, less = tmp_path / "run.log", [(kind, a) for kind, a in blocks if kind != b"E"]
        put_together(path, {**header, "faults": {**header["faults"], **faults}}, less)
        if "seed" in faults:
            put_together(path, {**header, "faults": faults}, less)
        done = run("run", path, "--resume")
        assert done.status == 2 and "BadLog" in done.err


def test_a_run_that_ended_in_itself_is_not_gone_on_with(tmp_path: Path, run: Terminal) -> None:
    file, log = tmp_path / "faults.toml", tmp_path / "run.log"
    file.write_text('[[fault]]\nkind = "dead"\nrobot = "r6"\nunit = 1\n')
    how = ("--world", "ideal", "--units", 2, "--faults", file, "--log", log)
    assert run("run", PAPER, *how).status == 1
    done = run("run", log, "--resume")
    assert done.status == 2 and "would end again as it did" in done.err


SPARE = "--spares", 1, "--swap", 4

FACTORIES: tuple[tuple[object, ...], ...] = (
    (PAPER, "--units", 40, "--jitter", 0.3, *SPARE),
    (EXAMPLES / "truck.pag", "--units", 4, *SPARE),
    (EXAMPLES / "chest.pag", "--units", 4, "--jitter", 0.2, *SPARE),
)
"""Runs with faults, in MuJoCo."""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="there is no SIGKILL")
@pytest.mark.parametrize("number", range(len(FACTORIES)))
def test_kills_of_runs_with_faults(tmp_path: Path, number: int) -> None:
    """Three in a row of one run each in MuJoCo, at random times, and each is gone on with."""
    file = tmp_path / "faults.toml"
    file.write_text(FAULTS)
    words = (*FACTORIES[number], "--seed", number, "--faults", file)
    whole = tmp_path / "whole.log"
    assert spawn("run", *words, "--log", whole, "-q").status == 0
    killed_and_gone_on(tmp_path, words, 3, Random(number), whole.stat().st_size)
    assert ticks_of(tmp_path / "run.log") == ticks_of(whole)
