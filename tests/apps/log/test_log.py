"""Logs: what is written is read back to the bit, from whole files and from cut-off ones; other
files are refused with a diagnostic."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from unittest.mock import ANY

import pytest

import factory
from factory.apps.log import MAGIC, LogWriter, is_log, read_log
from factory.apps.log.blocks import HEAD, LENGTH
from factory.apps.monitor.record import watch_log
from factory.engine.record.state import State
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
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


def test_a_log_of_another_version_is_to_be_recorded_again(recorded, tmp_path: Path) -> None:
    data = recorded[0].read_bytes()
    old = tmp_path / "old.log"
    old.write_bytes(b"factory-log 1\n" + data[len(MAGIC) :])
    assert is_log(old)
    with pytest.raises(InputError, match="another version") as error:
        read_log(old)
    assert "record it again" in error.value.diagnostics[0].hint


def block_ends(data: bytes) -> list[int]:
    """Where the header and each block end."""
    at = len(MAGIC)
    at += LENGTH.size + LENGTH.unpack_from(data, at)[0]
    ends = [at]
    while at < len(data):
        at += HEAD.size + HEAD.unpack_from(data, at)[1]
        ends.append(at)
    return ends


def test_a_damaged_block_ends_the_log(recorded, tmp_path: Path) -> None:
    data = bytearray(recorded[0].read_bytes())
    third = block_ends(bytes(data))[3]
    data[third + HEAD.size + 5] ^= 0x40
    broken = tmp_path / "broken.log"
    broken.write_bytes(data)
    assert 0 < len(read_log(broken)) < len(read_log(recorded[0]))


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
