"""Runs that were killed go on from their logs: to the bit as if nothing had happened. What is no
checkpoint, or not of the run, is refused with a diagnostic."""

from __future__ import annotations

import json
import signal
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from factory.record.log import Log, LogWriter, read_log
from factory.record.log.blocks import Arrays
from factory.record.log.kept import BROKEN, kept_run
from factory.record.log.reader import header_in
from factory.simulation.checkpoint import checkpoint, take_up
from factory.simulation.keeping import VALUES, Keeper, Noting, TakingUp, is_size, one_of, up_to
from factory.simulation.request import RunRequest
from factory.simulation.simulation import Compiled, Simulation, compiled
from factory.support.claim import claimed
from tests.command_line import PAPER, ROOT, Terminal, spawn, started
from tests.simulation_values import FINE, layout_of, state
from tests.test_log import block_ends
from tests.test_log_damage import put_together, taken_apart

UNITS = 2
EXAMPLES = ROOT / "examples"


def ticks_of(path: Path) -> bytes:
    """All of a log but its header, which has the command line."""
    data = path.read_bytes()
    return data[header_in(memoryview(data))[1] :]


def cut(whole: Path, path: Path, size: int) -> Path:
    """The first so many bytes of a log."""
    path.write_bytes(whole.read_bytes()[:size])
    return path


@cache
def request_of(name: str) -> tuple[RunRequest, Compiled]:
    """A run of a factory whose robots differ, and what is made for it."""
    given: dict[str, Any] = {"world": "ideal"} if name == "lamp" else {"fuse": name == "truck"}
    asked = RunRequest(units=20, seed=3, jitter=0.3, settings=FINE, **given)
    return asked, compiled(layout_of(name), asked)


def made(name: str) -> Simulation:
    """That run, ready to go."""
    return Simulation(layout_of(name), *request_of(name))


def physics(simulation: Simulation) -> bytes:
    """Where everything is, to the last bit."""
    if simulation.model is None:
        return simulation.world.sense()[0].tobytes()
    return state(simulation)


@dataclass
class Kept:
    """A log with checkpoints, whole, and the last of them."""

    name: str
    path: Path

    @cached_property
    def checkpoint(self) -> Arrays:
        return kept_run(self.path).checkpoints[-1][1]

    @cached_property
    def until(self) -> Log:
        """The log up to that."""
        found = kept_run(self.path)
        return found.until(found.checkpoints[-1][0])

    def take_up(self, found: Arrays) -> None:
        """Let a run made anew take up a checkpoint."""
        take_up(made(self.name), found, self.until)


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, int], Kept]:
    """The log of so many ticks of a run, and the run itself."""

    def keep(name: str, ticks: int) -> Kept:
        path, simulation = tmp_path_factory.mktemp("kept") / "run.log", made(name)
        with LogWriter(path, simulation, checkpoint=lambda: checkpoint(simulation)) as writer:
            simulation.run([writer.observe], ticks * simulation.request.settings.tick)
        return Kept(name, path)

    return keep


@pytest.mark.parametrize("name", ["paper", "truck", "fence", "lamp"])
@settings(max_examples=2)
@given(ticks=st.integers(0, 299), seed=st.integers(0, 99))
def test_a_run_that_goes_on_is_the_same_to_the_last_bit(name: str, ticks: int, seed: int) -> None:
    """From any tick: marking, copies, positions and what is noted down again; and so is all that
    follows, for as long as two cycles of what may be under way."""
    one = made(name)
    for _ in range(250 + ticks):
        one.supervisor.step()
    found = checkpoint(one)
    assert found is not None
    other, keeper = made(name), TakingUp(found)
    net = one.layout.factory.net.threaded
    numbers = {t.name: n for n, t in enumerate(net.transitions)}
    past = [(e.t, numbers[e.transition]) for e in one.supervisor.events]
    other.supervisor.go_over(past, pytest.fail)
    other.supervisor.keep(keeper)
    active = other.supervisor.active
    other.world.keep(keeper, active.bundle, active.axes)
    other.world.dropoffs.extend(one.world.dropoffs)
    assert other.supervisor.marked == one.supervisor.marked
    assert other.supervisor.threads.robots == one.supervisor.threads.robots
    again = checkpoint(other)
    assert again is not None and found.keys() == again.keys()
    for key, values in found.items():
        assert values.tobytes() == again[key].tobytes(), key
    if one.model is not None:
        ours, theirs = one.physical.parts, other.physical.parts
        assert ours.copies._number == theirs.copies._number and ours.hands.of == theirs.hands.of
        assert (one.physical.m.exclude_signature == other.physical.m.exclude_signature).all()
        for field in ("geom_contype", "geom_conaffinity", "dof_frictionloss", "tree_sleep_policy"):
            assert (getattr(one.physical.m, field) == getattr(other.physical.m, field)).all(), field
    for _ in range(60):
        one.supervisor.step(), other.supervisor.step()
        assert physics(one) == physics(other)
    assert one.supervisor.events == other.supervisor.events
    assert one.world.figures() == other.world.figures()
    assert one.world.delivered() == other.world.delivered()


# --- the command line


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The log of a run that was not cut off; not to be written."""
    path = tmp_path_factory.mktemp("whole") / "run.log"
    done = spawn("run", PAPER, "--units", UNITS, "--seed", 7, "--jitter", 0.2, "--log", path, "-q")
    assert done.status == 0, done.err
    return path


@pytest.fixture(scope="module")
def ideal(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same in the ideal world."""
    path = tmp_path_factory.mktemp("ideal") / "run.log"
    words = ("run", PAPER, "--units", UNITS, "--world", "ideal", "--log", path, "-q")
    assert spawn(*words).status == 0
    return path


def goes_on(run: Terminal, whole: Path, log: Path) -> bool:
    """Whether a log cut off is gone on with; then it is the whole one, and if not a diagnostic
    says why, and it is as it was."""
    before = log.read_bytes()
    done = run("run", "--resume", log, "--json", "--no-monitor")
    if done.status == 0:
        assert done.json["products"] == done.json["units"] == UNITS
        assert log.read_bytes() == whole.read_bytes()
        return True
    assert done.status == 2 and done.codes == ["BadLog"], done
    assert log.read_bytes() == before
    return False


def test_a_log_cut_off_at_any_byte_is_gone_on_with(
    run: Terminal, whole: Path, ideal: Path, tmp_path: Path
) -> None:
    """From where its ticks begin, which is in the ideal world where its header ends, in MuJoCo
    where its model does; before, it says why not."""
    log, chance = tmp_path / "cut.log", Random(1)
    for path, many in ((ideal, 12), (whole, 3)):
        data = path.read_bytes()
        ends = block_ends(data)
        begin = ends[0] if path == ideal else ends[1]
        sizes = [0, 11, 20, begin - 1, begin, begin + 1, ends[-2], len(data) - 1]
        sizes += [chance.randrange(begin, len(data)) for _ in range(many)]
        for size in sizes:
            assert goes_on(run, path, cut(path, log, size)) == (size >= begin), size


def test_a_damaged_byte(run: Terminal, whole: Path, tmp_path: Path) -> None:
    """What is after it is made again."""
    data = bytearray(whole.read_bytes())
    at = block_ends(bytes(data))[4] + 40
    data[at] ^= 0x10
    log = tmp_path / "bad.log"
    log.write_bytes(data)
    assert goes_on(run, whole, log)


def test_the_whole_run_is_judged(run: Terminal, whole: Path, tmp_path: Path) -> None:
    log = cut(whole, tmp_path / "cut.log", whole.stat().st_size // 2)
    done = run("run", "--resume", log, "--json", "--monitor")
    found = done.json
    assert done.status == 0 and found["refines_net"] and found["verdict"]["succeeded"]
    assert found["unintended_contacts"] == 0 and found["monitor"]["violations"] == []
    assert found["timestep_chosen"] and found["monitor_time_s"] > 0
    told = run("monitor", log, "--json")
    assert told.status == 0 and told.json["refines_net"] and told.json["cut_off"] is None
    assert len(found["events"]) == len(read_log(whole).events)
    assert found["sim_time_s"] == pytest.approx(read_log(whole).time[-1])
    words = run("run", "--resume", cut(whole, log, whole.stat().st_size // 2)).out
    assert (
        "goes on from where it is cut off at" in words and f"{UNITS} of {UNITS} products" in words
    )


def test_a_run_that_is_at_its_end(run: Terminal, whole: Path, tmp_path: Path) -> None:
    log = cut(whole, tmp_path / "run.log", whole.stat().st_size)
    then = log.stat().st_mtime_ns
    done = run("run", "--resume", log)
    assert done.status == 0 and f"has made its units, {UNITS} of {UNITS}" in done.out
    assert run("run", "--resume", log, "--json").json["products"] == UNITS
    assert log.stat().st_mtime_ns == then and log.read_bytes() == whole.read_bytes()


def test_a_run_that_was_stopped_goes_on(run: Terminal, ideal: Path, tmp_path: Path) -> None:
    """By --max-time, again and again."""
    log = tmp_path / "run.log"
    words = ("--world", "ideal", "--units", UNITS)
    assert run("run", PAPER, *words, "--log", log, "--max-time", 2.5, "-q").status == 1
    assert run("run", "--resume", log, "--max-time", 3.2, "-q").status == 1
    assert read_log(log).time[-1] == pytest.approx(3.2, abs=0.011)
    assert run("run", "--resume", log, "-q").status == 0
    assert ticks_of(log) == ticks_of(ideal)


def test_what_cannot_be_gone_on_with(
    run: Terminal, whole: Path, ideal: Path, tmp_path: Path
) -> None:
    log = tmp_path / "run.log"
    header, blocks = taken_apart(whole)

    def refused(words: str, code: str = "BadLog", path: Path = log) -> None:
        before = path.read_bytes() if path.is_file() else b""
        done = run("run", "--resume", path)
        assert done.status == 2 and code in done.err and words in done.err, done
        assert not path.is_file() or path.read_bytes() == before

    refused("is no file")
    refused("is no file", path=tmp_path)
    refused("is no log", path=PAPER)
    cut(whole, log, whole.stat().st_size // 2)
    with claimed(tmp_path / "other.log"):
        refused("is being written by another run", "BadFile", tmp_path / "other.log")
    rest = {name: value for name, value in header.items() if name != "chosen"}
    refused("'chosen'", path=put_together(log, rest, blocks[:4]))
    plain = [(kind, arrays) for kind, arrays in blocks[:-1] if kind != b"C"]
    refused("has no checkpoints", path=put_together(log, header, plain))
    refused("--distributed", path=put_together(log, {**header, "distributed": True}, blocks[:4]))
    old = {**header, "versions": {**header["versions"], "mujoco": "2.0.0"}}
    refused("was kept with mujoco 2.0.0", path=put_together(log, old, blocks[:4]))
    model = {**blocks[0][1], "xml": np.append(blocks[0][1]["xml"], np.uint8(32))}
    refused("is of another model", path=put_together(log, header, [(b"M", model), *blocks[1:4]]))
    stalled = {k: np.frombuffer(b"Stalled", "u1") for k in ("code", "message")}
    refused("would end again", path=put_together(log, header, [*blocks[:3], (b"E", stalled)]))
    for words in (("--units", 3), ("--log", tmp_path / "b"), ("--speed", 1)):
        done = run("run", "--resume", whole, *words)
        assert done.status == 2 and "Usage" in done.err and str(words[0]) in done.err


def test_a_distributed_run_is_not_gone_on_with(run: Terminal, tmp_path: Path) -> None:
    log = tmp_path / "run.log"
    words = ("--distributed", "--world", "ideal", "--log", log, "--max-time", 2.2, "-q")
    assert run("run", PAPER, *words).status == 1
    done = run("run", "--resume", log)
    assert done.status == 2 and "--distributed" in done.err


# --- planted faults


@pytest.fixture(scope="module")
def paper(kept: Callable[[str, int], Kept]) -> Kept:
    return kept("paper", 310)


def changed(found: Arrays, name: str, change: Callable[[Any], Any]) -> Arrays:
    """A checkpoint with another value or array of this name."""
    if name in found:
        return {**found, name: change(found[name].copy())}
    values = json.loads(found[VALUES].tobytes())
    values[name] = change(values[name])
    return {**found, VALUES: np.frombuffer(json.dumps(values).encode(), "u1")}


def added(index: int, value: Any) -> Callable[[np.ndarray], np.ndarray]:
    def change(values: np.ndarray) -> np.ndarray:
        values.reshape(-1)[index] += value
        return values

    return change


@pytest.mark.parametrize(
    ("name", "change", "words"),
    [
        ("fired", added(0, 1), "counts of firings"),
        ("going", lambda rows: [[(n + 1) % 6] for (n,) in rows], "operations under way"),
        ("time", added(0, 0.01), "another time"),
        ("engine.qpos", added(0, 1e-9), "positions"),
        ("copies.used", lambda rows: rows[1:], "copies of parts"),
        ("copies.used", lambda rows: [*rows, rows[0]], "copies of parts"),
        ("copies.free", lambda rows: [["part9", 0]], "can have no row"),
        ("hands", lambda rows: [[0, 10**6, "part1"]], "hold what they cannot"),
        ("feeders.shown", lambda rows: [["part1", 10**6]], "not there"),
        ("parts.on_tray", lambda unit: 10**6, "not there"),
        ("parts.holders", added(0, 99), "out of range"),
        ("joining.waiting", lambda rows: [[99, "part1", 0.0]], "do not hold"),
        ("engine.tree_asleep", lambda a: np.where(a < 0, 0, a).astype("<i4"), "in rings"),
        ("engine.tree_asleep", lambda a: a + 100, "out of range"),
        ("engine.history", added(1, 1e6), "buffers"),
        ("engine.eq_obj2id", added(0, 10**6), "out of range"),
        ("course.at", lambda at: 99, "past the end"),
        ("away.held", lambda rows: [[10**6, 0]], "not there"),
        ("onsets", lambda rows: [["a", "b", 10**9]], "can have no row"),
        ("supply.released", lambda count: -1, "can be no -1"),
        ("strength.most", lambda most: ["much"], "can be no"),
        ("pads.gap", lambda gap: -1.0, "can be no"),
    ],
)
def test_a_planted_fault_is_found(
    paper: Kept, name: str, change: Callable[[Any], Any], words: str
) -> None:
    with pytest.raises(ValueError, match=words):
        paper.take_up(changed(paper.checkpoint, name, change))


def test_every_value_is_looked_at(paper: Kept) -> None:
    """None can be missing, or of another kind."""
    found = paper.checkpoint
    paper.take_up(found)
    values = json.loads(found[VALUES].tobytes())
    for name in [*found, *values]:
        bad = {k: a for k, a in found.items() if k != name}
        if name in values:
            rest = {k: v for k, v in values.items() if k != name}
            bad = {**found, VALUES: np.frombuffer(json.dumps(rest).encode(), "u1")}
        with pytest.raises(ValueError, match="no values" if name == VALUES else f"no '{name}'"):
            paper.take_up(bad)
        if name in values:
            with pytest.raises(BROKEN):
                paper.take_up(changed(found, name, lambda _: {"a": 10**400}))
        if name in found and name != VALUES:
            array = found[name]
            with pytest.raises(ValueError, match=f"'{name}' is"):
                paper.take_up({**found, name: np.zeros((3, *array.shape), array.dtype)})
            full = np.full_like(
                array, np.nan if array.dtype == float else np.iinfo(array.dtype).max
            )
            with pytest.raises(BROKEN):
                paper.take_up({**found, name: full})


def test_a_bad_checkpoint_is_skipped(run: Terminal, whole: Path, tmp_path: Path) -> None:
    """The run goes on from the one before, says so, and makes it anew; where all are bad it does
    not go on."""
    header, blocks = taken_apart(whole)
    kinds = [n for n, (kind, _) in enumerate(blocks) if kind == b"C"]
    bad = [*blocks]
    bad[kinds[-1]] = b"C", changed(blocks[kinds[-1]][1], "fired", added(0, 1))
    log = put_together(tmp_path / "bad.log", header, bad[:-1])
    done = run("run", "--resume", log, "--no-monitor")
    assert done.status == 0 and "counts of firings" in done.err
    assert f"{read_log(whole).time[-1]:.2f} s" in done.out
    assert read_log(log).events == read_log(whole).events
    every = [(k, changed(a, "fired", added(0, 1)) if k == b"C" else a) for k, a in blocks[:-1]]
    done = run("run", "--resume", put_together(log, header, every))
    assert done.status == 2 and done.err.count("counts of firings") == min(3, len(kinds))


def test_a_run_that_contradicts_its_checkpoint_later(
    run: Terminal, whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What the checks let pass gives a diagnostic too."""

    def fails(*_: object) -> None:
        raise KeyError("part1")

    monkeypatch.setattr(Simulation, "run", fails)
    done = run("run", "--resume", cut(whole, tmp_path / "run.log", whole.stat().st_size // 2))
    assert done.status == 2 and "BadLog" in done.err and "contradicts" in done.err


# --- keepers


def test_what_is_noted_down_is_taken_up() -> None:
    def keep(keeper: Keeper, values: list[Any]) -> list[Any]:
        array = np.array(values[0])
        keeper.array("a", array, high=np.inf)
        rows = keeper.rows("r", values[1], one_of("xy"), up_to(3))
        number = keeper.number("n", values[2], high=np.inf)
        flag, whole = keeper.flag("f", values[3]), keeper.whole("w", values[4])
        return [array.tolist(), rows, number, flag, whole]

    noting, values = Noting(), [[1.5, -0.1], [("x", 1), ("y", 2)], 0.1 + 0.2, True, 7]
    assert keep(noting, values) == values
    assert keep(TakingUp(noting.arrays), [[0.0, 0.0], [], 0.0, False, 0]) == values


@pytest.mark.parametrize("text", [b"", b"7", b"{", b"[" * 10**5, b"\xff"])
def test_values_that_are_no_json(text: bytes) -> None:
    with pytest.raises(ValueError):
        TakingUp({VALUES: np.frombuffer(text, "u1")})


def test_sizes() -> None:
    assert all(map(is_size, (0, 0.5, 10**9)))
    assert not any(map(is_size, (-1, True, float("nan"), float("inf"), "1", None, 10**10)))


# --- kills


def killed_and_gone_on(
    folder: Path, words: tuple[object, ...], kills: int, chance: Random, size: int
) -> list[float]:
    """A run that is killed so many times, each at a random time until its log has as large a share
    of its whole `size` as of its kills; gives where it went on from [s]. It is let come to its
    end."""
    log, came = folder / "run.log", list[float]()
    command: tuple[object, ...] = ("run", *words, "--log", log, "-q")
    for kill in range(kills):
        wanted = size * chance.uniform(kill + 0.05, kill + 0.9) / kills
        with started(*command) as process:
            deadline = time.monotonic() + 60
            while not log.exists() or log.stat().st_size < wanted:
                assert process.poll() is None and time.monotonic() < deadline
                time.sleep(0.001)
            time.sleep(chance.uniform(0.0, 0.01))
            process.send_signal(signal.SIGKILL)
            assert process.wait() == -signal.SIGKILL
        found = kept_run(log).checkpoints
        came.append(float(found[-1][1]["time"][0]) if found else 0.0)
        command = "run", "--resume", log, "-q"
    done = spawn(*command[:-1], "--json")
    assert done.status == 0, done.err
    assert done.json["unintended_contacts"] == 0 and done.json["refines_net"]
    told = spawn("monitor", log, "--json")
    assert told.status == 0 and told.json["refines_net"] and told.json["verdict"]["succeeded"]
    return came


@pytest.mark.skipif(sys.platform == "win32", reason="there is no SIGKILL")
def test_a_run_that_is_killed_goes_on(whole: Path, tmp_path: Path) -> None:
    words = (PAPER, "--units", UNITS, "--seed", 7, "--jitter", 0.2)
    killed_and_gone_on(tmp_path, words, 1, Random(3), whole.stat().st_size)
    assert ticks_of(tmp_path / "run.log") == ticks_of(whole)


FACTORIES: tuple[tuple[object, ...], ...] = (
    (PAPER, "--units", 60, "--jitter", 0.3),
    (EXAMPLES / "truck.pag", "--units", 4, "--fuse"),
    (EXAMPLES / "gearbox.pag", "--units", 3, "--jitter", 0.2),
    (PAPER, "--units", 60, "--robots", 3, "--no-hands"),
)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="there is no SIGKILL")
@pytest.mark.parametrize("number", range(len(FACTORIES)))
def test_twenty_kills(tmp_path: Path, number: int) -> None:
    """Five in a row of one run each, at random times, and each is gone on with: in the end all
    units are made, and the log is that of a run that was never killed."""
    words = (*FACTORIES[number], "--seed", number)
    whole = tmp_path / "whole.log"
    assert spawn("run", *words, "--log", whole, "-q").status == 0
    came = killed_and_gone_on(tmp_path, words, 5, Random(number), whole.stat().st_size)
    assert ticks_of(tmp_path / "run.log") == ticks_of(whole)
    print(number, read_log(whole).time[-1], came)
