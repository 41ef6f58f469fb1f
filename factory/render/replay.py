"""Films and stills from a log alone, the same pictures as of the run it is of."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from factory.record.log import Log
from factory.record.log.model import model_of
from factory.record.monitor.record import recorded_subject
from factory.render.camerawork import Moment, Take, When, pictureless
from factory.render.history import History
from factory.render.picture import USUAL, Picture
from factory.render.reel import Reel, save
from factory.render.subject import Snapshot, held
from factory.render.video import FPS, check_output


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
    or one that is not of the factory in its header."""
    is_still = check_output(path, picture.size, fps, still=None)
    take = take_of(log, picture)
    firings = list(zip(log.fired_t.tolist(), log.fired.tolist(), strict=True))
    if is_still:
        moment = moment_of(log, _row(log, take, at))
        take.history.catch_up(firings, moment.time)
        save(take, moment, Path(path))
        return 1
    with Reel(take, Path(path), fps, None if poster is None else Path(poster)) as reel:
        for row in range(len(log)):
            moment = moment_of(log, row)
            take.history.catch_up(firings, moment.time)
            reel.until(moment)
    return reel.frames


def take_of(log: Log, picture: Picture) -> Take:
    """What pictures of a log are taken of, with nothing fired yet."""
    if not log.xml:
        raise pictureless()
    m, subject = model_of(log), recorded_subject(log.header)
    picture.check([part.label for part in subject.factory.leaves])
    return Take(m, subject, log.header["product"], log.header["units"], picture, History(subject))


def moment_of(log: Log, row: int) -> Moment:
    """The state in a row of a log."""
    active = log.active[row]
    shown = Snapshot(log.qpos[row], active[:, 0], active[:, 2])
    return Moment(float(log.time[row]), int(log.delivered[row]), shown)


def _row(log: Log, take: Take, at: When) -> int:
    """The row of a log that a still at that time shows."""
    last = len(log) - 1
    if at != "end":
        return min(int(np.searchsorted(log.time, at - 1e-9)), last)
    rows = range(last, -1, -1) if take.picture.camera == "product" else ()
    return next((row for row in rows if held(take.m, moment_of(log, row).shown)), last)
