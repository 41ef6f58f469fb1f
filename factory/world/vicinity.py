"""Which bodies the engine's broad phase looks at: those that move, and all that they may reach.

The engine boxes every body that can collide in every step, and drops pairs of sleepers afterwards.
Most of a factory rests, far from what moves: it is left out of the broad phase until something
comes near, or it moves itself. No pair that could touch is left out, so a run is the same to the
last bit.
"""

from __future__ import annotations

import numpy as np

from factory.control.mode import Array, Index
from factory.engine import mujoco
from factory.world.contacts import Contacts

PERIOD = 0.04
"""All that moves is looked at again after this [s]."""

SUDDEN, TIMES = 20.0, 2.0
"""Nothing gains speed faster than this [m/s²], or than so many times what the settings ask for, but
what is pushed."""

CROWD = 0.25
"""Where more than this share of all holders moves, there is little to leave out, and nothing is."""

FEW = 250
"""Where there are fewer holders, looking takes longer than it saves: up to some 100 robots."""

IS_AWAKE = int(mujoco.mjtSleepState.mjS_AWAKE)
"""What the engine says of a body that does not sleep."""


class Vicinity:
    """The bodies that the broad phase of a model looks at: all, where there are few holders.

    All that is in the same hands is looked at as one box, seen from above; `holders` are the codes
    that `contacts` has. `stale`: something has been woken since the last look, or the last at all
    that moves was long ago.
    """

    def __init__(
        self,
        m: mujoco.MjModel,
        d: mujoco.MjData,
        contacts: Contacts,
        holders: int,
        asked: float = 0.0,
    ) -> None:
        self.m, self.d, self.contacts, self.holder = m, d, contacts, contacts.code
        self._sudden = max(SUDDEN, TIMES * asked)
        self._culls, self.stale, self._due = holders >= FEW, False, 0.0
        self._woken = [np.empty(0, np.intp)]
        if self._culls:
            self._seen = np.zeros(m.ntree, bool)
            self._near = np.ones(holders + 1, bool)
            self._meets = np.empty((2, int(CROWD * len(self._near)) + 1, len(self._near)), bool)
            self._low = np.full((2, holders + 1), np.inf, np.float32)
            self._high = np.full((2, holders + 1), -np.inf, np.float32)
            self._lowest, self._highest = _boxes(m, d, contacts)
            self._box(self.holder.nonzero()[0])

    def woken(self, bodies: Index) -> None:
        """Bodies are about to move."""
        if self._culls and len(bodies):
            self._woken.append(bodies)
            self.stale = True

    def notice(self) -> None:
        """It is stale where the engine has woken something by itself, or at the end of a period."""
        if self._culls and (self.d.time >= self._due or (self._awake > self._seen).any()):
            self._due, self.stale = self.d.time, True

    def everything(self) -> None:
        """From now on nothing is left out: somebody pushes."""
        self._culls = self.stale = False
        self._show(np.ones(self.m.nbody, bool))

    @property
    def _awake(self) -> np.ndarray:
        return np.asarray(self.d.tree_asleep < 0)

    def look(self) -> None:
        """Choose what the broad phase looks at: anew where that is due, else what has been woken
        besides."""
        self.stale = False
        anew = self.d.time >= self._due
        if anew:
            self._due, self._seen = self.d.time + PERIOD, self._awake
        near = np.zeros_like(self._near)
        moves = np.zeros_like(near)
        moves[self.holder[np.concatenate(self._woken)]] = True
        del self._woken[1:]
        if anew:
            moves[self.holder[self.d.body_awake == IS_AWAKE]] = True
        bodies = (moves[self.holder] & self.contacts.collides).nonzero()[0]
        if len(bodies):
            near = self._reached(bodies)
            self._seen[self.m.body_treeid[bodies]] = True
        self._near = near if anew else self._near | near
        self._show(self._near[self.holder])

    def _reached(self, bodies: np.ndarray) -> np.ndarray:
        """The holders (holders + 1,) that moving bodies may reach within a period; their own among
        them."""
        who = self._box(bodies)
        if len(who) > CROWD * len(self._near):
            return np.ones_like(self._near)
        speed = np.abs(self.d.cvel.take(bodies, axis=0)[:, 3:]).max()
        reach = float(speed + self._sudden * PERIOD / 2) * PERIOD
        low, high = self._low, self._high
        (x0, y0), (x1, y1) = low[:, who, None] - reach, high[:, who, None] + reach
        meets, also = self._meets[:, : len(who)]
        np.less_equal(x0, high[0], out=meets)
        for one, other in ((low[0], x1), (y0, high[1]), (low[1], y1)):
            meets &= np.less_equal(one, other, out=also)
        return np.asarray(meets.any(axis=0))

    def _box(self, bodies: np.ndarray) -> np.ndarray:
        """Box all that the holders of bodies have, which are these, and tell who they are."""
        bodies = bodies[np.argsort(self.holder[bodies], kind="stable")]
        holder = self.holder[bodies]
        first = np.concatenate([[0], (holder[1:] != holder[:-1]).nonzero()[0] + 1])
        who, at = holder[first], self.d.xpos.take(bodies, axis=0)
        low, high = at + self._lowest.take(bodies, axis=0), at + self._highest.take(bodies, axis=0)
        self._low[:, who] = np.minimum.reduceat(low, first)[:, :2].T
        self._high[:, who] = np.maximum.reduceat(high, first)[:, :2].T
        return np.asarray(who)

    def _show(self, near: np.ndarray) -> None:
        np.multiply(self.contacts.contype, near, out=self.m.body_contype)
        np.multiply(self.contacts.conaffinity, near, out=self.m.body_conaffinity)


def _boxes(m: mujoco.MjModel, d: mujoco.MjData, contacts: Contacts) -> tuple[Array, Array]:
    """The lowest and highest corner of each body's box from its origin, in the world's directions
    (nbody, 3) [m]. That of a part holds it whichever way it is turned; all else does not turn."""
    mujoco.mj_kinematics(m, d)
    turn, body = d.geom_xmat.reshape(-1, 3, 3), m.geom_bodyid
    middle = d.geom_xpos + (turn @ m.geom_aabb[:, :3, None])[:, :, 0] - d.xpos[body]
    half = (np.abs(turn) @ m.geom_aabb[:, 3:, None])[:, :, 0]
    ball = np.linalg.norm(middle, axis=1) + np.linalg.norm(half, axis=1)
    turns = np.isin(body, [*contacts.solid])
    middle[turns], half[turns] = 0.0, ball[turns, None]
    solid = contacts.collides[body]
    solid[np.concatenate([*contacts.solid.values()])] = True
    low, high = np.full((m.nbody, 3), np.inf), np.full((m.nbody, 3), -np.inf)
    np.minimum.at(low, body[solid], (middle - half)[solid])
    np.maximum.at(high, body[solid], (middle + half)[solid])
    return low, high
