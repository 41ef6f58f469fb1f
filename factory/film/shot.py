"""Shots: a film or a still, of a run while it runs or of the states that a log has kept."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from factory.film.action import Snapshot, held
from factory.film.camerawork import Moment, Take, When, past_the_end, pictureless
from factory.film.film import Film, Still
from factory.film.history import History
from factory.film.picture import USUAL, Picture
from factory.film.reel import Reel, save
from factory.support.errors import Diagnostic, InputError, usage_error
from factory.support.pictures.video import FPS, check_output

if TYPE_CHECKING:
    from factory.engine.record.failures import Failures
    from factory.engine.record.subject import MonitorSubject
    from factory.engine.simulation.simulation import Simulation
    from factory.support.arrays import Array
    from factory.support.engine import mujoco


class KeptRows(Protocol):
    """One value a row."""

    def __getitem__(self, row: int, /) -> Any: ...


class RecordedStates(Protocol):
    """The states that a log has kept of a run, one a row, with the run's firings and failures."""

    @property
    def header(self) -> Mapping[str, Any]: ...
    @property
    def xml(self) -> str: ...
    @property
    def files(self) -> Mapping[str, bytes]: ...
    @property
    def time(self) -> Array: ...
    @property
    def delivered(self) -> KeptRows: ...
    @property
    def qpos(self) -> KeptRows: ...
    @property
    def active(self) -> KeptRows: ...
    @property
    def timed_entries(self) -> Any: ...
    @property
    def failures(self) -> Failures | None: ...
    @property
    def figures(self) -> Mapping[str, Any] | None: ...
    def row_at(self, time: float) -> int: ...
    def __len__(self) -> int: ...


Scene = Callable[[], "tuple[mujoco.MjModel, MonitorSubject]"]
"""Gives the model and the factory that recorded states are of."""


@dataclass(frozen=True, slots=True)
class Shot:
    """A film or, where the output is a PNG, a still.

    Attributes:
        output: the file to write.
        picture: size, camera and panels of each picture.
        fps: frames per second of a film.
        at: the time of a still [s], or the end.
        poster: a file for a still of the moment of a film that shows most; None for none.

    Raises InputError: BadValue for what is not possible, Usage for a poster of a still.
    """

    output: Path
    picture: Picture = USUAL
    fps: float = FPS
    at: When = "end"
    poster: Path | None = None

    def __post_init__(self) -> None:
        size, at = self.picture.size, self.at
        if at != "end" and not (isinstance(at, int | float) and at >= 0 and isfinite(at)):
            message = f"the time of a still is in seconds or `end`, not '{at}'"
            raise InputError(Diagnostic("BadValue", message, None, "for example 2.5"))
        if check_output(self.output, size, self.fps, still=None) and self.poster is not None:
            raise usage_error("--poster applies to a film; this is a still", "leave out --poster")

    @property
    def is_still(self) -> bool:
        """Whether it is one picture."""
        return check_output(self.output, self.picture.size, self.fps, still=None)

    def of_run(self, simulation: Simulation) -> Film | Still:
        """The observer that takes it of a run."""
        if self.is_still:
            return Still(simulation, self.output, self.picture, self.at)
        return Film(simulation, self.output, self.picture, self.fps, self.poster)

    def of_states(self, states: RecordedStates, scene: Scene) -> int:
        """Take it of recorded states of a scene; gives the number of frames. Nothing is simulated
        again. Raises InputError for states of the ideal world, and for a time after the end."""
        take = recorded_take(states, scene, self.picture)
        if self.is_still:
            moment = moment_of(states, self._row(states, take))
            take.history.catch_up(states.timed_entries, moment.time)
            save(take, moment, self.output)
            return 1
        with Reel(take, self.output, self.fps, self.poster) as reel:
            for row in range(len(states)):
                moment = moment_of(states, row)
                take.history.catch_up(states.timed_entries, moment.time)
                reel.until(moment)
            reel.contacts = (states.figures or {}).get("unintended_contacts")
        return reel.frames

    def _row(self, states: RecordedStates, take: Take) -> int:
        """Index of the row that a still shows."""
        last, at = len(states) - 1, self.at
        if at != "end":
            row = states.row_at(at)
            if row > last:
                raise past_the_end(at, "log", float(states.time[-1]))
            return row
        rows = range(last, -1, -1) if take.picture.camera == "product" else ()
        return next((row for row in rows if held(take.m, moment_of(states, row).shown)), last)


def recorded_take(states: RecordedStates, scene: Scene, picture: Picture) -> Take:
    """The take of recorded states, before their first firing. Raises InputError for those of the
    ideal world, which has no pictures."""
    if states.header["world"] == "ideal":
        raise pictureless()
    m, subject = scene()
    picture.check(subject.factory.pag)
    history = History(subject)
    if states.failures is not None:
        history.failings += states.failures.found
        history.stand(states.failures.stood)
    product, units = states.header["product"], states.header["units"]
    return Take(m, states.xml, states.files, subject, product, units, picture, history)


def moment_of(states: RecordedStates, row: int) -> Moment:
    """The state in a row of recorded states."""
    shown = Snapshot.of(states.qpos[row], states.active[row])
    return Moment(float(states.time[row]), int(states.delivered[row]), shown)
