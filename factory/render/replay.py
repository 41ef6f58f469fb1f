"""Films and stills from a log alone, the same pictures as of the run it is of."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from factory.record.log import Log
from factory.record.log.model import model_of
from factory.record.monitor.record import AGAIN, recorded_subject
from factory.record.monitor.subject import MonitorSubject
from factory.render.area import PanelName, shared
from factory.render.camera import camera_named
from factory.render.camerawork import FPS, SIZE, Moment, Reel, Size, Take, When, pictureless, save
from factory.render.history import History
from factory.render.poster import Poster
from factory.render.subject import Snapshot, held
from factory.render.video import check_output
from factory.support.engine import mujoco
from factory.support.errors import Diagnostic, InputError


def render_log(
    log: Log,
    path: Path | str,
    size: Size = SIZE,
    fps: float = FPS,
    camera: str = "overview",
    at: When = "end",
    caption: bool = True,
    panels: tuple[PanelName, ...] = (),
    title: str = "",
    poster: Path | str | None = None,
) -> int:
    """A film, or for .png a still, from a log alone; gives the number of frames. `panels`, `title`
    and `poster` are those of `Film`.

    Nothing is simulated again. Raises InputError for a log of the ideal world, one without a tick,
    or one that is not of the factory in its header."""
    is_still = check_output(path, size, fps, still=None)
    shared(size, panels)
    m, subject = _model(log), _subject(log)
    camera = camera_named(camera, [part.label for part in subject.factory.leaves])
    product, units = log.header["product"], log.header["units"]
    take = Take(m, product, units, size, camera, caption, subject, panels, title)
    history = History(subject)
    firings = list(zip(log.fired_t.tolist(), log.fired.tolist(), strict=True))
    if is_still:
        moment = moment_of(log, _row(log, take, at))
        history.catch_up(firings, moment.time)
        save(take, moment, Path(path), history)
        return 1
    chosen = None
    if poster is not None:
        check_output(poster, size, still=True)
        chosen = Poster(take, history, Path(poster))
    reel = Reel(take, Path(path), fps, history)
    try:
        for row in range(len(log)):
            moment = moment_of(log, row)
            history.catch_up(firings, moment.time)
            if chosen is not None:
                chosen.see(moment)
            reel.until(moment)
    finally:
        reel.close()
    if chosen is not None:
        chosen.save()
    return reel.frames


def _row(log: Log, take: Take, at: When) -> int:
    """The row of a log that a still at that time shows."""
    last = len(log) - 1
    if at != "end":
        return min(int(np.searchsorted(log.time, at - 1e-9)), last)
    rows = range(last, -1, -1) if take.best else ()
    return next((row for row in rows if held(take.m, moment_of(log, row).shown)), last)


def moment_of(log: Log, row: int) -> Moment:
    """The state in a row of a log."""
    active = log.active[row]
    shown = Snapshot(log.qpos[row], active[:, 0], active[:, 2])
    return Moment(float(log.time[row]), int(log.delivered[row]), shown)


def _subject(log: Log) -> MonitorSubject:
    """The factory that a log is of."""
    try:
        return recorded_subject(log.header)
    except (ValueError, KeyError, TypeError, AttributeError, IndexError) as error:
        message = f"the log is not of the factory in its header: {error}"
        raise InputError(Diagnostic("BadLog", message, None, AGAIN)) from error


def _model(log: Log) -> mujoco.MjModel:
    """The engine's model of a log."""
    if not log.xml:
        raise pictureless()
    if not len(log):
        raise InputError(Diagnostic("BadLog", "the log has no tick", None, "run for longer"))
    return model_of(log)
