"""A copy of the engine's state in which all that is drawn is solid, whatever may touch in a run.

No masks, no exclusions, and a body against its parent too. Geoms that nothing can move against each
other do not meet, nor does what lies below the floor.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from factory.api import Geoms, Model, Replica, names
from factory.support.arrays import Array, Index, Truth
from factory.support.engine import mujoco


class SolidReplica(Replica):
    """A model `m` and data `d` of its own in which all that is drawn is solid."""

    def __init__(self, m: mujoco.MjModel) -> None:
        super().__init__(m)
        m, solid = self.m, drawn(m)
        m.geom_contype[:] = m.geom_conaffinity[:] = solid
        m.geom_margin[:] = m.geom_gap[:] = m.body_margin[:] = 0.0
        self.exclude_nothing()
        m.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_FILTERPARENT)
        self._solid = np.isin(np.arange(m.nbody), m.geom_bodyid[solid])

    def meeting(self, qpos: NDArray[Any]) -> tuple[Index, Array]:
        """The pairs of geoms (n, 2) that meet where the joints are at `qpos` (nq,), one of each
        pair at least movable, and how deep (n,) one is inside the other [m]."""
        m, d = self.m, self.d
        self.place(qpos)
        m.body_contype[:] = m.body_conaffinity[:] = self._solid & (d.xpos[:, 2] > Model.HIDDEN)
        mujoco.mj_collision(m, d)
        return d.contact.geom[: d.ncon], -d.contact.dist[: d.ncon]

    def standing(self) -> tuple[Index, Array]:
        """The same of geoms that never move, which the engine does not look at; but not of two
        whose names differ in the last word alone: these are one thing."""
        m, d = self.m, self.d
        fixed = np.flatnonzero((m.body_weldid[m.geom_bodyid] == 0) & (m.geom_contype > 0))
        turn = np.abs(d.geom_xmat[fixed].reshape(-1, 3, 3))
        centre = d.geom_xpos[fixed] + np.einsum(
            "nij,nj->ni", d.geom_xmat[fixed].reshape(-1, 3, 3), m.geom_aabb[fixed, :3]
        )
        half = np.einsum("nij,nj->ni", turn, m.geom_aabb[fixed, 3:])
        owner = np.array([m.geom(int(g)).name.rpartition("/")[0] for g in fixed])
        near = _overlapping(centre - half, centre + half)
        pairs = fixed[near[owner[near[:, 0]] != owner[near[:, 1]]]]
        apart = [mujoco.mj_geomDistance(m, d, a, b, 0.0, None) for a, b in pairs.tolist()]
        return pairs, -np.array(apart)


def drawn(m: mujoco.MjModel) -> Truth:
    """The geoms (ngeom,) that what is drawn consists of: those that are drawn, the floor aside, and
    of parts that are drawn as one and collide as several those that collide."""
    body = [names.kind(m.body(int(b)).name) for b in m.geom_bodyid]
    part = np.isin(body, ["part", names.SHELL])
    plane = m.geom_type == mujoco.mjtGeom.mjGEOM_PLANE
    return np.asarray(np.where(part, m.geom_group != 1, (m.geom_group < Geoms.SHOWN) & ~plane))


def _overlapping(low: Array, high: Array) -> Index:
    """The pairs (k, 2) of boxes (n, 3) that overlap."""
    from shapely import STRtree, box

    flat = box(low[:, 0], low[:, 1], high[:, 0], high[:, 1])
    one, other = STRtree(flat).query(flat)
    level = (low[one, 2] < high[other, 2]) & (low[other, 2] < high[one, 2]) & (one < other)
    return np.stack([one[level], other[level]], axis=1)
