"""From moments to pictures and reels: what films and stills of runs and of logs have in common."""

from __future__ import annotations

from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path
from typing import Literal

import numpy as np

from factory.record.monitor.subject import MonitorSubject
from factory.render.area import PanelName, shared
from factory.render.camera import Camera
from factory.render.caption import Caption, Words
from factory.render.history import History
from factory.render.painter import Painter, Pixels
from factory.render.stage import Stage
from factory.render.subject import Snapshot
from factory.render.title import draw_title
from factory.render.video import VideoFile
from factory.support.engine import mujoco
from factory.support.errors import Diagnostic, InputError
from factory.support.files import write_bytes

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
    for, size, camera, and whether there is a caption; `subject`: the factory, which is needed for
    cameras that follow and for `panels`; `title`: shown at the beginning."""

    m: mujoco.MjModel
    product: str
    units: int
    size: Size
    camera: Camera
    caption: bool
    subject: MonitorSubject | None = None
    panels: tuple[PanelName, ...] = ()
    title: str = ""

    @property
    def detail(self) -> str:
        """What the title says of the factory."""
        if self.subject is None:
            return ""
        factory = self.subject.factory
        parts, robots = len(factory.leaves), len(factory.robots)
        return f"{_count(parts, 'part')}, {_count(robots, 'robot')}, {_count(self.units, 'unit')}"

    @property
    def best(self) -> bool:
        """Whether a still at the end is better taken while the finished product can be seen."""
        return self.camera == "product"


class Camerawork:
    """Takes captioned pictures of moments, with the panels asked for. `history` holds what has
    fired up to the moments."""

    def __init__(self, take: Take, samples: int = 1, history: History | None = None) -> None:
        self.take, self.still = take, samples > 1
        area, panels = shared(take.size, take.panels)
        size = area.width, area.height
        self.caption = Caption(size)
        share = self.caption.share if take.caption else 0.0
        self.stage = None
        if panels:
            assert history is not None, "panels show a history"
            self.stage = Stage(take.m, take.size, panels, history)
        self.painter = Painter(take.m, size, take.camera, share, samples, take.subject)

    def picture(self, moment: Moment, elapsed: float = 0.0) -> Pixels:
        """One picture; `elapsed` [s] since the last."""
        pixels = self.painter.paint(moment.shown, elapsed, moment.time)
        if self.take.caption:
            words = Words(self.take.product, moment.made, self.take.units, moment.time)
            pixels = self.caption.draw(pixels, words)
        if self.take.title:
            since = 0.0 if self.still else moment.time
            draw_title(pixels, self.take.title, self.take.detail, since)
        if self.stage is not None:
            pixels = self.stage.compose(pixels, moment.time, moment.shown.qpos, elapsed)
        return pixels

    def close(self) -> None:
        """Gives the GL context back."""
        self.painter.close()


class Reel:
    """Frames of a growing row of moments, at even times, into a video file."""

    def __init__(self, take: Take, path: Path, fps: float, history: History | None = None) -> None:
        self.work = Camerawork(take, history=history)
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


def save(take: Take, moment: Moment, path: Path, history: History | None = None) -> None:
    """A picture of a moment as PNG."""
    from PIL import Image

    work = Camerawork(take, SAMPLES, history)
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


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"


def pictureless() -> InputError:
    """Why there is nothing to see."""
    message = "the ideal world has no bodies to picture"
    return InputError(Diagnostic("BadValue", message, None, "leave out --world ideal"))
