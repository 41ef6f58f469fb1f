"""The log of a run, `run --log OUT`: its whole state after every tick, in one file that is only
appended to.

    factory-log 1\\n          magic
    <I length>{...}          header, JSON: versions, command line, world, seed, jitter, units,
                             settings, names of robots, places and transitions, the PAG's name,
                             text and SHA-256, nq, nv
    blocks                   see log_blocks: a letter, length, CRC-32, compressed arrays

    M  the model, once: `xml`, and `mesh/NAME` for each mesh file, bytes (mujoco only)
    T  ticks, about a simulated second of them:
       time (n,) [s], delivered (n,)      products that have left since the run began
       qpos (n, nq), qvel (n, nv)         the engine's; in the ideal world arc lengths and speeds
       marking_at, _count, marking        rows where the marking changes, how many places, which
       active_at, _count, active          the same for the active constraints: number, two bodies
       contact_at, _count, contact        rows with contacts, how many, pairs of geoms
       contact_dist                       their distances [m]
       fired_at, fired, fired_t           row, number and time [s] of the transitions fired
    E  the end, empty: the file was closed properly

Every block stands for itself. What was written is flushed with each, so a file that ends in the
middle of one lacks at most the last second."""

from __future__ import annotations

import hashlib
import json
import platform
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from types import MappingProxyType, TracebackType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from factory.errors import Diagnostic, InputError
from factory.log_blocks import LENGTH, Arrays, block, blocks, pack_rows, unpack_rows

if TYPE_CHECKING:
    from factory.pipeline import Source
    from factory.simulation import Simulation

Index = NDArray[np.int32]

MAGIC = b"factory-log 1\n"


class LogWriter:
    """An observer that writes a log; close it, or use it as a context manager.

    `source`: the PAG with its templates, if there is more to it than the factory knows; `command`:
    the command line, this process's unless given. Raises InputError (BadLog) where the file cannot
    be written."""

    def __init__(
        self,
        path: Path | str,
        simulation: Simulation,
        source: Source | None = None,
        command: Sequence[str] | None = None,
    ) -> None:
        self.path, self.world = Path(path), simulation.world
        self.physical = simulation.model is not None
        self.before = int(simulation.before)
        net = simulation.supervisor.net
        self.number = {t.name: n for n, t in enumerate(net.transitions)}
        self.ticks = max(1, round(1.0 / simulation.settings.tick))
        nq, nv = (s.shape[0] for s in self._state())
        self.qpos, self.qvel = np.empty((self.ticks, nq)), np.empty((self.ticks, nv))
        self.seen = 0
        self.row = 0
        self.marked = self.aimed = b""
        self._start()
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self.file = self.path.open("wb")
        except OSError as error:
            raise InputError(_bad(self.path, f"cannot be written: {error.strerror}")) from error
        header = json.dumps(_header(simulation, source, command, nq, nv)).encode()
        self.file.write(MAGIC + LENGTH.pack(len(header)) + header)
        if simulation.model is not None:
            files = {f"mesh/{name}": content for name, content in simulation.model.files.items()}
            packed = {"xml": simulation.model.xml.encode(), **files}
            self.file.write(block(b"M", {k: np.frombuffer(v, "u1") for k, v in packed.items()}, 6))
        self.observe(simulation.world, simulation.supervisor)

    def __enter__(self) -> LogWriter:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def __call__(self, world: Any, supervisor: Any) -> None:
        self.observe(world, supervisor)

    def observe(self, world: Any, supervisor: Any) -> None:
        """Record the state after a tick."""
        row = self.row
        self.qpos[row], self.qvel[row] = self._state()
        self.time.append(world.time)
        self.delivered.append(world.delivered() - self.before)
        marked = bytes(supervisor.marked)
        if marked != self.marked:
            self.marked = marked
            self.markings.append((row, np.flatnonzero(np.frombuffer(marked, "u1"))))
        if self.physical:
            self._constraints(world, row)
        events = supervisor.events
        while self.seen < len(events):
            event = events[self.seen]
            self.fired.append((row, self.number[event.transition], event.t))
            self.seen += 1
        self.row = row + 1
        if self.row == self.ticks:
            self.flush()

    def flush(self) -> None:
        """Write the ticks since the last block."""
        if self.row:
            self.file.write(block(b"T", self._arrays()))
            self.file.flush()
            self._start()

    def close(self) -> None:
        """Write what is left, and the end."""
        if not self.file.closed:
            self.flush()
            self.file.write(block(b"E", {}))
            self.file.close()

    def _start(self) -> None:
        self.row = 0
        self.time: list[float] = []
        self.delivered: list[int] = []
        self.marked = self.aimed = b""
        self.markings: list[tuple[int, Any]] = []
        self.active: list[tuple[int, Any]] = []
        self.contacts: list[tuple[int, Any, Any]] = []
        self.fired: list[tuple[int, int, float]] = []

    def _state(self) -> tuple[Any, Any]:
        if self.physical:
            return self.world.d.qpos, self.world.d.qvel
        return self.world.x, self.world.v

    def _constraints(self, world: Any, row: int) -> None:
        m, d = world.m, world.d
        aimed = d.eq_active.tobytes() + m.eq_obj2id.tobytes() + m.eq_obj1id.tobytes()
        if aimed != self.aimed:
            self.aimed = aimed
            on = np.flatnonzero(d.eq_active)
            self.active.append((row, np.stack([on, m.eq_obj1id[on], m.eq_obj2id[on]], axis=1)))
        if d.ncon:
            contact = d.contact
            self.contacts.append((row, contact.geom.copy(), contact.dist.copy()))

    def _arrays(self) -> Arrays:
        fired = np.array(self.fired, float).reshape(-1, 3)
        return {
            "time": np.array(self.time, float),
            "delivered": np.array(self.delivered, np.int32),
            **pack_rows("qpos", self.qpos[: self.row]),
            **pack_rows("qvel", self.qvel[: self.row]),
            **_ragged("marking", self.markings, ()),
            **_ragged("active", self.active, (3,)),
            **_ragged("contact", [c[:2] for c in self.contacts], (2,)),
            "contact_dist": np.concatenate([np.zeros(0), *(c[2] for c in self.contacts)]),
            "fired_at": fired[:, 0].astype(np.int32),
            "fired": fired[:, 1].astype(np.int32),
            "fired_t": fired[:, 2],
        }


def _ragged(name: str, rows: Sequence[tuple[int, Any]], shape: tuple[int, ...]) -> Arrays:
    values = [np.zeros((0, *shape), np.int32), *(np.asarray(v, np.int32) for _, v in rows)]
    return {
        f"{name}_at": np.array([at for at, _ in rows], np.int32),
        f"{name}_count": np.array([len(v) for _, v in rows], np.int32),
        name: np.concatenate(values),
    }


def _header(
    simulation: Simulation, source: Source | None, command: Sequence[str] | None, nq: int, nv: int
) -> dict[str, Any]:
    factory = simulation.layout.factory
    net = simulation.supervisor.net
    pag = source.pag if source else factory.pag
    file = Path(pag.file)
    text = file.read_text("utf-8", errors="replace") if file.is_file() else ""
    return {
        "versions": {"python": platform.python_version(), **_versions()},
        "command": list(sys.argv if command is None else command),
        "world": simulation.kind,
        "seed": simulation.seed,
        "jitter": simulation.jitter,
        "units": simulation.units,
        "settings": asdict(simulation.settings),
        "product": file.stem or "factory",
        "pag": {
            "file": str(file),
            "text": text,
            "sha256": hashlib.sha256(text.encode()).hexdigest(),
        },
        "robots": [robot.name for robot in factory.robots],
        "places": [place.name for place in net.places],
        "transitions": [transition.name for transition in net.transitions],
        "nq": nq,
        "nv": nv,
    }


def _versions() -> dict[str, str]:
    found = {}
    for name in ("klavins-factory", "mujoco", "numpy"):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found


@dataclass(frozen=True, slots=True)
class Ragged:
    """For each row of a log an array of its own: `values` from starts[i] to ends[i]."""

    values: NDArray[Any] = field(repr=False)
    starts: NDArray[np.int64] = field(repr=False)
    ends: NDArray[np.int64] = field(repr=False)

    def __getitem__(self, row: int) -> NDArray[Any]:
        return self.values[self.starts[row] : self.ends[row]]


@dataclass(frozen=True)
class Log:
    """A log, read: locked arrays over n ticks, the first before the run began.

    `marking[i]`: numbers of the marked places; `active[i]` (k, 3): active constraints, and the two
    bodies each joins; `contacts[i]` (k, 2) geoms, `distances[i]` (k,) [m]; `fired` and `fired_t`:
    transitions by number and time [s]. `complete`: whether the file was closed properly."""

    header: Mapping[str, Any] = field(repr=False)
    xml: str = field(repr=False)
    files: Mapping[str, bytes] = field(repr=False)
    time: NDArray[np.float64] = field(repr=False)
    delivered: Index = field(repr=False)
    qpos: NDArray[np.float64] = field(repr=False)
    qvel: NDArray[np.float64] = field(repr=False)
    marking: Ragged = field(repr=False)
    active: Ragged = field(repr=False)
    contacts: Ragged = field(repr=False)
    distances: Ragged = field(repr=False)
    fired: Index = field(repr=False)
    fired_t: NDArray[np.float64] = field(repr=False)
    complete: bool = True

    def __len__(self) -> int:
        return len(self.time)

    @cached_property
    def events(self) -> tuple[tuple[float, str], ...]:
        """Time [s] and name of every transition that fired."""
        names = self.header["transitions"]
        return tuple((t, names[n]) for t, n in zip(self.fired_t.tolist(), self.fired, strict=True))


def read_log(path: Path | str) -> Log:
    """The log in a file; what a cut-off file still has. Raises InputError (BadLog) for anything
    else."""
    path = Path(path)
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(_bad(path, f"cannot be read: {error.strerror}")) from error
    if not data.startswith(MAGIC):
        raise InputError(_bad(path, "is no log of factory"))
    try:
        return _read(memoryview(data)[len(MAGIC) :])
    except (ValueError, KeyError, IndexError, TypeError, AttributeError, RecursionError) as error:
        raise InputError(_bad(path, f"is damaged: {error}")) from error


def is_log(path: Path | str) -> bool:
    """Whether a file begins as a log does."""
    try:
        with Path(path).open("rb") as file:
            return file.read(len(MAGIC)) == MAGIC
    except OSError:
        return False


def _read(data: memoryview) -> Log:
    if len(data) < LENGTH.size:
        raise ValueError("it ends in its header")
    (length,) = LENGTH.unpack_from(data)
    header = json.loads(bytes(data[LENGTH.size : LENGTH.size + length]))
    nq, nv = int(header["nq"]), int(header["nv"])
    xml, files, complete = "", {}, False
    ticks: list[Arrays] = []
    for kind, arrays in blocks(data[LENGTH.size + length :]):
        if kind == b"M":
            xml = arrays["xml"].tobytes().decode()
            files = {k[5:]: a.tobytes() for k, a in arrays.items() if k.startswith("mesh/")}
        elif kind == b"T":
            ticks.append(arrays)
        complete = kind == b"E"
    states = [[unpack_rows(q, a, len(a["time"])) for a in ticks] for q in ("qpos", "qvel")]
    qpos, qvel = (
        _locked(np.concatenate([np.zeros((0, n)), *rows]))
        for n, rows in zip((nq, nv), states, strict=True)
    )
    counts = [len(a["time"]) for a in ticks]
    return Log(
        MappingProxyType(header),
        xml,
        MappingProxyType(files),
        _joined("time", ticks, np.float64),
        _joined("delivered", ticks, np.int32),
        qpos,
        qvel,
        _lasting("marking", ticks, counts),
        _lasting("active", ticks, counts),
        _single("contact", "contact", ticks, counts),
        _single("contact", "contact_dist", ticks, counts),
        _joined("fired", ticks, np.int32),
        _joined("fired_t", ticks, np.float64),
        complete,
    )


def _locked(values: Any) -> Any:
    values.setflags(write=False)
    return values


def _joined(name: str, ticks: Sequence[Arrays], kind: Any) -> Any:
    return _locked(np.concatenate([np.zeros(0, kind), *(a[name] for a in ticks)]))


def _spans(
    name: str, ticks: Sequence[Arrays], counts: Sequence[int]
) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Rows of the whole log at which something is recorded, and where its values start and end."""
    base = np.cumsum([0, *counts])
    at = np.concatenate(
        [np.zeros(0, int), *(a[f"{name}_at"] + b for a, b in zip(ticks, base, strict=False))]
    )
    ends = np.cumsum(np.concatenate([np.zeros(0, int), *(a[f"{name}_count"] for a in ticks)]))
    return at, np.concatenate([[0], ends])[: len(ends)], ends


def _lasting(name: str, ticks: Sequence[Arrays], counts: Sequence[int]) -> Ragged:
    """Values that hold until the next are recorded."""
    at, starts, ends = _spans(name, ticks, counts)
    values = np.concatenate([a[name] for a in ticks]) if ticks else np.zeros((0,), np.int32)
    if not len(at):
        nothing = np.zeros(sum(counts), int)
        return Ragged(_locked(values.reshape(0, *values.shape[1:])), nothing, nothing)
    which = np.searchsorted(at, np.arange(sum(counts)), side="right") - 1
    if which.min(initial=0) < 0:
        raise ValueError(f"the first tick has no {name}")
    return Ragged(_locked(values), starts[which], ends[which])


def _single(name: str, values: str, ticks: Sequence[Arrays], counts: Sequence[int]) -> Ragged:
    """Values of one row alone."""
    at, first, last = _spans(name, ticks, counts)
    starts, ends = np.zeros(sum(counts), int), np.zeros(sum(counts), int)
    starts[at], ends[at] = first, last
    found = np.concatenate([a[values] for a in ticks]) if ticks else np.zeros(0)
    return Ragged(_locked(found), starts, ends)


def _bad(path: Path, words: str) -> Diagnostic:
    return Diagnostic(
        "BadLog", f"'{path}' {words}", None, "`factory run FILE.pag --log OUT` writes one"
    )
