"""From moments to pictures with panels, for films and stills of runs and of logs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import floor, inf
from typing import Literal

import numpy as np

from factory.engine.mjcf import names
from factory.engine.record.subject import MonitorSubject
from factory.film.action import Snapshot
from factory.film.caption import Caption, draw_notices, draw_title
from factory.film.drawn import drawn
from factory.film.filament import Filament, draws
from factory.film.gantt_panel import GanttPanel
from factory.film.history import History
from factory.film.marks import Marks
from factory.film.net_panel import NetPanel
from factory.film.painter import Painter, Renderer
from factory.film.picture import Area, PanelName, Picture, shared
from factory.film.sheet import NAMES, OUTSIDE, Rows
from factory.film.tour import Tour
from factory.support.arrays import Array
from factory.support.engine import mujoco
from factory.support.errors import Diagnostic, InputError
from factory.support.pictures.ink import Pixels
from factory.support.pictures.sight import Framing
from factory.support.pictures.video import Size
from factory.support.resource import Closing
from factory.support.texts import counted

When = float | Literal["end"]

JUMP = 0.03
"""A coordinate that changes by more than this in one tick was reset, so frames do not interpolate
it [m]."""


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
    """The subject of pictures and how they are taken: the run's model with its MJCF and mesh files,
    the factory, the product's name, the units to make; `history` holds the firings up to the moment
    of a picture."""

    m: mujoco.MjModel
    xml: str
    files: Mapping[str, bytes]
    subject: MonitorSubject
    product: str
    units: int
    picture: Picture
    history: History

    @property
    def detail(self) -> str:
        """The line below the title, about the factory."""
        factory = self.subject.factory
        parts, robots = len(factory.leaves), len(factory.robots)
        units = counted(self.units, "unit")
        return f"{counted(parts, 'part')}, {counted(robots, 'robot')}, {units}"


class Camerawork(Closing):
    """Takes pictures of moments; a still is the mean of several `samples`."""

    def __init__(self, take: Take, samples: int = 1) -> None:
        self.take, self.still, picture = take, samples > 1, take.picture
        area, areas = shared(picture.size, picture.panels)
        size, is_tour = (area.width, area.height), picture.camera == "tour"
        camera = "overview" if is_tour else picture.camera
        self.caption = Caption(size) if picture.caption else None
        self.panels = Panels(take.m, picture.size, areas, take.history) if areas else None
        share = self.caption.share if self.caption else 0.0
        filament = draws(picture.renderer, self.still)
        look = Framing(size[0] / size[1], below=0.03 + share)
        model = drawn(take.m, take.xml, take.files, camera, filament, look)
        renderer = Filament if filament else Renderer
        self.painter = Painter(model, size, camera, take.subject, look, samples, renderer)
        if is_tour and not self.still:
            self.painter.viewpoint = Tour(self.painter.replica, look, take.history, take.units)
        self.marks = Marks(self.painter.replica, take.history)

    def picture(self, moment: Moment, elapsed: float = 0.0) -> Pixels:
        """One picture; `elapsed` [s] since the last."""
        take, time = self.take, moment.time
        pixels = self.painter.paint(moment.shown, elapsed, time, self.marks)
        if self.caption is not None:
            pixels = self.caption.draw(pixels, take.product, moment.made, take.units, time)
            draw_notices(pixels, take.history, time, self.caption)
        if take.picture.title:
            draw_title(pixels, take.picture.title, take.detail, 0.0 if self.still else time)
        if self.panels is not None:
            pixels = self.panels.compose(pixels, time, moment.shown.qpos, elapsed)
        return pixels

    def close(self) -> None:
        """Gives the GL context back."""
        self.painter.close()


KINDS: dict[PanelName, type[NetPanel] | type[GanttPanel]] = {"net": NetPanel, "gantt": GanttPanel}


SMALLEST = 0.75
"""Smallest scale for the number of rows, so that words stay legible."""


class Panels:
    """Places panels into their areas of a picture, beside the 3-D view."""

    def __init__(
        self, m: mujoco.MjModel, size: Size, areas: dict[PanelName, Area], history: History
    ) -> None:
        scale = min(max(size) / 1280, min(size) / 720)
        room = min(area.height for area in areas.values()) / max(scale, SMALLEST) - OUTSIDE
        wide = areas["net"].width / max(scale, SMALLEST) - NAMES if "net" in areas else inf
        self.size, self.rows = size, Rows(history, room, wide)
        self.shown = [
            (area, KINDS[name]((area.width, area.height), scale, history, self.rows))
            for name, area in areas.items()
        ]
        slides = [m.joint(names.first_axis(robot)).qposadr[0] for robot in history.factory.robots]
        self.slides = np.array(slides, np.intp)

    def compose(self, scene: Pixels, time: float, qpos: Array, elapsed: float) -> Pixels:
        """The picture with its panels at a time; `elapsed` [s] since the last."""
        self.rows.advance(time, elapsed)
        composed = np.empty((self.size[1], self.size[0], 3), np.uint8)
        composed[: scene.shape[0], : scene.shape[1]] = scene
        for area, panel in self.shown:
            drawn = panel.draw(time, qpos[self.slides], elapsed)
            composed[area.top : area.top + area.height, area.left : area.left + area.width] = drawn
        return composed


def pictureless() -> InputError:
    """The error of a run or log of the ideal world."""
    message = "the ideal world has no bodies to picture"
    return InputError(Diagnostic("BadValue", message, None, "leave out --world ideal"))


def past_the_end(at: float, what: str, end: float) -> InputError:
    """The error of a still at a time after the end of the run or the log."""
    message = (
        f"--at {at:g} is past the end: the {what} ends at {floor(100 * end + 1e-6) / 100:.2f} s"
    )
    hint = "give a time up to then, or `end`; a run of more --units takes longer"
    return InputError(Diagnostic("BadValue", message, None, hint))
