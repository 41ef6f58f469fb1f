"""How far apart frames were when a grip joined them. What is needed to tell is noted at once; it is
worked out when somebody asks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from factory.control.mode import Index
from factory.geometry.meshes import Array
from factory.support.engine import mujoco

MANY = 1000
"""So many notes are worked out at once, asked or not."""


class Gaps:
    """Of the welds of a model whose first body only slides, and whose second is free.

    The engine has bodies where its last step began: positions are worked out from those of the
    slides, of which a body has two at most, the one that carries it and that one's.
    """

    def __init__(self, m: mujoco.MjModel, d: mujoco.MjData) -> None:
        self.d = d
        mujoco.mj_kinematics(m, d)
        holder, slides = m.eq_obj1id, _slides(m)
        joint = slides[holder]
        self._slides = m.jnt_qposadr[joint]
        self._ways = np.where(joint[:, :, None] < 0, 0.0, d.xaxis[joint])
        gone = (self._ways * d.qpos[self._slides][:, :, None]).sum(axis=1)
        self._frame = held_at(m, d, np.arange(m.neq)) - gone
        self._free = m.jnt_qposadr[m.body_jntadr][:, None] + np.arange(3)
        self._notes: list[tuple[Index, Array, Array]] = []
        self._largest = 0.0

    def note(self, welds: Sequence[int], bodies: Sequence[int]) -> None:
        """Welds are about to join bodies."""
        q = self.d.qpos
        self._notes.append((np.array(welds), q[self._slides[welds]], q[self._free[bodies]]))
        if len(self._notes) >= MANY:
            self.largest()

    def largest(self) -> float:
        """The largest gap of all that has been noted since `forget` [m]."""
        if self._notes:
            welds, slides, there = map(np.concatenate, zip(*self._notes, strict=True))
            self._notes.clear()
            gone = (self._ways[welds] * slides[:, :, None]).sum(axis=1)
            apart = there - (self._frame[welds] + gone)
            self._largest = max(self._largest, float(np.sqrt((apart * apart).sum(axis=1).max())))
        return self._largest

    def forget(self) -> None:
        """Begin anew."""
        self._notes.clear()
        self._largest = 0.0


def held_at(m: mujoco.MjModel, d: mujoco.MjData, welds: Index) -> Array:
    """Where welds hold the origins of their second bodies (n, 3) [m]."""
    holder = m.eq_obj1id[welds]
    reach = d.xmat[holder].reshape(-1, 3, 3) @ m.eq_data[welds, 3:6, None]
    return np.asarray(d.xpos[holder] + reach[:, :, 0])


def _slides(m: mujoco.MjModel) -> Index:
    """For each body the two slides that carry it (nbody, 2), its own first, -1 for none."""
    own = np.where(m.body_jntnum > 0, m.body_jntadr, -1)
    own[m.jnt_type[own] != int(mujoco.mjtJoint.mjJNT_SLIDE)] = -1
    return np.stack([own, own[m.body_parentid]], axis=1)
