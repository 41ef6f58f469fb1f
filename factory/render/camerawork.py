"""From moments to pictures and reels: what films and stills of runs and of logs have in common."""

from __future__ import annotations

from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path
from typing import Literal

import numpy as np

from factory.engine import mujoco
from factory.errors import Diagnostic, InputError
from factory.files import write_bytes
from factory.render.camera import Camera
from factory.render.caption import Caption, Words
from factory.render.painter import Painter, Pixels
from factory.render.subject import Snapshot
from factory.render.video import VideoFile

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
        """Gives the GL context back."""
        self.painter.close()


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


def save(take: Take, moment: Moment, path: Path) -> None:
    """A picture of a moment as PNG."""
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


def pictureless() -> InputError:
    """Why there is nothing to see."""
    message = "the ideal world has no bodies to picture"
    return InputError(Diagnostic("BadValue", message, None, "leave out --world ideal"))
