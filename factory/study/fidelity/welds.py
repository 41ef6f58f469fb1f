"""Who holds what: the active welds, read from the engine, and which have just been switched on."""

from __future__ import annotations

import numpy as np

from factory.control.mode import Array, Index
from factory.mjcf import names
from factory.support.engine import mujoco

PARK, FEED, GRIP, HOLD = range(4)
KINDS = {"park": PARK, "feed": FEED, "grip": GRIP, "hold": HOLD}


class Welds:
    """`holder`, `kind` (nbody,): for each body the body that holds it and the kind of the weld by
    which; -1 where nothing does."""

    def __init__(self, m: mujoco.MjModel, d: mujoco.MjData) -> None:
        self.m, self.d = m, d
        self.kinds = np.array([KINDS[names.kind(m.equality(i).name)] for i in range(m.neq)], int)
        self.active = np.zeros(m.neq, bool)
        self.target = np.array(m.eq_obj2id)
        self.scan()

    def scan(self) -> Index:
        """Look again; gives the grips and holds that have been switched on since the last time."""
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

    def gaps(self, welds: Index, xpos: Array, xmat: Array) -> Array:
        """Distances (n,) between the frames that welds join [m], where bodies are at `xpos`."""
        holder, body = self.m.eq_obj1id[welds], self.m.eq_obj2id[welds]
        turn, own = xmat[holder].reshape(-1, 3, 3), xmat[body].reshape(-1, 3, 3)
        wanted = xpos[holder] + np.einsum("nij,nj->ni", turn, self.m.eq_data[welds, 3:6])
        found = xpos[body] + np.einsum("nij,nj->ni", own, self.m.eq_data[welds, :3])
        return np.asarray(np.linalg.norm(found - wanted, axis=1))


class Velocities:
    """Velocities of parts and of what holds them, from the speeds of all degrees of freedom.

    Holders move along slides only, one upon another, so their velocity is a sum over those.
    """

    def __init__(self, m: mujoco.MjModel, xaxis: Array) -> None:
        self.m = m
        chains = [self._slides(body) for body in range(m.nbody)]
        most = max(1, *map(len, chains))
        self.dof = np.zeros((m.nbody, most), np.intp)
        self.axis = np.zeros((m.nbody, most, 3))
        for body, chain in enumerate(chains):
            for place, joint in enumerate(chain):
                self.dof[body, place] = m.jnt_dofadr[joint]
                self.axis[body, place] = xaxis[joint]
        self.free = m.body_dofadr[:, None] + np.arange(6)

    def _slides(self, body: int) -> list[int]:
        found: list[int] = []
        while body:
            first, count = self.m.body_jntadr[body], self.m.body_jntnum[body]
            found += [
                j
                for j in range(first, first + count)
                if self.m.jnt_type[j] == int(mujoco.mjtJoint.mjJNT_SLIDE)
            ]
            body = int(self.m.body_parentid[body])
        return found

    def linear(self, v: Array, parts: Index) -> Array:
        """Of free bodies: (..., p, 3) [m/s] from speeds (..., nv)."""
        return v[..., self.free[parts, :3]]

    def angular(self, v: Array, parts: Index) -> Array:
        """Of free bodies, in their own frames: (..., p, 3) [rad/s]."""
        return v[..., self.free[parts, 3:]]

    def of_holders(self, v: Array, holders: Index) -> Array:
        """Of carriages, lifts, the tray and what stands still: (..., p, 3) [m/s]."""
        moved = np.einsum("...pj,pjk->...pk", v[..., self.dof[holders]], self.axis[holders])
        return np.asarray(moved)
