"""Films and stills of a log, with the same pictures as those of its run; or of a run made for
them."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import NamedTuple

from factory.api import Diagnostic, Film, InputError, Project, Run, Simulation, usage_error
from factory.apps.log import Log
from factory.apps.log.model import model_of
from factory.apps.monitor.record import recorded_subject
from factory.apps.runs.executing import Tell, carry_out
from factory.apps.runs.options import RunOptions
from factory.apps.runs.watched import watched
from factory.film.action import Snapshot, held
from factory.film.camerawork import Moment, Take, When, past_the_end, pictureless
from factory.film.film import Still
from factory.film.history import History
from factory.film.picture import USUAL, Picture
from factory.film.reel import Reel, save
from factory.film.video import FPS, check_output
from factory.support.gl import probe


def render_log(
    log: Log,
    path: Path | str,
    picture: Picture = USUAL,
    fps: float = FPS,
    at: When = "end",
    poster: Path | str | None = None,
) -> int:
    """A film, or for .png a still at a time [s], from a log alone; gives the number of frames.
    `poster` is that of `Film`.

    Nothing is simulated again. Raises InputError for a log of the ideal world, one without a tick,
    or one that is not of the factory in its header, and for a time after its end."""
    is_still = check_output(path, picture.size, fps, still=None)
    take = take_of(log, picture)
    if is_still:
        moment = moment_of(log, _row(log, take, at))
        take.history.catch_up(log.timed_entries, moment.time)
        save(take, moment, Path(path))
        return 1
    with Reel(take, Path(path), fps, None if poster is None else Path(poster)) as reel:
        for row in range(len(log)):
            moment = moment_of(log, row)
            take.history.catch_up(log.timed_entries, moment.time)
            reel.until(moment)
    return reel.frames


def take_of(log: Log, picture: Picture) -> Take:
    """The take of a log, before its first firing."""
    if log.header["world"] == "ideal":
        raise pictureless()
    m, subject = model_of(log), recorded_subject(log.header)
    picture.check(subject.factory.pag)
    history = History(subject)
    if log.failures is not None:
        history.failings += log.failures.found
        history.stand(log.failures.stood)
    return Take(m, subject, log.header["product"], log.header["units"], picture, history)


def moment_of(log: Log, row: int) -> Moment:
    """The state in a row of a log."""
    shown = Snapshot.of(log.qpos[row], log.active[row])
    return Moment(float(log.time[row]), int(log.delivered[row]), shown)


def _row(log: Log, take: Take, at: When) -> int:
    """Index of the row of a log that a still at a time shows."""
    last = len(log) - 1
    if at != "end":
        row = log.row_at(at)
        if row > last:
            raise past_the_end(at, "log", float(log.time[-1]))
        return row
    rows = range(last, -1, -1) if take.picture.camera == "product" else ()
    return next((row for row in rows if held(take.m, moment_of(log, row).shown)), last)


@dataclass(frozen=True, slots=True)
class Shot:
    """A film or, where the `output` is a PNG, a still: how each picture is taken, frames per second
    of a film, the time of a still [s], or the end, and the file of a film's best moment. Raises
    InputError: BadValue for what is not possible, Usage for a poster of a still."""

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


class Rendered(NamedTuple):
    """The number of frames, and the run that was made for them, None for a log."""

    frames: int
    run: Run | None


def render(
    source: Log | Project,
    shot: Shot,
    asked: RunOptions = RunOptions(),  # noqa: B008 (frozen)
    silent: bool = True,
    progress: Tell | None = None,
) -> Rendered:
    """Take a film or a still: from a log, or of a run of a project as `asked`, which a still ends
    at its time. Raises InputError, MissingError without GL, StoppedError as `carry_out`."""
    probe()
    if isinstance(source, Log):
        options = shot.output, shot.picture, shot.fps, shot.at, shot.poster
        return Rendered(render_log(source, *options), None)
    made = Simulation(source.layout, asked.request(source))
    films: list[Film] = []

    def opened() -> Film | Still:
        if shot.is_still:
            return Still(made, shot.output, shot.picture, shot.at)
        films.append(Film(made, shot.output, shot.picture, shot.fps, shot.poster))
        return films[0]

    enough = shot.at if shot.is_still and shot.at != "end" else asked.max_time
    run = carry_out(made, silent, enough, [opened], watched, progress=progress)
    return Rendered(films[0].frames if films else 1, run)
