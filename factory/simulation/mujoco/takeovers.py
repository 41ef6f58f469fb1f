"""Measurements of bodies as a grip closes on them."""

from __future__ import annotations

import numpy as np

from factory.control.mode import Array, Index
from factory.mjcf.weld_frames import WeldFrames
from factory.support.engine import mujoco


class Takeovers:
    """`count`: how many bodies have been taken over; `gap` [m]: the largest distance between the
    frames that a grip joined; `turn` [rad]: the largest angle between them; `off` [m]: the largest
    way of any vertex to where its grip keeps it, turns included. `radii` (nbody,): how far vertices
    are from their body's origin [m]. The kinematics in `d` are up to date."""

    def __init__(self, m: mujoco.MjModel, d: mujoco.MjData, radii: Array) -> None:
        self.count, self.gap, self.turn, self.off = 0, 0.0, 0.0, 0.0
        self._d, self._frames, self._radii = d, WeldFrames.of(m, d), radii
        self._qpos = m.jnt_qposadr[m.body_jntadr][:, None] + np.arange(7)

    def measure(self, welds: Index, bodies: Index) -> None:
        """Measure bodies on which welds close, at their current places; `xpos` belongs to the start
        of the last step."""
        q, frames = self._d.qpos, self._frames.chosen(welds)
        pose = q[self._qpos[bodies]]
        gap = np.linalg.norm(pose[:, :3] - frames.at(q[frames.along]), axis=1)
        turn = frames.turned(q[frames.along])
        sine = np.sqrt(np.maximum(0.0, 1.0 - (pose[:, 3:] * turn).sum(axis=1) ** 2))
        turned = 2 * sine * self._radii[bodies]
        self.count += len(welds)
        self.gap = max(self.gap, float(gap.max()))
        self.turn = max(self.turn, 2 * float(np.arcsin(np.minimum(sine.max(), 1.0))))
        self.off = max(self.off, float((gap + turned).max()))
