"""The outfeed's tray: it goes to the end of its way with a product, and comes back without."""

from __future__ import annotations

import numpy as np

from factory.control.governor import govern
from factory.control.mode import ROUNDING, Array
from factory.control.profile import landing_speed
from factory.mjcf.model import Model
from factory.simulation.mujoco.drives import Setpoints
from factory.simulation.mujoco.fast.reference_cache import AHEAD, Course, Courses, Way, travelled
from factory.support.engine import mujoco

NEAR = 1e-3
"""The tray is somewhere when it is within this [m]."""

CLOSE = NEAR + AHEAD
"""It may be there when its reference is within this [m]."""


class Outfeed:
    """A tray that is an axis by number, with its joint's addresses in `qpos` and `qvel`.

    `axis` (1,). `home`: it rests at the beginning of its way, or did when somebody looked. `goes`:
    its reference is not where it is aimed at. `settles`: it may be there any tick. `idle`: it has
    come home, and nobody has aimed it elsewhere since.
    """

    def __init__(
        self,
        d: mujoco.MjData,
        model: Model,
        axis: int,
        addresses: tuple[int, int],
        setpoints: Setpoints,
        courses: Courses,
    ) -> None:
        self.d, self.settings, self.setpoints, self.courses = d, model.settings, setpoints, courses
        self.axis, self._addresses = np.array([axis]), addresses
        self._product = model.masses[model.factory.pag.root]
        self._way, self._place = model.layout.outfeed_way, 0.0
        self._x, self._v = np.zeros(1), np.zeros(1)
        self.home, self.idle, self.goes, self.settles = True, True, False, False

    @property
    def leaves(self) -> bool:
        """Whether it is aimed at the end of its way."""
        return self._place > 0.0

    def rests_away(self) -> bool:
        """Whether it rests at the end of its way."""
        return self._rests_at(self._way)

    def rests_home(self) -> bool:
        """Whether it rests at the beginning of its way."""
        self.home = self._rests_at(0.0)
        return self.home

    def _rests_at(self, place: float) -> bool:
        x, v = self.d.qpos[self._addresses[0]], self.d.qvel[self._addresses[1]]
        return bool(abs(x - place) < NEAR and abs(v) < NEAR / self.settings.tick)

    def aim(self, loaded: bool) -> bool:
        """From now on it carries a product, or none, and goes accordingly. Whether that is
        new."""
        before, self._place = self._place, self._way if loaded else 0.0
        x, v = float(self._x[0]), float(self._v[0])
        self.goes = x != self._place or v != 0.0
        self.settles = abs(x - self._place) < CLOSE and (loaded or not self.home)
        self.idle = self.home and not (loaded or self.goes)
        return self._place != before

    def way(self) -> tuple[Array, Array, Array]:
        """Where its reference is [m], how fast [m/s], and where it is aimed at."""
        return self._x, self._v, np.array([self._place])

    def course(self, ticks: int) -> Course:
        """Some ticks of its way, as fast as its limits allow, until it is nearly there."""
        x, v = self._x, self._v
        begin = self._place, x.tobytes(), v.tobytes()
        return self.courses.of(begin, ticks, lambda: self._course(ticks))

    def send(self, course: Course) -> None:
        """It does that now."""
        self._x, self._v, _ = course.told.after.T
        self.setpoints.follow(self.axis, course.told)
        self.goes = False

    def _course(self, ticks: int) -> Course:
        self.setpoints.load(self.axis, self.leaves * self._product, 0.0)
        return travelled(self.setpoints, self.axis, (self._x, self._v), ticks, self._go)

    def _go(self, x: Array, v: Array) -> Way:
        dt, limit = self.settings.tick, np.array([self.settings.outfeed_acceleration])
        left = self._place - (x + v * (dt / 2))
        wanted = np.minimum(landing_speed(np.abs(left), limit, dt), self.settings.outfeed)
        x1, v1, a = govern(x, v, np.copysign(wanted, left), limit, dt)
        if abs(x1[0] - self._place) < ROUNDING and abs(v1[0]) < ROUNDING:
            x, v, a = np.array([self._place]), np.zeros(1), np.zeros(1)
            x1, v1 = x, v
        return (x, v, a), x1, v1, abs(float(x1[0]) - self._place) < CLOSE
