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
from factory.world.contacts import NOBODY, Contacts

TIMES = 2.0
"""Nothing gains speed faster than so many times what the settings ask for, unless it touches
something or is pushed."""

SUDDEN = 20.0
"""What touches something does not gain speed faster than this [m/s²], or than the above."""

CROWD = 0.25
"""Where more than this share of all holders moves, there is little to leave out, and nothing is."""

FEW = 250
"""Where there are fewer holders, looking takes longer than it saves: up to some 100 robots."""

SWAY = 1e-3
"""What is held is not further than this from where it was when it was taken [m], unless something
touches."""


class Vicinity:
    """The bodies that the broad phase of a model looks at: all, where there are few holders.

    All that is in the same hands is looked at as one box, seen from above, that goes where its
    holder goes; `holders` are the codes that `contacts` has. All that moves is looked at every
    `period` [s]. `stale`: something has been woken since the last look, or that is due.
    """

    def __init__(
        self,
        m: mujoco.MjModel,
        d: mujoco.MjData,
        contacts: Contacts,
        holders: int,
        period: float,
        asked: float = 0.0,
    ) -> None:
        self.m, self.d, self.contacts, self.holder = m, d, contacts, contacts.code
        self._gains = TIMES * asked
        self._period, self._early = period, float(m.opt.timestep) / 2
        self._culls, self._due = holders >= FEW, 0.0
        self.stale = self._anew = self._touches = False
        self._woken = [np.empty(0, np.intp)]
        if self._culls:
            self._seen = np.zeros(m.ntree, bool)
            self._near = np.ones(holders + 1, bool)
            self._meets = np.empty((2, int(CROWD * len(self._near)) + 1, len(self._near)), bool)
            self._lowest, self._highest = _boxes(m, d, contacts)
            self._of_tree, self._anchor = self._whose(holders)
            self._extent = np.full((4, holders + 1), -np.inf)
            self._rest = np.full((4, holders + 1), np.inf, np.float32)
            self._changed = np.ones(holders + 1, bool)
            everybody = np.unique(self.holder[self.holder != NOBODY])
            self._measure(everybody)
            self._place(everybody)

    def _whose(self, holders: int) -> tuple[Index, Index]:
        """A body of each tree that says whose it is, and the body that each holder goes with: the
        world's for those that stand."""
        own = self.holder.nonzero()[0]
        trees, first = np.unique(self.m.body_treeid, return_index=True)
        of_tree, anchor = first[trees >= 0], np.zeros(holders + 1, np.intp)
        own = own[self.m.body_treeid[own] >= 0]
        anchor[self.holder[own]] = of_tree[self.m.body_treeid[own]]
        of_tree[self.m.body_treeid[own]] = own
        return of_tree, anchor

    def woken(self, bodies: Index) -> None:
        """Bodies are about to move."""
        if self._culls and len(bodies):
            self._woken.append(bodies)
            self.stale = True

    def changed(self, holders: Index) -> None:
        """Holders have something else in their hands."""
        if self._culls:
            self._changed[holders] = True

    def notice(self) -> None:
        """It is stale at the end of a period, and where something has begun to touch or the engine
        has woken something by itself."""
        if self._culls and (
            self.d.time >= self._due
            or (self.d.ncon and not self._touches)
            or (self._awake > self._seen).any()
        ):
            self._anew = self.stale = True

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
        anew, self._anew, self.stale = self._anew, False, False
        touched, self._touches = self._touches, bool(self.d.ncon)
        bodies, woken = self._woken[0], len(self._woken) > 1
        if woken:
            bodies = np.concatenate(self._woken)
            del self._woken[1:]
        if anew:
            self._seen = self._awake
            bodies = np.concatenate([bodies, self._of_tree[self._seen]])
            if self.d.time >= self._due:
                self._due = self.d.time + self._period - self._early
        moves = np.zeros_like(self._near)
        moves[self.holder[bodies]] = True
        moves[NOBODY] = False
        who = moves.nonzero()[0]
        reach = self._reach_of_any(who, bodies) if touched or self._touches else self._reach(who)
        near = self._reached(who, reach)
        if not anew:
            near |= self._near
        if woken:
            self._seen |= moves[self.holder[self._of_tree]]
        self._near = near
        self._show(near[self.holder])

    def _reach(self, who: Index) -> Array:
        """How far holders that move come within a period, to the east, north, west and south
        (4, n) [m]: as fast as they are they go on, or somewhat faster or slower."""
        changed = who[self._changed[who]]
        if len(changed):
            self._measure(changed)
        ahead = self.d.cvel.take(self._anchor[who], axis=0)[:, 3:5].T * self._period
        ahead = np.maximum(np.concatenate([ahead, -ahead]), 0.0)
        return np.asarray(ahead + (self._gains * self._period**2 / 2 + SWAY))

    def _reach_of_any(self, who: Index, bodies: Index) -> Array:
        """The same of holders with bodies that move, where something touches: whichever way, and
        with what they have wherever it is."""
        if len(who):
            self._measure(who)
        speed = np.abs(self.d.cvel[[*self._anchor[who], *bodies], 3:]).max(initial=0.0)
        gain = max(SUDDEN, self._gains) * self._period
        return np.full((4, len(who)), (speed + gain / 2) * self._period + SWAY)

    def _reached(self, who: Index, reach: Array) -> np.ndarray:
        """The holders (holders + 1,) that moving ones may reach within a period; themselves among
        them."""
        extent = self._place(who)
        if len(who) > CROWD * len(self._near):
            return np.ones_like(self._near)
        east, north, west, south = (extent + reach).astype(np.float32)[:, :, None]
        meets, also = self._meets[:, : len(who)]
        np.less_equal(self._rest[0], west, out=meets)
        for side, other in zip(self._rest[1:], (south, east, north), strict=True):
            meets &= np.less_equal(side, other, out=also)
        return np.asarray(meets.any(axis=0))

    def _place(self, who: Index) -> Array:
        """Where holders extend to now, to the east, north, west and south (4, n) [m]."""
        at = self.d.xpos.take(self._anchor[who], axis=0)[:, :2].T
        extent = self._extent.take(who, axis=1) + np.concatenate([at, -at])
        self._rest[:, who] = -extent
        return np.asarray(extent)

    def _measure(self, who: Index) -> None:
        """Measure how far what holders have extends from the body that they go with."""
        self._changed[who] = False
        chosen = np.zeros_like(self._near)
        chosen[who] = True
        bodies = chosen[self.holder].nonzero()[0]
        self._extent[:, who] = -np.inf
        if not len(bodies):
            return
        bodies = bodies[np.argsort(self.holder[bodies], kind="stable")]
        holder, place = self.holder[bodies], self.d.xpos
        first = np.concatenate([[0], (holder[1:] != holder[:-1]).nonzero()[0] + 1])
        at = (place[bodies] - place[self._anchor[holder]])[:, :2]
        sides = [at + self._highest[bodies, :2], -at - self._lowest[bodies, :2]]
        self._extent[:, holder[first]] = np.maximum.reduceat(np.hstack(sides), first).T

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
