"""Logs: what is written is read back to the bit, from whole files and from cut-off ones; other
files are refused with a diagnostic. Logs whose values are damaged: each command refuses them with a
diagnostic, or still works."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import ANY

import numpy as np
import pytest

import factory
from factory.apps.log import MAGIC, LogWriter, is_log, read_log
from factory.apps.log.blocks import HEAD, LENGTH, Arrays, block, unpacked
from factory.apps.log.model import model_of
from factory.apps.monitor.record import watch_log
from factory.engine.record.state import State
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.support.errors import InputError
from tests.command_line import Terminal
from tests.layout_values import paper_layout
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


OF_A_PROJECT = (
    *("product", "pag", "pag.file", "pag.sha256", "plan", "plan.forms", "plan.turns", "settings"),
    *("layout.clearance", "layout.guidepaths", "layout.visits", "layout.outfeed"),
    *("layout.hands", "layout.plain"),
)
"""What a header has of a project and its layout, but for texts that are read later."""

CHECKED = (
    *OF_A_PROJECT,
    *("nq", "nv", "versions", "command", "world", "seed", "jitter", "units", "wip", "fuse"),
    *("chosen", "distributed", "faults", "start", "settings.timestep", "monitor"),
    *("monitor.goals", "monitor.radii", "monitor.places", "monitor.patience", "robots"),
    *("places", "transitions"),
)
"""All that is checked when a header is read."""

Blocks = list[tuple[bytes, Arrays]]


def taken_apart(path: Path) -> tuple[dict[str, Any], Blocks]:
    """The header and the blocks of a log."""
    data = path.read_bytes()[len(MAGIC) :]
    (length,) = LENGTH.unpack_from(data)
    at = LENGTH.size + length
    found = []
    while at < len(data):
        kind, length, _ = HEAD.unpack_from(data, at)
        found.append((kind, unpacked(data[at + HEAD.size : at + HEAD.size + length])))
        at += HEAD.size + length
    return json.loads(data[LENGTH.size : LENGTH.size + LENGTH.unpack_from(data)[0]]), found


def put_together(path: Path, header: Mapping[str, Any], blocks: Blocks) -> Path:
    """A log of a header and blocks."""
    text = json.dumps(header).encode()
    content = b"".join(block(kind, arrays) for kind, arrays in blocks)
    path.write_bytes(MAGIC + LENGTH.pack(len(text)) + text + content)
    return path


def replaced(table: Any, words: list[str], value: Any) -> Any:
    """A table with another value for a key, which may be in a table within."""
    first, *rest = words
    return {**table, first: replaced(table[first], rest, value) if rest else value}


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The log of the beginning of a run."""
    path = tmp_path_factory.mktemp("damage") / "run.log"
    simulation = Simulation(paper_layout())
    with LogWriter(path, simulation) as writer:
        simulation.run([writer.observe], 0.2)
    return path


@pytest.fixture
def tried(run: Terminal, tmp_path: Path) -> Callable[[Path], list[int]]:
    """What each command that reads logs ends with; `Terminal` sees to it that none fails."""
    commands: tuple[tuple[object, ...], ...] = (
        ("monitor", "LOG", "-q"),
        ("report", "LOG", "-o", tmp_path / "a.html", "-q"),
        ("render", "LOG", "-o", tmp_path / "a.png", "--size", "64x64", "-q"),
        ("export", "LOG", "--format", "csv", "-o", tmp_path / "a.csv", "-q"),
        ("analyze", PAPER, "--measured", "LOG", "-q"),
    )
    return lambda path: [
        run(*(path if word == "LOG" else word for word in command)).status for command in commands
    ]


def is_refused(path: Path, words: str = "") -> bool:
    """Whether a log is refused when it is read, with these words."""
    try:
        read_log(path)
    except InputError as error:
        (found,) = error.diagnostics
        assert found.code == "BadLog" and words in found.message, found
        return True
    return False


def test_damaged_headers(log: Path, tmp_path: Path) -> None:
    """What no run can have is refused when it is read, and named."""
    header, blocks = taken_apart(log)
    bad = tmp_path / "bad.log"
    for name in CHECKED:
        put_together(bad, replaced(header, name.split("."), -1), blocks)
        assert is_refused(bad, name.partition(".")[0]), name


@pytest.mark.parametrize(
    ("name", "value"),
    [("templates", {"mate": "words"}), ("start", [0, 1]), ("monitor.goals", [[0.1]])],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_headers_of_other_factories(
    log: Path, tmp_path: Path, name: str, value: object, tried: Callable[[Path], list[int]]
) -> None:
    header, blocks = taken_apart(log)
    bad = put_together(tmp_path / "bad.log", replaced(header, name.split("."), value), blocks)
    assert tried(bad)[0] == 2


def longer(values: np.ndarray) -> np.ndarray:
    return np.concatenate([values, values[-1:]])


def first(value: float) -> Callable[[np.ndarray], np.ndarray]:
    """The same array with another first value."""

    def change(values: np.ndarray) -> np.ndarray:
        return np.concatenate([np.full_like(values[:1], value), values[1:]])

    return change


@pytest.mark.parametrize(
    ("name", "change", "words"),
    [
        ("time", longer, "time and delivered differ"),
        ("time", first(np.nan), "time is out of range"),
        ("time", first(9.0), "time goes back"),
        ("delivered", first(9), "one by one"),
        ("fired", lambda values: values.astype("<f8"), "fired is <f8"),
        ("fired_t", first(np.inf), "fired_t is out of range"),
        ("marking", first(-1), "marking is out of range"),
        ("marking_at", first(-1), "marking_at is out of range"),
        ("marking_count", first(1), "marking is not what"),
        ("qpos_first", longer, "qpos has"),
        ("qvel_change", lambda values: values.astype("<i4"), "qvel has <i4 (8, "),
        ("qpos_moving", first(-1), "qpos_moving is out of range"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_damaged_ticks(
    log: Path, tmp_path: Path, name: str, change: Callable[..., Any], words: str
) -> None:
    header, blocks = taken_apart(log)
    found = [
        (kind, {**arrays, name: change(arrays[name])} if kind == b"T" else arrays)
        for kind, arrays in blocks
    ]
    assert is_refused(put_together(tmp_path / "bad.log", header, found), words)


@pytest.mark.parametrize("name", ["qpos_change", "active_at"])
def test_a_block_that_lacks_an_array(log: Path, tmp_path: Path, name: str) -> None:
    header, blocks = taken_apart(log)
    found = [(kind, {n: a for n, a in arrays.items() if n != name}) for kind, arrays in blocks]
    assert is_refused(put_together(tmp_path / "bad.log", header, found), f"it has no '{name}'")


def test_constraints_and_contacts_of_no_model(log: Path) -> None:
    value = 10**6
    kept = read_log(log)
    for column in range(3):
        numbers = kept.active.values.copy()
        numbers[-1, column] = value
        with pytest.raises(InputError, match="BadLog the log's constraints"):
            model_of(replace(kept, active=replace(kept.active, values=numbers)))
    pairs = np.array([[0, value]], np.int32)
    with pytest.raises(InputError, match="BadLog the log's constraints"):
        model_of(replace(kept, contacts=replace(kept.contacts, values=pairs)))
    with pytest.raises(InputError, match="BadLog the log's states"):
        model_of(replace(kept, qvel=np.array(kept.qvel)[:, 1:]))


def test_a_file_that_is_made_to_fill_the_memory(log: Path, tmp_path: Path) -> None:
    """Random numbers that each stand still for many ticks, and a block of nothing but zeros."""
    header, blocks = taken_apart(log)
    chance, count = np.random.default_rng(1), 20_000
    ticks = {name: values[:0] for name, values in blocks[1][1].items()}
    ticks |= {"time": np.arange(count) / 100, "delivered": np.zeros(count, np.int32)}
    ticks |= {f"{state}_first": chance.random(count) for state in ("qpos", "qvel")}
    ticks |= {f"{state}_change": np.zeros((8, 0), np.uint8) for state in ("qpos", "qvel", "ctrl")}
    wide = {**header, "nq": count, "nv": count}
    bad = put_together(tmp_path / "bad.log", wide, [(b"T", ticks)])
    assert is_refused(bad, "the states in a block of it take too much memory")
    zeros = {"mesh/a": np.zeros(10**6, np.uint8)}
    bad = put_together(tmp_path / "bad.log", header, [(b"M", zeros)])
    assert is_refused(bad, "unpacks to more than 200 times")


@pytest.mark.parametrize(("error", "words"), [(MemoryError, "too much")])
def test_a_log_that_does_not_fit(
    log: Path, monkeypatch: pytest.MonkeyPatch, error: type[Exception], words: str
) -> None:
    def full(*_: object) -> None:
        raise error("too much")

    monkeypatch.setattr("factory.apps.log.blocks.unpacked", full)
    assert is_refused(log, words)


def planted(after: str, what: str) -> Callable[[str], str]:
    """A model with something more after the first of these words."""
    return lambda xml: xml.replace(after, after + what, 1)


STRANGE: Mapping[str, tuple[Callable[[str], str], str]] = {
    "above": (planted("<asset>", '<mesh name="x" file="../x.stl"/>'), "is not in the log"),
    "folder": (lambda xml: xml.replace('meshdir="meshes"', 'meshdir="/tmp"'), "'/tmp'"),
    "texture": (planted('type="skybox"', ' file="/tmp/x.png"'), "has 'file'"),
    "memory": (lambda xml: xml.replace('memory="64M"', 'memory="64G"'), "64G MiB"),
    "user": (planted('<geom name="floor"', f' user="{"1 " * 9}"'), "more than 8 numbers"),
    "samples": (lambda xml: xml.replace('nsample="', 'nsample="9999999'), "nsample is"),
    "deep": (planted("<worldbody>", "<body>" * 99 + "</body>" * 99), "deep in each other"),
    "keys": (planted("</actuator>", f"<keyframe>{'<key/>' * 9}</keyframe>"), "key comes to 9"),
    "entities": (lambda xml: f'<!DOCTYPE m [<!ENTITY a "b">]>{xml}', "document type"),
    "no model": (lambda xml: "<robot/>", "<robot>"),
    "no XML": (lambda xml: "words", "syntax error"),
}
"""What no model of a factory has: how it comes into one, and what is said of it."""


@pytest.mark.parametrize("name", STRANGE)
def test_models_that_are_not_written_do_not_reach_the_engine(
    log: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    change, words = STRANGE[name]
    kept = read_log(log)
    assert change(kept.xml) != kept.xml
    monkeypatch.setattr("factory.apps.log.model.compiled", pytest.fail)
    with pytest.raises(InputError, match=rf"BadLog the log's model is broken: .*{words}"):
        model_of(replace(kept, xml=change(kept.xml)))


def test_a_stranger_s_log_reads_no_file(
    log: Path, tmp_path: Path, tried: Callable[[Path], list[int]]
) -> None:
    """The engine would include the pose of a robot's head from a file that the model names."""
    (tmp_path / "secret.xml").write_text('<mujoco><worldbody><body name="x"/></worldbody></mujoco>')
    header, blocks = taken_apart(log)
    (kind, model), *ticks = blocks
    xml = model["xml"].tobytes().decode()
    told = planted("</worldbody>", f'<include file="{tmp_path / "secret.xml"}"/>')(xml)
    bad = [(kind, {**model, "xml": np.frombuffer(told.encode(), np.uint8)}), *ticks]
    # the monitor compares the model with that of the PAG, and compiles it no more than the others
    assert tried(put_together(tmp_path / "bad.log", header, bad))[:3] == [1, 2, 2]
