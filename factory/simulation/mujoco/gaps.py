"""The frames that welds join, and how far apart they are."""

from __future__ import annotations

import numpy as np

from factory.control.mode import Array, Index
from factory.support.engine import mujoco


class WeldFrames:
    """The welds of a model whose first body only slides, and whose second is free.

    The engine has the bodies where its last step began: frames are worked out from the positions of
    the slides, of which a body has two at most, the one that carries it and that one's.
    """

    def __init__(self, m: mujoco.MjModel, d: mujoco.MjData) -> None:
        self._d = d
        mujoco.mj_kinematics(m, d)
        joint = _slides(m)[m.eq_obj1id]
        self._slides = m.jnt_qposadr[joint]
        self._ways = np.where(joint[:, :, None] < 0, 0.0, d.xaxis[joint])
        gone = (self._ways * d.qpos[self._slides][:, :, None]).sum(axis=1)
        self._frame = held_at(m, d, np.arange(m.neq)) - gone
        self._free = m.jnt_qposadr[m.body_jntadr][:, None] + np.arange(3)

    def apart(self, welds: Index, bodies: Index) -> float:
        """The largest distance [m] between where welds hold bodies and where those are."""
        q = self._d.qpos
        gone = (self._ways[welds] * q[self._slides[welds]][:, :, None]).sum(axis=1)
        offset = q[self._free[bodies]] - (self._frame[welds] + gone)
        return float(np.sqrt((offset * offset).sum(axis=1).max()))


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
