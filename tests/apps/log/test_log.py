"""Logs: what is written is read back to the bit, from whole files and from cut-off ones; other
files are refused with a diagnostic."""

from __future__ import annotations

import random
import tracemalloc
from dataclasses import replace
from pathlib import Path
from unittest.mock import ANY

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

import factory
from factory.apps.log import MAGIC, Log, LogWriter, is_log, read_log
from factory.apps.log.blocks import HEAD, LENGTH, Arrays, block, blocks, pack_rows, unpack_rows
from factory.apps.log.model import model_of
from factory.apps.log.reader import header_in
from factory.apps.monitor.record import jumps, observations, watch_log
from factory.engine.record.state import State
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.support.engine import mujoco
from factory.support.errors import InputError
from tests.paths import PAPER


@pytest.fixture(scope="module")
def layout():
    return factory.lay_out(factory.compile(factory.load_pag(PAPER)))


class Witness:
    """Keeps what a log should say, by other means."""

    def __init__(self, simulation: Simulation) -> None:
        self.rows: list[tuple] = []
        self.simulation = simulation
        self.observe(simulation.state())

    def observe(self, _: State) -> None:
        world, supervisor = self.simulation.physical, self.simulation.supervisor
        d, m = world.d, world.m
        on = [e for e in range(m.neq) if d.eq_active[e]]
        active = [(e, int(m.eq_obj1id[e]), int(m.eq_obj2id[e])) for e in on]
        pairs = [tuple(c.geom.tolist()) for c in d.contact]
        marking = [p for p, marked in enumerate(supervisor.marked) if marked]
        state = d.qpos.copy(), d.qvel.copy(), d.ctrl.copy()
        self.rows.append((world.time, *state, marking, active, pairs))


@pytest.fixture(scope="module")
def recorded(layout, tmp_path_factory: pytest.TempPathFactory):
    path = tmp_path_factory.mktemp("log") / "run.log"
    simulation = Simulation(layout, RunRequest("mujoco", units=2, seed=3, jitter=0.2))
    m = simulation.world.m
    part = m.geom("part/part3#1").id
    reach = 0.03  # the engine lists contacts from this far on, so that there are some to log
    m.geom_gap[part] = m.body_margin[m.geom_bodyid[part]] = reach
    witness = Witness(simulation)
    with LogWriter(path, simulation, command=["factory", "run"]) as writer:
        run = simulation.run([writer.observe, witness.observe])
    return path, run, witness, simulation


def test_a_log_says_what_happened(recorded) -> None:
    """To the bit, but for speeds and setpoints, whose last bits are noise."""
    path, run, witness, _ = recorded
    log = read_log(path)
    assert log.complete and is_log(path)
    assert len(log) == len(witness.rows) == round(run.sim_time_s / 0.01) + 1
    for row, (time, qpos, qvel, ctrl, marking, active, pairs) in enumerate(witness.rows):
        assert log.time[row] == time
        assert (log.qpos[row] == qpos).all() and np.abs(log.qvel[row] - qvel).max() < 1e-9
        assert log.ctrl is not None and np.abs(log.ctrl[row] - ctrl).max() < 1e-9
        assert log.marking[row].tolist() == marking
        assert [tuple(a) for a in log.active[row].tolist()] == active
        assert [tuple(c) for c in log.contacts[row].tolist()] == pairs
        assert len(log.distances[row]) == len(pairs)
    assert log.events == tuple((e.t, e.transition) for e in run.events)
    assert log.delivered[-1] == run.products == 2
    assert any(len(row[-1]) for row in witness.rows), (
        "no contact was logged: the test shows nothing"
    )


def test_a_large_log_is_read_in_pieces(recorded, monkeypatch: pytest.MonkeyPatch) -> None:
    """Only where its bytes come from depends on its size."""
    path, small = recorded[0], read_log(recorded[0])
    monkeypatch.setattr("factory.apps.log.content.LARGE", 1000)
    large = read_log(path)
    assert small.ends is not None and large.ends is not None
    for one, other in ((small, large), (small.ends, large.ends)):
        for name in ("qpos", "qvel", "ctrl"):
            rows, others = getattr(one, name), getattr(other, name)
            assert len(others) == len(rows) > 0 and others.shape == rows.shape
            assert all((others[n] == rows[n]).all() for n in (-1, *range(0, len(rows), 7)))
    assert watch_log(large)[0] == replace(watch_log(small)[0], time_s=ANY)


def longer(log: Path, times: int, path: Path) -> Path:
    """A log with the ticks of another so many times, one after the other, without contacts."""
    data = log.read_bytes()
    _, at = header_in(data)
    ticks: list[Arrays] = []
    for kind, tick, end in blocks(data, at):
        at = end if kind == b"M" else at
        ticks += [tick] if kind == b"T" else []
    span, made = ticks[-1]["time"][-1] + 0.01, ticks[-1]["delivered"][-1]
    with path.open("wb") as stream:
        stream.write(data[:at])
        for turn in range(times):
            for tick in ticks:
                later = {name: tick[name] + turn * span for name in ("time", "fired_t")}
                later["delivered"] = np.maximum(tick["delivered"], made if turn else 0)
                apart = {name: a[:0] for name, a in tick.items() if name.startswith("contact")}
                stream.write(block(b"T", {**tick, **later, **apart}))
    return path


def peak(path: Path) -> int:
    """The memory that going through the states of a log takes at most [bytes]."""
    tracemalloc.start()
    try:
        log = read_log(path)
        list(jumps(log, model_of(log)))
        for _ in observations(log):
            pass
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def test_the_memory_for_a_log_does_not_grow_with_its_states(
    recorded, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is kept of each row, such as its time, takes a small share of them."""
    monkeypatch.setattr("factory.apps.monitor.record.SPAN", 100)
    short, long = (longer(recorded[0], times, tmp_path / f"{times}") for times in (2, 6))
    log, more = read_log(long), peak(long) - peak(short)
    states = 8 * 4 / 6 * len(log) * (log.header["nq"] + log.header["nv"])
    assert 0 < more < states / 3, (more, states)


def test_a_row_is_found_by_its_time(recorded) -> None:
    log = read_log(recorded[0])
    for row, time in enumerate(log.time.tolist()):
        assert {log.row_at(time), log.row_at(time + 5e-10), log.row_at(time - 5e-10)} == {row}
    assert log.row_at(log.time[-1] + 1e-3) == len(log)
    assert log.row_at((log.time[0] + log.time[1]) / 2) == 1


def test_the_header_has_all_that_made_the_run(recorded) -> None:
    path, _, _, simulation = recorded
    header = read_log(path).header
    assert header["seed"] == 3 and header["jitter"] == 0.2 and header["units"] == 2
    assert header["world"] == "mujoco" and header["command"] == ["factory", "run"]
    assert header["pag"]["text"] == PAPER.read_text("utf-8") and len(header["pag"]["sha256"]) == 64
    assert header["versions"]["mujoco"] == mujoco.__version__
    assert header["settings"]["timestep"] == simulation.request.settings.timestep
    assert header["wip"] is None and len(header["start"]) == 6
    assert set(header["templates"]) == {"atomic", "mate", "weld", "dropoff"}
    places = simulation.layout.factory.net.threaded.places
    assert header["places"] == [place.name for place in places]


def test_the_model_in_a_log_is_the_engines(recorded) -> None:
    path, _, _, simulation = recorded
    log = read_log(path)
    assert log.xml == simulation.model.xml and dict(log.files) == dict(simulation.model.files)


def test_a_log_of_another_version_is_to_be_recorded_again(recorded, tmp_path: Path) -> None:
    data = recorded[0].read_bytes()
    old = tmp_path / "old.log"
    old.write_bytes(b"factory-log 1\n" + data[len(MAGIC) :])
    assert is_log(old)
    with pytest.raises(InputError, match="another version") as error:
        read_log(old)
    assert "record it again" in error.value.diagnostics[0].hint


def test_what_is_read_is_locked(recorded) -> None:
    log = read_log(recorded[0])
    for values in (
        log.time,
        log.qpos[0],
        log.qvel[0],
        log.ctrl[0],
        log.fired,
        log.marking.values,
        log.active.values,
    ):
        with pytest.raises(ValueError):
            values[...] = 0


def block_ends(data: bytes) -> list[int]:
    """Where the header and each block end."""
    at = len(MAGIC)
    at += LENGTH.size + LENGTH.unpack_from(data, at)[0]
    ends = [at]
    while at < len(data):
        at += HEAD.size + HEAD.unpack_from(data, at)[1]
        ends.append(at)
    return ends


def test_a_file_cut_off_anywhere_gives_its_beginning(recorded, tmp_path: Path) -> None:
    path = recorded[0]
    data, whole = path.read_bytes(), read_log(path)
    ends = block_ends(data)
    assert len(ends) > 6 and ends[-1] == len(data)
    cut = tmp_path / "cut.log"
    seen = []
    for end in ends:
        for at in {end - 1, end, end + 1, end + HEAD.size, end + 40}:
            if not ends[0] <= at < len(data):
                continue
            cut.write_bytes(data[:at])
            log = read_log(cut)
            seen.append(len(log))
            assert not log.complete
            assert all((log.qpos[row] == whole.qpos[row]).all() for row in range(len(log)))
            assert log.events == whole.events[: len(log.events)]
            if len(log):
                last = len(log) - 1
                assert (log.active[last] == whole.active[last]).all()
    assert 0 in seen and max(seen) == len(whole)


def test_a_damaged_block_ends_the_log(recorded, tmp_path: Path) -> None:
    data = bytearray(recorded[0].read_bytes())
    third = block_ends(bytes(data))[3]
    data[third + HEAD.size + 5] ^= 0x40
    broken = tmp_path / "broken.log"
    broken.write_bytes(data)
    assert 0 < len(read_log(broken)) < len(read_log(recorded[0]))


def test_no_bytes_give_a_traceback(recorded, tmp_path: Path) -> None:
    data, chance = recorded[0].read_bytes(), random.Random(7)
    path = tmp_path / "fuzz"
    inputs = [b"", MAGIC, MAGIC + b"\xff" * 4, MAGIC + LENGTH.pack(2) + b"{}"]
    inputs += [
        MAGIC + LENGTH.pack(len(j)) + j for j in (b"[]", b"7", b'{"nq":-1,"nv":2}', b'{"nq":{}}')
    ]
    inputs += [chance.randbytes(chance.randrange(200)) for _ in range(200)]
    inputs += [MAGIC + chance.randbytes(chance.randrange(200)) for _ in range(200)]
    for _ in range(200):
        copy = bytearray(data[: chance.randrange(len(data))])
        for _ in range(chance.randrange(1, 4)):
            if copy:
                copy[chance.randrange(min(len(copy), 4000))] = chance.randrange(256)
        inputs.append(bytes(copy))
    refused = 0
    for content in inputs:
        path.write_bytes(content)
        try:
            assert isinstance(read_log(path), Log)
        except InputError as error:
            refused += 1
            assert error.diagnostics[0].code == "BadLog" and error.diagnostics[0].hint
    assert refused > 300


def test_a_folder_or_nothing_is_no_log(tmp_path: Path) -> None:
    for path in (tmp_path, tmp_path / "nothing", PAPER):
        with pytest.raises(InputError, match="BadLog"):
            read_log(path)
        assert not is_log(path)


def test_a_log_that_cannot_be_written_is_refused(layout, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="BadLog"):
        LogWriter(tmp_path, Simulation(layout, RunRequest("ideal", units=1)))


def test_an_interrupted_run_leaves_a_closed_log(layout, tmp_path: Path) -> None:
    simulation = Simulation(layout, RunRequest("mujoco", units=1))

    def interrupt(state: State) -> None:
        if state.time > 1.234:
            raise KeyboardInterrupt

    path = tmp_path / "cut"
    with pytest.raises(KeyboardInterrupt), LogWriter(path, simulation) as writer:
        simulation.run([writer.observe, interrupt])
    log = read_log(path)
    assert log.complete and log.time[-1] == pytest.approx(1.24)


def test_the_ideal_world_logs_arc_lengths(layout, tmp_path: Path) -> None:
    simulation = Simulation(layout, RunRequest("ideal", units=2))
    with LogWriter(tmp_path / "ideal", simulation) as writer:
        run = simulation.run([writer.observe])
    log = read_log(tmp_path / "ideal")
    assert log.qpos.shape == (len(log), 6) and (log.qpos[-1] == simulation.world.x).all()
    assert log.xml == "" and not log.files
    assert all(len(log.active[row]) == len(log.contacts[row]) == 0 for row in range(len(log)))
    assert len(log.events) == len(run.events) and len(log.marking[0]) == 6


@given(arrays.arrays(np.float64, st.tuples(st.integers(1, 9), st.integers(0, 6))))
def test_rows_are_packed_without_loss(rows: np.ndarray) -> None:
    packed = pack_rows("x", rows)
    found = unpack_rows("x", packed, len(rows))
    assert (found.view(np.int64) == rows.view(np.int64)).all()
