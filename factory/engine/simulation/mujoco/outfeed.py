"""The outfeed's tray: it carries a product into the shed and comes back empty. In between the shed
is shut."""

from __future__ import annotations

import numpy as np

from factory.engine.mjcf.driving import GRAVITY
from factory.engine.mjcf.model import Model
from factory.engine.mjcf.outfeed import SHUTTER_MASS
from factory.engine.simulation.mujoco.axes import Axes
from factory.engine.simulation.mujoco.courses import AHEAD, Course, Follower, Move, planned
from factory.engine.simulation.mujoco.drives import Drives
from factory.floor.layout.dimensions import BEHIND, PLAY
from factory.floor.layout.outfeed import NEAR, tray_profile
from factory.support.arrays import Array
from factory.support.engine import mujoco
from factory.theory.control.governor import towards

WEIGHT = np.array([0.0, SHUTTER_MASS * GRAVITY])
"""What the drives of tray and shutter carry [N]."""

CLOSE = NEAR + AHEAD
"""It may be there when its reference is within this [m]."""


class Outfeed:
    """The tray and the shutter of its shed.

    Attributes:
        goal: where the tray goes; 0 is home [m].
        busy: whether it has not been at rest at home, with the shed open, since it left.
        loading: whether it has just been given a product, and leaves a tick later.
    """

    def __init__(
        self, d: mujoco.MjData, model: Model, axes: Axes, follower: Follower, drives: Drives
    ) -> None:
        self.follower, self.goal = follower, 0.0
        self.busy = self.loading = False
        self.axes = np.array([axes.tray, axes.tray + 1])
        self._d, self._drives, self._settings = d, drives, model.settings
        self._address = axes.qpos[self.axes], axes.dof[self.axes]
        self._product = max(model.masses[product] for product in model.factory.products)
        self._far = model.layout.outfeed_way, -model.layout.shutter_stroke
        drives.load(self.axes, np.zeros(2), WEIGHT)
        tray = tray_profile(model.layout, model.settings)
        limits = (tray.speed, tray.acceleration), model.settings.shutter_limits
        speed, acceleration = np.array(limits).T
        self._limits = speed, acceleration

    def send(self, loaded: bool) -> None:
        """Send the tray away with a product, or home without."""
        self.goal, self.busy, self.loading = self._far[0] if loaded else 0.0, True, loaded
        self._drives.load(self.axes, self.load, WEIGHT)
        self.follower.course = None

    @property
    def load(self) -> Array:
        """Loads of tray and shutter (2,) [kg]."""
        return np.array([self._product if self.goal else 0.0, 0.0])

    @property
    def ends(self) -> list[float]:
        """Goals of tray and shutter [m]: the shed is shut while a product is in it."""
        return [self.goal, self._far[1] if self.goal else 0.0]

    def rests(self) -> bool:
        """Whether tray and shutter rest at their goals."""
        x, v = self._d.qpos[self._address[0]], self._d.qvel[self._address[1]]
        slow = NEAR / self._settings.tick
        return all(
            abs(at - end) < NEAR and abs(speed) < slow
            for at, end, speed in zip(x.tolist(), self.ends, v.tolist(), strict=True)
        )

    @property
    def moves(self) -> bool:
        """Whether a reference is not at rest at its goal, or the tray is busy."""
        if self.busy:
            return True
        x, v = (each[self.axes].tolist() for each in (self.follower.x, self.follower.v))
        return bool(x != self.ends or v != [0.0, 0.0])

    @property
    def beginning(self) -> tuple[Array, Array]:
        """Positions [m] and speeds [m/s] at which the next course begins."""
        return self.follower.x[self.axes], self.follower.v[self.axes]

    def course(self, x: Array, v: Array) -> Course:
        """A stride of its way at the limits, until it is near its goal."""
        ticks = self._settings.stride, self._settings.steps
        return planned(self._drives, self.axes, (x, v), ticks, self._go)

    def _go(self, x: Array, v: Array) -> Move:
        """Advance by a tick: the shutter begins to come down when the product is past it."""
        ends = np.array(self.ends)
        goals = ends if x[0] >= self._far[0] - BEHIND + PLAY else np.array([self.goal, 0.0])
        x1, v1, a = towards(goals, x, v, self._limits, self._settings.tick)
        return x1, v1, a, bool((np.abs(x1 - ends) < CLOSE).all())
