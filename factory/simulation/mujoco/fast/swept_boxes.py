"""Whom each holder may meet on its way: all that it carries is one box with it, seen from above."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from factory.control.mode import Array, Index
from factory.simulation.mujoco.contacts import NOBODY, Contacts
from factory.simulation.mujoco.gaps import held_at
from factory.simulation.mujoco.loads import Load
from factory.support.engine import mujoco

CELL = 1e-3
"""Places on slides are rounded to this [m]: robots go the same ways again and again."""


BESIDE = 3e-3
"""Nobody is further than this from its ways [m]: some cells."""

Way = tuple[int, int, int]
"""A load, and the two places on its holder's slide between which it is [cells]."""


class _Met(dict[Way, int]):
    """What is found out when somebody asks first."""

    def __init__(self, found: Callable[[Way], int]) -> None:
        super().__init__()
        self._found = found

    def __missing__(self, way: Way) -> int:
        self[way] = found = self._found(way)
        return found


class Reach:
    """Of holders, by the codes that `contacts` has, with what they may carry, `loads`, by number.

    `slides`: the joint that a holder is on; who is on none stands. `margins` (holders + 1,): what
    comes as near to a holder as that [m] is met. `address` (holders + 1,): of each slide in `qpos`,
    -1 for none. `met`: the holders that one with a load may meet on a way, wherever they are, as
    the bits of a number. `beyond`: somebody has been where it was not to be with its load, and may
    be met there by others.
    """

    def __init__(
        self,
        m: mujoco.MjModel,
        d: mujoco.MjData,
        contacts: Contacts,
        loads: Sequence[Load],
        slides: Mapping[int, int],
        margins: Array,
    ) -> None:
        mujoco.mj_kinematics(m, d)
        self._holder, self._margins = np.array([load.holder for load in loads]), margins
        count = int(self._holder.max()) + 1
        riders, joint = [*slides], np.array([*slides.values()])
        self.address = np.full(count, -1)
        self.address[riders] = m.jnt_qposadr[joint]
        at, self._way = np.zeros((2, count)), np.zeros((2, count))
        at[:, riders], self._way[:, riders] = (
            d.xpos[m.jnt_bodyid[joint], :2].T,
            d.xaxis[joint, :2].T,
        )
        self._begin = at - self._way * d.qpos[self.address]
        self._extent = _extents(m, d, contacts, at, loads)
        self.met, self.beyond = _Met(self._meets), False
        self._ends = np.array([(load.low - BESIDE, load.high + BESIDE) for load in loads]).T
        sides = self._between(np.arange(len(loads)), *self._ends)
        self._most = np.full((4, count), -np.inf)
        np.maximum.at(self._most.T, self._holder, sides.T)

    def _meets(self, way: Way) -> int:
        load, *cells = way
        ends, (low, high) = np.array(cells) * CELL, self._ends[:, load]
        self.beyond |= bool(ends[0] < low or high < ends[1])
        here = self._between(np.array([load]), *ends[:, None])
        opposite = here[[2, 3, 0, 1]] + self._margins[self._holder[load]]
        meets = (opposite + self._most >= 0.0).all(axis=0)
        return int.from_bytes(np.packbits(meets, bitorder="little").tobytes(), "little")

    def _between(self, loads: Index, low: Array, high: Array) -> Array:
        """How far to the east, north, west and south (4, n) [m] of the middle of the floor holders
        with loads come between places [m]."""
        begin, way = self._begin[:, self._holder[loads]], self._way[:, self._holder[loads]]
        one, other = begin + way * low, begin + way * high
        ends = np.concatenate([np.maximum(one, other), -np.minimum(one, other)])
        return np.asarray(self._extent[:, loads] + ends)


def _extents(
    m: mujoco.MjModel, d: mujoco.MjData, contacts: Contacts, at: Array, loads: Sequence[Load]
) -> Array:
    """How far to the east, north, west and south (4, loads) [m] of where holders are `at`
    (2, holders + 1) comes what they have: their own bodies, and parts by welds."""
    low, high = boxes(m, d, contacts)
    own = np.flatnonzero(contacts.code != NOBODY)
    bare = _bounds(contacts.code[own], d.xpos[own], low[own], high[own], at.shape[1])
    number = np.repeat(np.arange(len(loads)), [len(load.welds) for load in loads])
    weld = np.array([weld for load in loads for weld in load.welds], np.intp)
    body = m.eq_obj2id[weld]
    held = _bounds(number, held_at(m, d, weld), low[body], high[body], len(loads))
    holder = [load.holder for load in loads]
    return np.asarray(np.maximum(bare[:, holder], held) - np.concatenate([at, -at])[:, holder])


def _bounds(group: Index, place: Array, low: Array, high: Array, count: int) -> Array:
    """The sides (4, count) of the boxes, in groups, of bodies that are somewhere."""
    found = np.full((count, 4), -np.inf)
    np.maximum.at(found, group, np.hstack([(place + high)[:, :2], -(place + low)[:, :2]]))
    return found.T


def boxes(m: mujoco.MjModel, d: mujoco.MjData, contacts: Contacts) -> tuple[Array, Array]:
    """The lowest and highest corner of each body's box from its origin, in the world's directions
    (nbody, 3) [m]: of what can collide of it, as it is turned now."""
    turn, body = d.geom_xmat.reshape(-1, 3, 3), m.geom_bodyid
    middle = d.geom_xpos + (turn @ m.geom_aabb[:, :3, None])[:, :, 0] - d.xpos[body]
    half = (np.abs(turn) @ m.geom_aabb[:, 3:, None])[:, :, 0]
    low, high = np.full((m.nbody, 3), np.inf), np.full((m.nbody, 3), -np.inf)
    solid = contacts.collides[body]
    solid[np.concatenate([*contacts.solid.values()])] = True
    np.minimum.at(low, body[solid], (middle - half)[solid])
    np.maximum.at(high, body[solid], (middle + half)[solid])
    return low, high
