"""The outfeed's tray: it goes to the end of its way with a product, and comes back without."""

from __future__ import annotations

from collections.abc import Hashable

import numpy as np

from factory.control.governor import govern
from factory.control.mode import ROUNDING, Array
from factory.control.profile import landing_speed
from factory.mjcf.model import Model
from factory.simulation.mujoco.axes import Axes
from factory.simulation.mujoco.courses import AHEAD, Course, Follower, Move, planned
from factory.simulation.mujoco.drives import Drives
from factory.support.engine import mujoco

NEAR = 1e-3
"""The tray is somewhere when it is within this [m]."""

CLOSE = NEAR + AHEAD
"""It may be there when its reference is within this [m]."""


class Outfeed:
    """The tray and its way. `goal` [m]: where it goes, 0 is home. `busy`: it is away, or has not
    been seen at rest at home since. `loading`: it has just been given a product, and leaves a tick
    later."""

    def __init__(
        self, d: mujoco.MjData, model: Model, axes: Axes, follower: Follower, drives: Drives
    ) -> None:
        self.follower, self.goal = follower, 0.0
        self.busy = self.loading = False
        self.axis = np.array([axes.tray])
        self._d, self._drives, self._settings = d, drives, model.settings
        self._address = int(axes.qpos[-1]), int(axes.dof[-1])
        self._product = model.masses[model.factory.pag.root]
        self._way = model.layout.outfeed_way

    def send(self, loaded: bool) -> None:
        """From now on it carries a product, or none, and goes away, or home."""
        self.goal, self.busy, self.loading = self._way if loaded else 0.0, True, loaded
        self._drives.load(self.axis, np.array([loaded * self._product]), np.zeros(1))
        self.follower.course = None

    def rests(self) -> bool:
        """Whether it rests where it goes."""
        x, v = self._d.qpos[self._address[0]], self._d.qvel[self._address[1]]
        return bool(abs(x - self.goal) < NEAR and abs(v) < NEAR / self._settings.tick)

    @property
    def moves(self) -> bool:
        """Whether its reference has yet to come to rest at the goal, or it is busy."""
        x, v = self.follower.x[self.axis[0]], self.follower.v[self.axis[0]]
        return self.busy or bool(x != self.goal or v != 0.0)

    @property
    def beginning(self) -> Hashable:
        """All that its next course depends on."""
        x, v = self.follower.x[self.axis], self.follower.v[self.axis]
        return self.goal, x.tobytes(), v.tobytes()

    def course(self) -> Course:
        """A stride of its way, as fast as its limits allow, until it is nearly there."""
        x, v = self.follower.x[self.axis], self.follower.v[self.axis]
        ticks = self._settings.stride, self._settings.steps
        return planned(self._drives, self.axis, (x, v), ticks, self._go)

    def _go(self, x: Array, v: Array) -> Move:
        dt, limit = self._settings.tick, np.array([self._settings.outfeed_acceleration])
        left = self.goal - (x + v * (dt / 2))
        wanted = np.minimum(landing_speed(np.abs(left), limit, dt), self._settings.outfeed)
        x1, v1, a = govern(x, v, np.copysign(wanted, left), limit, dt)
        if abs(x1[0] - self.goal) < ROUNDING and abs(v1[0]) < ROUNDING:
            x1, v1 = np.array([self.goal]), np.zeros(1)
        return x1, v1, a, abs(float(x1[0]) - self.goal) < CLOSE
