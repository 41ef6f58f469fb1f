"""The state of a run at an instant, and what shows it to recorders.

A world gives an `Observation` of itself, a simulation the whole `State`. Logs, monitors, figures,
films and progress are functions of a sequence of states.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from factory.engine.record.failures import Account
from factory.engine.record.figures import PhysicsFigures
from factory.engine.timing.demand import Demand, Word
from factory.floor.layout.layout import Layout
from factory.support.arrays import Array, Index
from factory.support.errors import Diagnostic
from factory.support.resource import Closing
from factory.support.settings import Settings
from factory.theory.nets.petri import Marking
from factory.theory.nets.undone import Undone

if TYPE_CHECKING:
    from factory.engine.mjcf.model import Model
    from factory.support.engine import mujoco


class Contacts(NamedTuple):
    """The contacts of an instant: the pair of geoms of each (n, 2), and their distances (n,) [m],
    less than 0 where they overlap."""

    geoms: NDArray[np.int32]
    distances: Array


@dataclass(frozen=True, slots=True)
class Observation:
    """What can be measured of a world at a time. In the ideal world, positions [m] and speeds [m/s]
    of all axes, and nothing else.

    Attributes:
        time: [s].
        qpos: the engine's positions (nq,).
        qvel: the engine's speeds (nv,).
        ctrl: the setpoints of the drives (nu,).
        welds: the active constraints by number, and the two bodies that each joins (k, 3); the same
            array until one is switched or reassigned.
        at_end: whether it was made as operations ended and parts changed hands, before the engine
            continued; others are made after a tick.
        contacts: the contacts; None for none.
    """

    time: float
    qpos: Array = field(repr=False)
    qvel: Array = field(repr=False)
    ctrl: Array = field(repr=False)
    welds: Index = field(repr=False)
    at_end: bool = False
    contacts: Contacts | None = field(default=None, repr=False)

    def kept(self) -> Observation:
        """The same without contacts, with arrays of its own."""
        qpos, qvel, ctrl = self.qpos.copy(), self.qvel.copy(), self.ctrl.copy()
        return replace(self, qpos=qpos, qvel=qvel, ctrl=ctrl, contacts=None)


class EngineView:
    """Observes a running engine: its model `m` and data `d`."""

    def __init__(self, m: mujoco.MjModel, d: mujoco.MjData) -> None:
        self.m, self.d = m, d
        self._seen = (b"", b"", b"")
        self._welds: Index = np.empty((0, 3), np.intp)

    def look(self, at_end: bool = False) -> Observation:
        """The present state; its arrays are the engine's own and change with the next tick."""
        d = self.d
        contacts = Contacts(d.contact.geom, d.contact.dist) if d.ncon else None
        state = d.qpos, d.qvel, d.ctrl
        return Observation(float(d.time), *state, self._active(), at_end, contacts)

    def _active(self) -> Index:
        """The active constraints (k, 3), as of an `Observation`."""
        m, d = self.m, self.d
        seen = d.eq_active.tobytes(), m.eq_obj2id.tobytes(), m.eq_obj1id.tobytes()
        if seen != self._seen:
            self._seen = seen
            on = np.flatnonzero(d.eq_active)
            self._welds = np.stack([on, m.eq_obj1id[on], m.eq_obj2id[on]], axis=1)
        return self._welds


class Event(NamedTuple):
    """A transition that fired.

    Attributes:
        t: time [s].
        transition: its name.
    """

    t: float
    transition: str

    def as_json(self) -> dict[str, object]:
        """As `run --json` prints it."""
        return {"t": round(self.t, 6), "transition": self.transition}


@dataclass(frozen=True, slots=True)
class State:
    """The state of a run at an instant. It holds until the next step: arrays and events are those
    of the run.

    Attributes:
        observation: what can be measured of its world.
        marked: the marking of its net, a byte for each place.
        made: number of products made since it began.
        events: all events so far.
        account: failures so far; None for a run that does not recover from any.
    """

    observation: Observation
    marked: bytearray
    made: int
    events: Sequence[Event | Undone] = field(repr=False)
    account: Account | None = None

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self.observation.time


Observer = Callable[[State], None]
"""Reads the states of a run: to render, to log, to judge, to show progress."""


class RecordedRequest(Protocol):
    """The request of a run, such as `simulation.RunRequest`."""

    @property
    def world(self) -> str: ...
    @property
    def units(self) -> int: ...
    @property
    def seed(self) -> int: ...
    @property
    def jitter(self) -> float: ...
    @property
    def wip(self) -> int | None: ...
    @property
    def distributed(self) -> bool: ...
    @property
    def fuse(self) -> bool: ...
    @property
    def demand(self) -> Demand | None: ...
    @property
    def settings(self) -> Settings: ...


class Recordable(Protocol):
    """A run that can be recorded, such as `simulation.Simulation`.

    Attributes:
        layout: the layout.
        asked: the request before anything was chosen for it.
        request: the request as it runs.
        start: the marking in which it begins.
        word: which units are made.
        model: the MJCF model; None in the ideal world.
        engine: the engine's model; None in the ideal world.
        at_ends: observers that are shown the state in which operations have ended and parts
            have changed hands, before the engine continues.
    """

    @property
    def layout(self) -> Layout: ...
    @property
    def asked(self) -> RecordedRequest: ...
    @property
    def request(self) -> RecordedRequest: ...
    @property
    def start(self) -> Marking: ...
    @property
    def word(self) -> Word: ...
    @property
    def model(self) -> Model | None: ...
    @property
    def engine(self) -> mujoco.MjModel | None: ...
    @property
    def at_ends(self) -> list[Observer]: ...
    def state(self, at_end: bool = False) -> State: ...
    def figures(self) -> PhysicsFigures | None: ...


class Recorder(Closing):
    """An observer that records a run in a file, and a context manager. `since`: time [s] before
    which it need not observe every tick."""

    since = 0.0

    def observe(self, state: State) -> None:
        """Record a state."""
        raise NotImplementedError

    def end(self, trouble: Diagnostic | None) -> None:
        """The run is over; `trouble`: the diagnostic that ended it early, if any."""
