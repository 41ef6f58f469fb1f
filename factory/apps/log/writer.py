"""The writer of a log, an observer of a run."""

from __future__ import annotations

import json
import platform
import sys
from collections.abc import Sequence
from contextlib import suppress
from io import FileIO
from os import SEEK_CUR
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from factory.api import (
    Diagnostic,
    Event,
    FactoryError,
    InputError,
    LayoutTable,
    MonitorSubject,
    Observation,
    Project,
    Recordable,
    Recorder,
    RunVerdict,
    State,
    Undone,
)
from factory.apps.log.blocks import LENGTH, MAGIC, STATES, Arrays, bad_log, block, pack_rows
from factory.apps.log.cell_table import cell_in
from factory.apps.log.checks import HEADER
from factory.apps.log.content import RECORD, content_of
from factory.apps.log.failed import Written
from factory.apps.log.project_table import project_table
from factory.apps.log.reader import digest_of, header_in
from factory.support.arrays import Array
from factory.support.claim import claimed
from factory.support.files import unwritten
from factory.support.tables import table_of
from factory.support.version import release

if TYPE_CHECKING:
    from factory.api import Model

GRAIN = 2.0**-30
"""What speeds [m/s] and setpoints [m] are whole multiples of, a nanometre: their last bits are
noise, which takes half of a log. Positions are kept to the last bit."""


class _Ticks:
    """The ticks of a block: lists with an entry for each tick, or with a row number and the values
    of that row; the rows that are ends of operations; undos; the last marking and constraints."""

    def __init__(self) -> None:
        self.time: list[float] = []
        self.delivered: list[int] = []
        self.states: list[tuple[NDArray[np.float64], ...]] = []
        self.markings: list[tuple[int, Any]] = []
        self.active: list[tuple[int, Any]] = []
        self.contacts: list[tuple[int, Any, Any]] = []
        self.fired: list[tuple[int, int, float]] = []
        self.ended: list[int] = []
        self.undone: list[object] = []
        self.marked: bytes | None = None
        self.welds: NDArray[np.intp] | None = None

    def arrays(self) -> Arrays:
        """The arrays of the block."""
        fired = np.array(self.fired, float).reshape(-1, 3)
        states = zip(STATES, zip(*self.states, strict=True), strict=False)
        arrays: Arrays = {
            "time": np.array(self.time, float),
            "delivered": np.array(self.delivered, np.int32),
        }
        for name, rows in states:
            arrays |= pack_rows(name, np.array(rows))
        return {
            **arrays,
            **_ragged("marking", self.markings, ()),
            **_ragged("active", self.active, (3,)),
            **_ragged("contact", [c[:2] for c in self.contacts], (2,)),
            "contact_dist": np.concatenate([np.zeros(0), *(c[2] for c in self.contacts)]),
            "fired_at": fired[:, 0].astype(np.int32),
            "fired": fired[:, 1].astype(np.int32),
            "fired_t": fired[:, 2],
            "ended_at": np.array(self.ended, np.int32),
            **({"undone": _text(json.dumps(self.undone))} if self.undone else {}),
        }


class LogWriter(Recorder):
    """Writes a log, which it locks; to be closed, or used as a context manager.

    `project`: the project of the factory, where there is one; `command`: the command line, by
    default that of this process; `going_on`: the claimed file of a log that is continued, at its
    end. `trouble`: what ended the run early, if anything. Raises InputError where the file cannot
    be written (BadLog), is locked by another run, or the disk is full (BadFile)."""

    def __init__(
        self,
        path: Path | str,
        simulation: Recordable,
        project: Project | None = None,
        command: Sequence[str] | None = None,
        going_on: FileIO | None = None,
    ) -> None:
        self.path, self.simulation, now = Path(path), simulation, simulation.state()
        net = simulation.layout.factory.net.threaded
        self.numbers = {t.name: n for n, t in enumerate(net.transitions)}
        self.most = rows_of_a_block(simulation.request.settings.tick)
        self.ticks, self.written = _Ticks(), Written(len(now.events))
        if going_on is not None and now.time:
            self.written.complete(now.account)
        self.trouble: Diagnostic | None = None
        self.file = self._begun(now, project, command) if going_on is None else going_on
        if going_on is None or not now.time:
            self.observe(now)
        simulation.at_ends.append(self.ended)

    def _begun(self, now: State, project: Project | None, command: Sequence[str] | None) -> FileIO:
        """The file, with its header and the model."""
        header = json.dumps(_header(self.simulation, now, project, command)).encode()
        content = MAGIC + LENGTH.pack(len(header)) + header + _model(self.simulation)
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            file = self.file = claimed(self.path)
        except OSError as error:
            raise InputError(bad_log(self.path, f"cannot be written: {error.strerror}")) from error
        try:
            self._append(content)
        except InputError:
            if self.path.is_file():
                self.path.unlink()
            file.close()
            raise
        return file

    def ended(self, state: State) -> None:
        """Record the state in which operations have ended, before the engine continues."""
        if not self.file.closed:
            self.ticks.ended.append(len(self.ticks.time))
            self._record(state)

    def observe(self, state: State) -> None:
        self._record(state)
        if len(self.ticks.time) >= self.most:
            self.flush()

    def _record(self, state: State) -> None:
        """A row of the log."""
        ticks, row, seen = self.ticks, len(self.ticks.time), state.observation
        ticks.time.append(seen.time)
        ticks.delivered.append(state.made)
        ticks.states.append(_rounded(seen))
        marked = bytes(state.marked)
        if marked != ticks.marked:
            ticks.marked = marked
            ticks.markings.append((row, np.flatnonzero(np.frombuffer(marked, "u1"))))
        if seen.welds is not ticks.welds:
            ticks.welds = seen.welds
            ticks.active.append((row, seen.welds))
        if seen.contacts is not None:
            geoms, distances = seen.contacts
            ticks.contacts.append((row, geoms.copy(), distances.copy()))
        for number, event in enumerate(
            state.events[self.written.events :], start=self.written.events
        ):
            if isinstance(event, Undone):
                before = sum(isinstance(e, Event) for e in state.events[:number])
                ticks.undone.append(table_of((before, event)))
                continue
            ticks.fired.append((row, self.numbers[event.transition], event.t))
        self.written.events = len(state.events)

    def flush(self) -> None:
        """Write the ticks since the last block."""
        ticks, self.ticks = self.ticks, _Ticks()
        if ticks.time:
            news = self.written.news(self.simulation.state().account)
            failures = {"failures": np.frombuffer(news, "u1")} if news else {}
            self._append(block(b"T", {**ticks.arrays(), **failures, **self._units()}))

    def _units(self) -> Arrays:
        """The units of the net that are made on demand, as far as that is fixed; of how many it is
        known comes last."""
        word = self.simulation.word
        return {"units": np.array([*word.units, word.fixed], np.int32)} if word.demand else {}

    def end(self, trouble: Diagnostic | None) -> None:
        self.trouble = trouble

    def __exit__(self, *raised: object) -> None:
        error = raised[1]
        if isinstance(error, KeyboardInterrupt):
            self.end(Diagnostic("Interrupted", "stopped by the user"))
        elif isinstance(error, FactoryError):
            self.end(error.diagnostics[0])
        elif error is not None:
            self.end(Diagnostic("Internal", f"{type(error).__name__}: {error}"))
        self.close()

    def close(self) -> None:
        """Write the remaining ticks and the last block."""
        if self.file.closed:
            return
        try:
            self.flush()
        finally:
            with self.file:
                self._append(block(b"E", self._end()))

    def _end(self) -> Arrays:
        """The arrays of the last block."""
        texts = {}
        if self.trouble is not None:
            texts = {"code": self.trouble.code, "message": self.trouble.message}
        if (figures := self.simulation.figures()) is not None:
            header, _ = header_in(content_of(self.path, RECORD))
            kept = {**RunVerdict.kept_figures(figures), HEADER: digest_of(header)}
            texts["figures"] = json.dumps(kept)
        if (account := self.simulation.state().account) is not None:
            texts["failures"] = json.dumps(table_of(account.report()))
        return {name: _text(text) for name, text in texts.items()}

    def _append(self, content: bytes) -> None:
        """Append all of it or, where the disk is full, nothing, so that the file can be closed."""
        left = memoryview(content)
        try:
            while left:
                left = left[self.file.write(left) :]
        except OSError as error:
            with suppress(OSError):
                self.file.truncate(self.file.seek(len(left) - len(content), SEEK_CUR))
            raise unwritten(self.path, error) from error


def rows_of_a_block(tick: float) -> int:
    """Least number of rows of a block, except the last of a run: about a simulated second, in
    ticks of this duration [s]."""
    return max(1, round(1.0 / tick))


def _rounded(seen: Observation) -> tuple[Array, ...]:
    """A state as a log keeps it. In the ideal world there are no setpoints, and speeds are kept to
    the last bit."""
    if not len(seen.ctrl):
        return seen.qpos.copy(), seen.qvel.copy()
    return seen.qpos.copy(), _coarse(seen.qvel), _coarse(seen.ctrl)


def _coarse(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Values as whole multiples of GRAIN, without a negative zero."""
    return np.rint(values / GRAIN) * GRAIN + 0.0


def _text(text: str) -> NDArray[np.uint8]:
    """A text as an array."""
    return np.frombuffer(text.encode(), "u1")


def _ragged(name: str, rows: Sequence[tuple[int, Any]], shape: tuple[int, ...]) -> Arrays:
    values = [np.zeros((0, *shape), np.int32), *(np.asarray(v, np.int32) for _, v in rows)]
    return {
        f"{name}_at": np.array([at for at, _ in rows], np.int32),
        f"{name}_count": np.array([len(v) for _, v in rows], np.int32),
        name: np.concatenate(values),
    }


def _model(simulation: Recordable) -> bytes:
    """The block of the engine's model; nothing in the ideal world."""
    if simulation.model is None:
        return b""
    return block(b"M", {k: np.frombuffer(v, "u1") for k, v in packed(simulation.model).items()}, 6)


def packed(model: Model | None) -> dict[str, bytes]:
    """The texts and files of the engine's model as a log has them; none in the ideal world."""
    if model is None:
        return {}
    files = {f"mesh/{name}": content for name, content in model.files.items()}
    return {"xml": model.xml.encode(), **files}


def _header(
    simulation: Recordable, now: State, project: Project | None, command: Sequence[str] | None
) -> dict[str, Any]:
    layout, net = simulation.layout, simulation.layout.factory.net.threaded
    factory, account = layout.factory, now.account
    return {
        **_project(simulation, project),
        "versions": {"python": platform.python_version(), **versions()},
        "command": list(sys.argv if command is None else command),
        "world": simulation.request.world,
        "seed": simulation.request.seed,
        "jitter": simulation.request.jitter,
        "units": simulation.request.units,
        "wip": simulation.request.wip,
        "chosen": {
            "timestep": simulation.asked.settings.timestep == "auto",
            "wip": simulation.asked.wip is None,
        },
        "distributed": simulation.request.distributed,
        **({} if account is None else {"faults": account.given}),
        **({"demand": table_of(demand)} if (demand := simulation.request.demand) else {}),
        "fuse": simulation.request.fuse,
        "start": sorted(simulation.start),
        "monitor": MonitorSubject.of_run(simulation).as_json(),
        "robots": [robot.name for robot in factory.robots],
        "places": [place.name for place in net.places],
        "transitions": [transition.name for transition in net.transitions],
        "nq": len(now.observation.qpos),
        "nv": len(now.observation.qvel),
    }


def _project(simulation: Recordable, project: Project | None) -> dict[str, Any]:
    """The table of the project of a run. Raises InputError (Usage) for robots without guidepaths,
    where it is not known how they were laid out."""
    layout, settings = simulation.layout, simulation.request.settings
    if layout.chains is not None and project is not None and (kept := cell_in(project)):
        product, cell = kept
        made = project_table(product.pag, product.templates, product.compiled, settings)
        return {**made, "cell": table_of(cell)}
    layout.factory.check_rails("a log without the project of its run")
    pag, templates = (project.pag, project.templates) if project else (layout.factory.pag, {})
    made = project_table(pag, templates, layout.factory, settings)
    return {**made, "layout": table_of(LayoutTable.of(layout))}


def versions() -> dict[str, str]:
    """The installed versions of the packages that a run depends on."""
    names = ("klavins-factory", "mujoco", "numpy")
    return {name: version for name in names if (version := release(name))}
