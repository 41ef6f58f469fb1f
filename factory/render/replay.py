"""Films and stills from a log alone, the same pictures as of the run it is of."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from factory.engine import mujoco
from factory.errors import Diagnostic, InputError
from factory.log import Log
from factory.render.camera import camera_named
from factory.render.camerawork import FPS, SIZE, Moment, Reel, Size, Take, When, pictureless, save
from factory.render.subject import Snapshot, held
from factory.render.video import check_output


def render_log(
    log: Log,
    path: Path | str,
    size: Size = SIZE,
    fps: float = FPS,
    camera: str = "overview",
    at: When = "end",
    caption: bool = True,
) -> int:
    """A film, or for .png a still, from a log alone; gives the number of frames.

    Nothing is simulated again. Raises InputError for a log of the ideal world or one without a
    tick."""
    is_still = check_output(path, size, fps, still=None)
    take = Take(
        _model(log),
        str(log.header["product"]),
        int(log.header["units"]),
        size,
        camera_named(camera),
        caption,
    )
    if is_still:
        save(take, moment_of(log, _row(log, take, at)), Path(path))
        return 1
    reel = Reel(take, Path(path), fps)
    try:
        for row in range(len(log)):
            reel.until(moment_of(log, row))
    finally:
        reel.close()
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
    shown = Snapshot(log.qpos[row], active[:, 0], active[:, 1], active[:, 2])
    return Moment(float(log.time[row]), int(log.delivered[row]), shown)


def _model(log: Log) -> mujoco.MjModel:
    """The engine's model of a log."""
    if not log.xml:
        raise pictureless()
    if not len(log):
        raise InputError(Diagnostic("BadLog", "the log has no tick", None, "run for longer"))
    files = {f"meshes/{name}": content for name, content in log.files.items()}
    try:
        m = mujoco.MjModel.from_xml_string(log.xml, files)
    except ValueError as error:
        raise InputError(Diagnostic("BadLog", f"the log's model is broken: {error}")) from error
    if m.nq != log.qpos.shape[1]:
        raise InputError(Diagnostic("BadLog", "the log's states are not those of its model"))
    return m
