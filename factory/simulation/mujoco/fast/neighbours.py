"""Which holders can meet at all, and what the engine's broad phase looks at for that.

The engine boxes every body that can collide in every step. Most of a factory rests, far from what
moves. A holder (a robot, a feeder, the tray) sweeps one box with all that it ever holds, seen from
above; those whose boxes are apart never meet. So the broad phase looks at what is awake and its
neighbours. No pair that could touch is left out: a run is the same to the last bit. Where anything
touches, is pushed or leaves its way, everything is looked at, until other modes begin after some
time in which nothing does.
"""

from __future__ import annotations

import numpy as np

from factory.control.mode import Array, Index, Truth
from factory.mjcf.masks import NOBODY
from factory.mjcf.weld_frames import held_at
from factory.simulation.mujoco.axes import Axes
from factory.simulation.mujoco.contacts import ContactMasks
from factory.simulation.mujoco.parts import Parts
from factory.support.engine import mujoco

MARGIN = 5e-3
"""Nothing is further from its way than this, or from its place in the hand, unless it is touched
[m]."""

ASTRAY = 2e-3
"""A holder has left its way when it is further than this beyond an end [m]."""

CALM = 0.1
"""What has been touched or pushed is back in its place in the hand so long after that [s]."""

FEW = 120
"""Where there are fewer holders all bodies are looked at: choosing takes as long as it saves."""


class Neighbours:
    """The holders of a model's parts, by their codes, where the run begins; `culls`: some may be
    left out."""

    def __init__(self, m: mujoco.MjModel, d: mujoco.MjData, parts: Parts, axes: Axes) -> None:
        self._d, self._masks, self._holder = d, parts.masks, _holders(parts, axes)
        trees = (
            dict(zip(axes.tree.tolist(), self._holder.tolist(), strict=True)) | parts.feeders.trees
        )
        count = parts.masks.own(trees, parts.tray + len(parts.feeders.welds)) + 1
        self.culls, self._calm = count > FEW, -np.inf
        self._seen = np.ones(count, bool)
        if self.culls:
            mujoco.mj_kinematics(m, d)
            self._box = _swept(m, d, parts, axes, self._holder, count)
            self._meets = _meeting(*self._box)
            self._bodies = _of_trees(m, parts.masks.code)
            slides, lengths = _slides(parts, axes)
            self._address, self._ways = axes.qpos[slides], (-ASTRAY, lengths + ASTRAY)

    def turn(self, active: Index) -> None:
        """These axes move from now on; what is awake may move, too."""
        if not self.culls or self._d.time < self._calm:
            return
        moves = np.zeros_like(self._seen)
        moves[self._masks.code[self._bodies[self._d.tree_asleep < 0]]] = True
        moves[self._holder[active]] = True
        moves[NOBODY] = False
        self._seen = np.zeros_like(moves)
        self._include(moves.nonzero()[0])

    @property
    def complete(self) -> bool:
        """Whether everything is looked at."""
        return bool(self._seen.all())

    def astray(self) -> bool:
        """Whether a holder is off its way, and something is left out that it may meet there."""
        if self.complete:
            return False
        x, (low, high) = self._d.qpos[self._address], self._ways
        return bool(((x < low) | (x > high)).any())

    def notice(self) -> None:
        """Look at holders that have been given something, too."""
        if self._masks.fresh:
            if self.culls:
                self._include(np.array([*self._masks.fresh - {NOBODY}], np.intp))
            self._masks.fresh.clear()

    def _include(self, holders: Index) -> None:
        """Look at holders and all that they can meet, too."""
        self._seen |= self._meets[holders].any(axis=0)
        self._masks.look(self._seen)

    def everything(self) -> None:
        """Look at everything for a while, and until other modes begin."""
        self._calm = self._d.time + CALM
        if not self.complete:
            self._seen[:] = True
            self._masks.look(self._seen)


def _holders(parts: Parts, axes: Axes) -> Index:
    """The code of the holder that each axis (axes,) is of."""
    robots = len(parts.model.factory.robots)
    lifts = (robot + 1 for robot in axes.lift)
    return np.array([*range(1, robots + 1), *lifts, parts.tray, parts.tray])


def _slides(parts: Parts, axes: Axes) -> tuple[Index, Array]:
    """The axes along which holders go, and the lengths of their ways [m]."""
    layout = parts.model.layout
    lengths = [path.length for path in layout.guidepaths]
    return np.r_[: len(lengths), axes.tray], np.array([*lengths, layout.outfeed_way])


def _of_trees(m: mujoco.MjModel, code: Index) -> Index:
    """For each kinematic tree a body that tells its holder."""
    found = np.zeros(m.ntree, np.intp)
    for bodies in (np.arange(m.nbody), np.flatnonzero(code != NOBODY)):
        moving = bodies[m.body_treeid[bodies] >= 0]
        found[m.body_treeid[moving]] = moving
    return found


def _meeting(low: Array, high: Array) -> Truth:
    """Which boxes (n, n) come near each other, with these corners (n, 2) [m]; each is near itself,
    empty ones too."""
    near = np.eye(len(low), dtype=bool)
    return near | ((low[:, None] <= high) & (high[:, None] >= low)).all(axis=2)


def _swept(
    m: mujoco.MjModel, d: mujoco.MjData, parts: Parts, axes: Axes, holder: Index, count: int
) -> tuple[Array, Array]:
    """The corners (count, 2) [m] of the box that each holder sweeps, with all that it ever holds,
    from one end of its way to the other."""
    masks = parts.masks
    low, high = boxes(m, d, masks)
    bodies = np.flatnonzero(masks.code != NOBODY)
    welds, codes = np.array([*parts.grips()]).T
    held = m.eq_obj2id[welds]
    code = np.concatenate([masks.code[bodies], codes])
    place = np.concatenate([d.xpos[bodies], held_at(m, welds, d.xpos, d.xmat)])[:, :2]
    which = np.concatenate([bodies, held])
    least, most = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    np.minimum.at(least, code, place + low[which])
    np.maximum.at(most, code, place + high[which])
    slides, lengths = _slides(parts, axes)
    at, way = d.qpos[axes.qpos[slides]], d.xaxis[m.body_jntadr[axes.body[slides]], :2]
    ends = np.array([-at, lengths - at])[:, :, None] * way
    least[holder[slides]] += ends.min(axis=0)
    most[holder[slides]] += ends.max(axis=0)
    return least - MARGIN, most + MARGIN


def boxes(m: mujoco.MjModel, d: mujoco.MjData, masks: ContactMasks) -> tuple[Array, Array]:
    """The corners of each body's box from its origin, seen from above (nbody, 2) [m]: of what can
    collide of it and its shells, as it is turned now."""
    turn, body = d.geom_xmat.reshape(-1, 3, 3), masks.trunk[m.geom_bodyid]
    middle = d.geom_xpos + (turn @ m.geom_aabb[:, :3, None])[:, :, 0] - d.xpos[body]
    half = (np.abs(turn) @ m.geom_aabb[:, 3:, None])[:, :, 0]
    low, high = np.full((m.nbody, 2), np.inf), np.full((m.nbody, 2), -np.inf)
    solid = (m.geom_contype | m.geom_conaffinity) != 0
    solid[np.concatenate([*masks.solid.values()])] = True
    np.minimum.at(low, body[solid], (middle - half)[solid, :2])
    np.maximum.at(high, body[solid], (middle + half)[solid, :2])
    return low, high
