"""Writing a log while a factory runs."""

from __future__ import annotations

import hashlib
import json
import platform
import sys
from collections.abc import Sequence
from dataclasses import asdict
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from factory.lang import write_pag, write_template
from factory.record.log.blocks import LENGTH, MAGIC, Arrays, bad_log, block, pack_rows
from factory.record.monitor.subject import subject_of_run
from factory.support.errors import InputError
from factory.support.resource import Closing

if TYPE_CHECKING:
    from factory.pipeline import Source
    from factory.simulation.simulation import Simulation


class LogWriter(Closing):
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
        self.ctrl = np.empty((self.ticks, simulation.world.d.ctrl.size if self.physical else 0))
        self.seen = 0
        self.row = 0
        self.marked = self.aimed = b""
        self._start()
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self.file = self.path.open("wb")
        except OSError as error:
            raise InputError(bad_log(self.path, f"cannot be written: {error.strerror}")) from error
        header = json.dumps(_header(simulation, source, command, nq, nv)).encode()
        self.file.write(MAGIC + LENGTH.pack(len(header)) + header)
        if simulation.model is not None:
            files = {f"mesh/{name}": content for name, content in simulation.model.files.items()}
            packed = {"xml": simulation.model.xml.encode(), **files}
            self.file.write(block(b"M", {k: np.frombuffer(v, "u1") for k, v in packed.items()}, 6))
        self.observe(simulation.world, simulation.supervisor)

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
            self.ctrl[row] = world.d.ctrl
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
            **(pack_rows("ctrl", self.ctrl[: self.row]) if self.physical else {}),
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
    layout, net = simulation.layout, simulation.supervisor.net
    factory, plain = layout.factory, layout.plain or layout
    given = source.pag if source else plain.factory.pag
    file = Path(given.file)
    said = file.read_text("utf-8", errors="replace") if file.is_file() else write_pag(given)
    text = said if layout.plain is None else write_pag(factory.pag)
    settings, jitter = simulation.settings, simulation.jitter
    subject = subject_of_run(simulation)
    return {
        "versions": {"python": platform.python_version(), **_versions()},
        "command": list(sys.argv if command is None else command),
        "world": simulation.kind,
        "seed": simulation.seed,
        "jitter": jitter,
        "units": simulation.units,
        "wip": simulation.wip,
        "start": sorted(simulation.start),
        "settings": asdict(settings),
        "product": file.stem or "factory",
        "pag": {
            "file": str(file),
            "text": text,
            "sha256": hashlib.sha256(text.encode()).hexdigest(),
            "plain": None if layout.plain is None else said,
        },
        "ground": dict(layout.ground),
        "templates": {
            name: write_template(template)
            for name, template in sorted(
                {o.template.name: o.template for o in factory.operations}.items()
            )
        },
        "monitor": subject.as_json(),
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
