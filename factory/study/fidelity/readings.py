"""Readings of a running engine that do not change the run: configurations in a copy of its model,
the steps within a tick, and the holder of each body."""

from __future__ import annotations

from types import TracebackType
from typing import Any, Self

import numpy as np

from factory.control.mode import Array, Index
from factory.mjcf import names
from factory.mjcf.replica import Replica
from factory.mjcf.weld_frames import GRIP, KINDS, Slides
from factory.support.engine import mujoco

COPIED = ("geom_contype", "geom_conaffinity", "exclude_signature")
"""Fields of the model that a run changes: the contact masks."""

MASKS = (("body_contype", "geom_contype"), ("body_conaffinity", "geom_conaffinity"))
"""Masks of bodies and of their geoms; a run masks bodies that have nothing near."""


class Shadow(Replica):
    """A second copy of a run's model, `m`, `d`, in which nothing sleeps and contacts are detected
    up to a distance of `reach` [m]. It takes over the run's configuration and contact masks every
    tick; the run is not affected."""

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
        """Take over the configuration of the run."""
        self.place(self.run_d.qpos)

    def collide(self) -> None:
        """Detect contacts by the masks of the run, without the floor."""
        m = self.m
        for copied, original in self._pairs:
            copied[...] = original
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


class ActiveWelds:
    """The active welds as of the last `scan`. `holder`, `kind` (nbody,): for each body the body
    that holds it and the kind of the weld; -1 for none."""

    def __init__(self, m: mujoco.MjModel, d: mujoco.MjData) -> None:
        self.m, self.d = m, d
        self.kinds = np.array([KINDS[names.kind(m.equality(i).name)] for i in range(m.neq)], int)
        self.active = np.zeros(m.neq, bool)
        self.target = np.array(m.eq_obj2id)
        self.scan()

    def scan(self) -> Index:
        """Read the welds; gives the grips and holds switched on since they were read last."""
        active = self.d.eq_active.astype(bool)
        fresh = active & (~self.active | (self.m.eq_obj2id != self.target))
        self.active, self.target = active, np.array(self.m.eq_obj2id)
        on = np.flatnonzero(active)
        self.holder = np.full(self.m.nbody, -1)
        self.kind = np.full(self.m.nbody, -1)
        self.holder[self.target[on]] = self.m.eq_obj1id[on]
        self.kind[self.target[on]] = self.kinds[on]
        return np.flatnonzero(fresh & (self.kinds >= GRIP))

    def carried(self) -> Index:
        """The bodies held by a robot or by the tray."""
        return np.flatnonzero(self.kind >= GRIP)


class Velocities:
    """Velocities of parts, which are free bodies, and of what holds them, from the speeds of all
    degrees of freedom (..., nv)."""

    def __init__(self, m: mujoco.MjModel, d: mujoco.MjData) -> None:
        self.slides = Slides.of(m, d)
        self.free = m.body_dofadr[:, None] + np.arange(6)

    def linear(self, v: Array, parts: Index) -> Array:
        """Velocities of parts (..., p, 3) [m/s]."""
        return v[..., self.free[parts, :3]]

    def angular(self, v: Array, parts: Index) -> Array:
        """Angular velocities of parts in their own frames (..., p, 3) [rad/s]."""
        return v[..., self.free[parts, 3:]]

    def relative(self, v: Array, parts: Index, holders: Index) -> Array:
        """Velocities of parts less those of their holders (..., p, 3) [m/s]."""
        return self.linear(v, parts) - self.slides.velocity(holders, v)
