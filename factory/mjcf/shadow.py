"""A second copy of the engine's model of a run, in which no body sleeps and contacts are found at a
distance.

It takes over the run's configuration and contact masks, and finds where bodies are and which come
near each other. It writes nothing of the run.
"""

from __future__ import annotations

import copy

import numpy as np

from factory.mjcf.states import pose
from factory.support.engine import mujoco

COPIED = ("geom_contype", "geom_conaffinity", "exclude_signature")
"""What a run changes of its model: which geoms may touch."""

MASKS = (("body_contype", "geom_contype"), ("body_conaffinity", "geom_conaffinity"))
"""The mask of a body is the union of its geoms' masks; a run clears it where none is near."""


class Shadow:
    """The copy `m`, `d` of a run's model. Contacts are found up to the distance `reach` [m]."""

    def __init__(self, m: mujoco.MjModel, d: mujoco.MjData, reach: float) -> None:
        self.run_m, self.run_d, self.reach = m, d, reach
        self.m = copy.copy(m)
        self.m.opt.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_SLEEP)
        self.m.geom_margin[:] = 0.0
        self.m.geom_gap[:] = self.m.body_margin[:] = reach / 2  # of a pair they add up
        self.planes = self.m.geom_type == int(mujoco.mjtGeom.mjGEOM_PLANE)
        self.d = mujoco.MjData(self.m)
        self._solid = np.flatnonzero(m.body_geomnum)
        self._pairs = [(getattr(self.m, name), getattr(m, name)) for name in COPIED]
        self.follow()

    def follow(self) -> None:
        """Take over the configuration of the run."""
        pose(self.m, self.d, self.run_d.qpos)

    def collide(self) -> None:
        """Find the contacts by the masks of the run, the floor left out: it is near everything."""
        m = self.m
        for own, other in self._pairs:
            own[...] = other
        for body, geom in MASKS:
            masks = np.bitwise_or.reduceat(getattr(m, geom), m.body_geomadr[self._solid])
            getattr(m, body)[self._solid] = masks
        m.geom_contype[self.planes] = m.geom_conaffinity[self.planes] = 0
        mujoco.mj_collision(m, self.d)
