"""What holds each body: the active welds, read from the engine, and which have just been switched
on."""

from __future__ import annotations

import numpy as np

from factory.control.mode import Array, Index
from factory.mjcf import names
from factory.mjcf.weld_frames import GRIP, KINDS, Slides
from factory.support.engine import mujoco


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
