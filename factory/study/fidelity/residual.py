"""How far welds give: the distance between the frames that each joins, under load."""

from __future__ import annotations

import numpy as np

from factory.control.mode import REST, Array
from factory.mjcf.weld_frames import ROWS, Slides, residuals
from factory.study.fidelity.histogram import Histogram
from factory.support.engine import mujoco


class Residual:
    """Residuals [m] of active, awake welds at the end of ticks: the `largest` of all, and the
    distribution of those whose holder goes faster than the speed at which robots hand over: a
    holder that stands may be asleep or not."""

    def __init__(self, m: mujoco.MjModel, d: mujoco.MjData, slides: Slides) -> None:
        self.m, self.d, self.slides = m, d, slides
        self.largest, self.moving = 0.0, Histogram()

    def tick(self, v: Array) -> None:
        """Speeds at the end of a tick (nv,)."""
        apart = residuals(self.d)
        length = np.sqrt(np.einsum("ij,ij->i", apart, apart))
        self.largest = max(self.largest, float(length.max(initial=0.0)))
        holder = self.m.eq_obj1id[self.d.efc_id[: self.d.ne : ROWS]]
        speed = np.linalg.norm(self.slides.velocity(holder, v), axis=1)
        self.moving.add(length[speed > REST])
