"""Runs with faults that were killed go on: to the bit as if nothing had happened."""

from __future__ import annotations

import sys
from dataclasses import asdict
from json import dumps, loads
from pathlib import Path
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from factory.apps.log import LogWriter
from factory.apps.recovery import Campaign, Recovery, Sensors, WorldFault, recover
from factory.apps.recovery.faults import KINDS, OF_ROBOT, campaign_of
from factory.engine.simulation.request import RunRequest, WorldName
from factory.engine.simulation.simulation import Simulation
from tests.apps.log.test_log import block_ends
from tests.apps.log.test_log_damage import put_together, taken_apart
from tests.apps.resume.test_resume import EXAMPLES, cut, go_on, killed_and_gone_on, ticks_of
from tests.command_line import Terminal, spawn
from tests.layout_values import paper_layout
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


def campaign(seed: int) -> Campaign:
    """Faults of many kinds, often, and a robot that dies."""
    rates = {"bad_joint": 0.1, "drop": 0.08, "bad_part": 0.05, "misplaced": 0.05, "no_part": 0.05}
    faults = [WorldFault(kind, rate=rate, seconds=1.0) for kind, rate in rates.items()]
    death = WorldFault("dead", robot="r6", unit=2)
    return Campaign((*faults, death), seed, clear=1.0, spares=1, swap=2.0)


def made(world: WorldName, seed: int) -> tuple[Simulation, Recovery]:
    """A run with them, ready to go."""
    request = RunRequest(world, units=9, seed=seed, jitter=0.3, recovers=True)
    simulation = Simulation(paper_layout(), request)
    return simulation, recover(simulation, campaign(seed))


@pytest.mark.parametrize("world", ["ideal", "mujoco"])
def test_a_run_with_faults_goes_on_the_same(tmp_path: Path, world: WorldName) -> None:
    """While things are wrong, too: robots stand, are dead, or have been replaced by spares. Its log
    is the same, with all that failed."""
    whole, log, (simulation, recovery) = tmp_path / "whole.log", tmp_path / "log", made(world, 3)
    with LogWriter(whole, simulation) as writer:
        writer.end(simulation.run([writer.observe]).trouble)
    assert len(recovery.found) > 1
    size = whole.stat().st_size
    for share in (0.4, 0.5, 0.8) if world == "ideal" else (0.6,):
        again, other = made(world, 3)
        assert go_on(again, cut(whole, log, round(share * size))) > 0
        assert log.read_bytes() == whole.read_bytes()
        assert other.report() == recovery.report()


KIND = st.sampled_from([kind for kind in KINDS if kind not in OF_ROBOT])


@given(st.lists(KIND), st.floats(0, 1), st.floats(0, 100), st.integers(0, 9))
def test_campaigns_are_read_as_they_are_written(
    kinds: list[str], rate: float, clear: float, spares: int
) -> None:
    faults = tuple(WorldFault(kind, rate=rate) for kind in kinds)
    whole = Campaign(faults, 3, clear, Sensors(noise=rate), spares)
    assert campaign_of(loads(dumps(asdict(whole)))) == whole


# --- the command line


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


@pytest.mark.parametrize("share", [0.2, 0.5, 0.9])
def test_a_run_that_was_cut_off_is_gone_on_with(
    whole: Path, tmp_path: Path, run: Terminal, share: float
) -> None:
    """It tells of all that failed, before and after, and its log is that of the whole run."""
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
