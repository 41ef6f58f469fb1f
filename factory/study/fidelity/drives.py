"""Drives: how well axes track their reference, and how near their forces come to the limit."""

from __future__ import annotations

from typing import Any

import numpy as np

from factory.control.mode import Array
from factory.study.fidelity.histogram import Histogram

FULL = 0.999
"""A force of this share of its limit is saturated."""


class Drives:
    """Tracking errors [m], forces as a share of their limit, and work [J]."""

    def __init__(self, world: Any) -> None:
        self.world, m = world, world.m
        self.tracking = Histogram()
        self.error = self.peak = self.work = 0.0
        self.dof = m.jnt_dofadr[m.actuator_trnid[:, 0]]
        self.limit = m.actuator_forcerange[:, 1]
        self.saturated = np.zeros(len(self.limit), np.int64)
        self.steps = 0
        self.timestep = float(m.opt.timestep)

    def tick(self, v: Array, force: Array) -> None:
        """The steps of a tick: speeds (n + 1, nv), forces (n, nu)."""
        d, motion = self.world.d, self.world.motion
        control = motion.drives.control
        error = np.abs(d.qpos[motion.axes.qpos] - d.ctrl[control])
        self.error = max(self.error, float(error.max()))
        self.tracking.add(error[d.ctrl[control + 1] != 0.0])
        share = np.abs(force) / self.limit
        self.peak = max(self.peak, float(share.max()))
        self.saturated += (share >= FULL).sum(axis=0)
        self.steps += len(force)
        speed = v[:, self.dof]
        self.work += self.timestep * float(np.abs(force * (speed[1:] + speed[:-1]) / 2).sum())

    @property
    def saturation(self) -> float:
        """Share of the steps in which the worst drive was at its limit."""
        return float(self.saturated.max()) / self.steps if self.steps else 0.0
