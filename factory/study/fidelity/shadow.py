"""What is read from a running engine without changing the run: configurations in a copy of its
model, and the steps within a tick."""

from __future__ import annotations

from types import TracebackType
from typing import Any, Self

import numpy as np

from factory.control.mode import Array
from factory.mjcf.replica import Replica
from factory.support.engine import mujoco

COPIED = ("geom_contype", "geom_conaffinity", "exclude_signature")
"""What a run changes of its model: who may touch whom."""

MASKS = (("body_contype", "geom_contype"), ("body_conaffinity", "geom_conaffinity"))
"""The mask of a body is that of its geoms; a run leaves bodies out that have nothing near."""


class Shadow(Replica):
    """A second copy of a run's model, `m`, `d`, in which nothing sleeps and near is as good as
    touching: contacts are found up to `reach` [m]. Every tick it takes over the run's configuration
    and contact masks. The run never sees it."""

    def __init__(self, m: mujoco.MjModel, d: mujoco.MjData, reach: float) -> None:
        super().__init__(m)
        self.run_m, self.run_d, self.reach = m, d, reach
        self.m.geom_margin[:] = 0.0
        self.m.geom_gap[:] = self.m.body_margin[:] = reach / 2  # of a pair they add up
        self.planes = self.m.geom_type == int(mujoco.mjtGeom.mjGEOM_PLANE)
        self._solid = np.flatnonzero(m.body_geomnum)
        self._pairs = [(getattr(self.m, name), getattr(m, name)) for name in COPIED]
        self.follow()

    def follow(self) -> None:
        """Take over where everything is."""
        self.place(self.run_d.qpos)

    def collide(self) -> None:
        """Find what is near, by the masks of the run; the floor is near everything."""
        m = self.m
        for own, other in self._pairs:
            own[...] = other
        for body, geom in MASKS:
            masks = np.bitwise_or.reduceat(getattr(m, geom), m.body_geomadr[self._solid])
            getattr(m, body)[self._solid] = masks
        self.leave_out(self.planes)
        mujoco.mj_collision(m, self.d)


class Steps:
    """Speeds of all degrees of freedom and forces of all drives in the steps of the tick under
    way. Use as a context around the run; one at a time in a process.

    The engine calls its control callback in every step, when the state is that at the step's
    beginning and the forces are still those of the step before. The callback only copies.
    """

    def __init__(self, m: mujoco.MjModel, d: mujoco.MjData, room: int) -> None:
        self._qvel, self._force = d.qvel, d.actuator_force
        self._v = np.zeros((room + 1, m.nv))
        self._f = np.zeros((room + 1, len(self._force)))
        self._t = np.zeros(room + 1)
        self._count = 0

    def __enter__(self) -> Self:
        mujoco.set_mjcb_control(self._step)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        mujoco.set_mjcb_control(None)

    def _step(self, m: Any, d: Any) -> None:
        at = int(np.searchsorted(self._t[: self._count], d.time))
        if (
            at == self._count
        ):  # else the step is repeated: it has woken a body, or something touched
            self._t[at], self._v[at], self._f[at] = d.time, self._qvel, self._force
        self._count = at + 1

    def take(self) -> tuple[Array, Array]:
        """Speeds (n + 1, nv) before, between and after the n steps since the last call, and the
        forces (n, nu) in them. Valid until the next step."""
        n, self._count = self._count, 0
        self._v[n] = self._qvel
        self._f[n] = self._force
        return self._v[: n + 1], self._f[1 : n + 1]
