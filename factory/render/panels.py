"""The panels of a picture: what they show of a moment, put beside the 3-D."""

from __future__ import annotations

import numpy as np

from factory.control.mode import Array
from factory.mjcf import names
from factory.render.gantt_panel import GanttPanel
from factory.render.history import History
from factory.render.ink import Pixels
from factory.render.net_panel import NetPanel
from factory.render.picture import Area, PanelName, Size
from factory.render.rows import Rows
from factory.support.engine import mujoco

KINDS: dict[PanelName, type[NetPanel] | type[GanttPanel]] = {"net": NetPanel, "gantt": GanttPanel}


class Panels:
    """Puts panels into their areas of a picture of a size, beside one of the 3-D."""

    def __init__(
        self, m: mujoco.MjModel, size: Size, areas: dict[PanelName, Area], history: History
    ) -> None:
        self.size, self.rows = size, Rows(history)
        scale = min(max(size) / 1280, min(size) / 720)
        self.shown = [
            (area, KINDS[name]((area.width, area.height), scale, history, self.rows))
            for name, area in areas.items()
        ]
        slides = [m.joint(names.slide(robot.name)).qposadr[0] for robot in history.factory.robots]
        self.slides = np.array(slides, np.intp)

    def compose(self, scene: Pixels, time: float, qpos: Array, elapsed: float) -> Pixels:
        """The picture with its panels at a time; `elapsed` [s] since the last."""
        self.rows.advance(time, elapsed)
        found = np.empty((self.size[1], self.size[0], 3), np.uint8)
        found[: scene.shape[0], : scene.shape[1]] = scene
        for area, panel in self.shown:
            drawn = panel.draw(time, qpos[self.slides], elapsed)
            found[area.top : area.top + area.height, area.left : area.left + area.width] = drawn
        return found
