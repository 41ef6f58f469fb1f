"""The interface between a simulation and its recorders."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

from factory.layout.layout import Layout
from factory.nets.petri import Marking
from factory.support.errors import Diagnostic
from factory.support.resource import Closing
from factory.support.settings import Settings

if TYPE_CHECKING:
    from factory.mjcf.model import Model


class ObservedRequest(Protocol):
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
    def settings(self) -> Settings: ...


class Observed(Protocol):
    """A simulation with a log or a monitor, such as `simulation.Simulation`.

    `asked`: the request before anything was chosen for it; `model`: None in the ideal world;
    `start`: the marking the run began from; `before`: products delivered before that. `world` has
    `time` [s] and `delivered()`; in MuJoCo the engine's `m` and `d`, in the ideal world positions
    `x` [m] and speeds `v` [m/s]. `supervisor` has `marked` (a byte for each place) and `events`.
    """

    @property
    def layout(self) -> Layout: ...
    @property
    def asked(self) -> ObservedRequest: ...
    @property
    def request(self) -> ObservedRequest: ...
    @property
    def start(self) -> Marking: ...
    @property
    def before(self) -> int: ...
    @property
    def model(self) -> Model | None: ...
    @property
    def world(self) -> Any: ...
    @property
    def supervisor(self) -> Any: ...


class Recorder(Closing):
    """An observer that records a run in a file, and a context manager. `since`: time [s] before
    which it need not observe every tick."""

    since = 0.0

    def observe(self, world: Any, supervisor: Any) -> None:
        """Record the state after a tick."""
        raise NotImplementedError

    def end(self, trouble: Diagnostic | None) -> None:
        """The run is over; `trouble`: the diagnostic that ended it early, if any."""
