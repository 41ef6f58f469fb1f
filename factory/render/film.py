"""Films and stills of a run as it goes on, or of its log: the same pictures either way."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from factory.engine import mujoco
from factory.errors import Diagnostic, InputError
from factory.files import write_bytes
from factory.log import Log
from factory.render.camera import Camera, camera_named
from factory.render.caption import Caption, Words
from factory.render.painter import Painter, Pixels
from factory.render.subject import Snapshot, held
from factory.render.video import VideoFile, check_output

if TYPE_CHECKING:
    from factory.simulation import Simulation

Size = tuple[int, int]

When = float | Literal["end"]

SIZE, FPS = (1280, 720), 30.0

SAMPLES = 32
"""Pictures that a still is the mean of."""

JUMP = 0.03
"""A coordinate that changes by more in one tick was set anew; no frame shows it on the way [m]."""


@dataclass(frozen=True, slots=True)
class Moment:
    """A state with its time [s] and the products delivered by then."""

    time: float
    made: int
    shown: Snapshot

    def towards(self, later: Moment, time: float) -> Moment:
        """The state between this and a later one."""
        share = (time - self.time) / (later.time - self.time) if later.time > self.time else 1.0
        change = later.shown.qpos - self.shown.qpos
        qpos = self.shown.qpos + np.where(np.abs(change) > JUMP, 1.0, share) * change
        whole = later if share >= 0.5 else self
        return Moment(time, whole.made, replace(whole.shown, qpos=qpos))


@dataclass(frozen=True, slots=True)
class Take:
    """What a picture is of and how it is taken: the model, the product's name and the units asked
    for, size, camera, and whether there is a caption."""

    m: mujoco.MjModel
    product: str
    units: int
    size: Size
    camera: Camera
    caption: bool

    @property
    def best(self) -> bool:
        """Whether a still at the end is better taken while the finished product can be seen."""
        return self.camera == "product"


class Camerawork:
    """Takes captioned pictures of moments."""

    def __init__(self, take: Take, samples: int = 1) -> None:
        self.take = take
        self.caption = Caption(take.size)
        share = self.caption.share if take.caption else 0.0
        self.painter = Painter(take.m, take.size, take.camera, share, samples)

    def picture(self, moment: Moment, elapsed: float = 0.0) -> Pixels:
        """One picture; `elapsed` [s] since the last."""
        pixels = self.painter.paint(moment.shown, elapsed)
        if not self.take.caption:
            return pixels
        words = Words(self.take.product, moment.made, self.take.units, moment.time)
        return self.caption.draw(pixels, words)

    def close(self) -> None:
        self.painter.close()


class _Observer:
    """What films and stills of a run have in common: an observer, and a context manager."""

    def __init__(self, simulation: Simulation, size: Size, camera: str, caption: bool) -> None:
        if simulation.model is None:
            raise _pictureless()
        from factory.mjcf.model import product_name

        self.simulation = simulation
        product = product_name(simulation.layout.factory)
        world = simulation.world
        self.take = Take(world.m, product, simulation.units, size, camera_named(camera), caption)
        self.last = self._moment()

    def __call__(self, world: Any, supervisor: Any) -> None:
        self.observe(world, supervisor)

    def observe(self, world: Any, supervisor: Any) -> None:
        raise NotImplementedError

    def close(self) -> None:
        raise NotImplementedError

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _moment(self) -> Moment:
        world = self.simulation.world
        made = world.delivered() - self.simulation.before
        return Moment(world.time, made, Snapshot.of(world.m, world.d))


class Film(_Observer):
    """Films a run: a frame whenever simulated time reaches the next, from the run itself.

    Frame k is at k / fps seconds, so T seconds have ⌊T fps⌋ + 1 frames. Closed after an
    interruption too, the file holds what happened until then. Raises InputError for a size, rate,
    ending or camera that will not do, MissingError where there is no GL."""

    def __init__(
        self,
        simulation: Simulation,
        path: Path | str,
        size: Size = SIZE,
        fps: float = FPS,
        camera: str = "overview",
        caption: bool = True,
    ) -> None:
        check_output(path, size, fps)
        super().__init__(simulation, size, camera, caption)
        self.reel = Reel(self.take, Path(path), fps)
        self.reel.until(self.last)

    def __enter__(self) -> Film:
        return self

    @property
    def frames(self) -> int:
        """Frames taken."""
        return self.reel.frames

    def observe(self, world: Any, supervisor: Any) -> None:
        """Take the frames that are due."""
        self.reel.until(self._moment())

    def close(self) -> None:
        """Finish the file."""
        self.reel.close()


class Still(_Observer):
    """A still (PNG) of a run at a time [s], or at its end; written when it is closed.

    For the camera `product` the end is when the output robot last holds a product.
    """

    def __init__(
        self,
        simulation: Simulation,
        path: Path | str,
        size: Size = SIZE,
        camera: str = "overview",
        at: When = "end",
        caption: bool = True,
    ) -> None:
        check_output(path, size, still=True)
        super().__init__(simulation, size, camera, caption)
        self.path, self.at, self.held = Path(path), at, False

    def __enter__(self) -> Still:
        return self

    def observe(self, world: Any, supervisor: Any) -> None:
        """Keep the state if it may be the one."""
        if self.at != "end" and self.last.time >= self.at:
            return
        now = self._moment()
        if self.at != "end" or not self.take.best or held(world.m, now.shown) or not self.held:
            self.last, self.held = now, self.held or held(world.m, now.shown)

    def close(self) -> None:
        """Take the picture."""
        _save(self.take, self.last, self.path)


def still(
    simulation: Simulation,
    path: Path | str,
    size: Size = SIZE,
    camera: str = "overview",
    caption: bool = True,
) -> None:
    """A still of the state a simulation is in now."""
    Still(simulation, path, size, camera, "end", caption).close()


class Reel:
    """Frames of a growing row of moments, at even times, into a video file."""

    def __init__(self, take: Take, path: Path, fps: float) -> None:
        self.work = Camerawork(take)
        try:
            self.file = VideoFile(path, take.size, fps)
        except BaseException:
            self.work.close()
            raise
        self.fps, self.last = fps, None  # type: float, Moment | None

    @property
    def frames(self) -> int:
        """Frames written."""
        return self.file.frames

    def until(self, now: Moment) -> None:
        """Write the frames whose time has come."""
        while self.frames / self.fps <= now.time + 1e-9:
            due = self.frames / self.fps
            moment = self.last.towards(now, due) if self.last is not None else now
            self.file.write(self.work.picture(moment, 1 / self.fps if self.frames else 0.0))
        self.last = now

    def close(self) -> None:
        """Finish the file and give the GL back."""
        try:
            self.file.close()
        finally:
            self.work.close()


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
        _save(take, moment_of(log, _row(log, take, at)), Path(path))
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
        raise _pictureless()
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


def _save(take: Take, moment: Moment, path: Path) -> None:
    """A picture of a moment as PNG."""
    from io import BytesIO

    from PIL import Image

    work = Camerawork(take, SAMPLES)
    try:
        pixels = work.picture(moment)
    finally:
        work.close()
    content = BytesIO()
    Image.fromarray(pixels).save(content, "png", optimize=True)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_bytes(path, content.getvalue())
    except OSError as error:
        message = f"'{path}' cannot be written: {error.strerror}"
        raise InputError(Diagnostic("BadValue", message, None, "choose another file")) from error


def _pictureless() -> InputError:
    message = "the ideal world has no bodies to picture"
    return InputError(Diagnostic("BadValue", message, None, "leave out --world ideal"))
