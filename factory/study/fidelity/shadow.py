"""A second copy of the engine's model, in which nothing sleeps and near is as good as touching.

Every tick it takes over the run's configuration and contact masks, and only looks: where bodies
are, and which come near each other. The run never sees it.
"""

from __future__ import annotations

import numpy as np

from factory.mjcf.replica import Replica
from factory.support.engine import mujoco

COPIED = ("geom_contype", "geom_conaffinity", "exclude_signature")
"""What a run changes of its model: who may touch whom."""

MASKS = (("body_contype", "geom_contype"), ("body_conaffinity", "geom_conaffinity"))
"""The mask of a body is that of its geoms; a run leaves bodies out that have nothing near."""


class Shadow(Replica):
    """The shadow of a run: `m`, `d`. Contacts are found up to `reach` [m]."""

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
