"""Which holders can meet at all, and what the engine's broad phase looks at for that.

The engine boxes every body that can collide in every step. Most of a factory rests, far from what
moves. While a holder (a robot, a feeder, the tray) follows a course, it sweeps one box with all
that it ever holds, seen from above; one that stands has the box of where it is. Those whose boxes
are apart do not meet before the next course. So the broad phase looks at what is awake and its
neighbours. No pair that could touch is left out: a run is the same to the last bit. Where anything
touches, is pushed or leaves its way, everything is looked at for a while.
"""

from __future__ import annotations

import numpy as np

from factory.engine.mjcf.masks import NOBODY
from factory.engine.mjcf.weld_frames import held_at
from factory.engine.simulation.mujoco.axes import Axes
from factory.engine.simulation.mujoco.contacts import ContactMasks
from factory.engine.simulation.mujoco.parts import Parts
from factory.support.arrays import Array, Index, Truth
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

MANY = 200_000
"""Where more pairs of a holder that moves and any other are to be compared all bodies are looked
at, for the same reason."""


class Extents:
    """The slides along which holders go: of carriages, of the outfeed's tray, and the second ones
    of robots on bends; `axes` (n,): of which. `low` and `high` (n,): the ends of the way that each
    goes until it is told another [m]; `along` (n, 2): where that leads, seen from above."""

    def __init__(self, m: mujoco.MjModel, d: mujoco.MjData, axes: Axes, robots: int) -> None:
        bent, first = axes.curves, np.array([*range(robots), axes.tray])
        self._every, self._number = axes, np.full(len(axes), -1)
        self._number[first] = np.arange(len(first))
        self._second = len(first) + np.arange(len(bent.axes))
        self.axes = np.concatenate([first, bent.axes])
        self._address = np.concatenate([axes.qpos[first], bent.qpos[:, 1]])
        dofs = np.concatenate([axes.dof[first], bent.dof[:, 1]])
        self.along = d.xaxis[m.dof_jntid[dofs], :2].copy()
        self.stand(d)

    def stand(self, d: mujoco.MjData) -> None:
        """All stand where they are."""
        self.low, self.high = d.qpos[self._address], d.qpos[self._address]

    def go(self, axes: Index, x: Array) -> None:
        """Some axes of a factory go from where they are by positions (ticks, n) [m]."""
        number, bent = self._number[axes], self._every.curves
        which, rows = bent.among(axes)
        if len(rows):
            place, _, _ = bent.ways.at(bent.now[rows], x[:, which])
            x = np.concatenate([x, place[..., 1]], axis=1)
            x[:, which] = place[..., 0]
            number = np.concatenate([number, self._second[rows]])
        if (number < 0).any():
            number, x = number[number >= 0], x[:, number >= 0]
        self.low[number] = np.minimum(self.low[number], x.min(axis=0))
        self.high[number] = np.maximum(self.high[number], x.max(axis=0))

    def left(self, d: mujoco.MjData) -> bool:
        """Whether any is off its way."""
        x = d.qpos[self._address]
        return bool(((x < self.low - ASTRAY) | (x > self.high + ASTRAY)).any())


class Neighbours:
    """The holders of a model's parts, by their codes, where the run begins; `culls`: some may be
    left out."""

    def __init__(self, m: mujoco.MjModel, d: mujoco.MjData, parts: Parts, axes: Axes) -> None:
        shutter = parts.tray + len(parts.feeders.welds) + 1
        self._d, self._masks, self._holder = d, parts.masks, _holders(parts, axes, shutter)
        trees = (
            dict(zip(axes.tree.tolist(), self._holder.tolist(), strict=True)) | parts.feeders.trees
        )
        count = parts.masks.own(trees, shutter) + 1
        self.culls, self._calm = count > FEW, -np.inf
        self._active: Index | None = None
        self._seen, self._moved = np.ones(count, bool), False
        if self.culls:
            mujoco.mj_kinematics(m, d)
            self._ways = Extents(m, d, axes, len(parts.model.factory.robots))
            turns = axes.rotary
            self._box = _boxes(m, d, parts, count)
            _turned(*self._box, self._holder[turns], d.xanchor[m.dof_jntid[axes.dof[turns]], :2])
            self._began = self._ways.low
            self._bodies = _of_trees(m, parts.masks.code)

    def turn(self, active: Index) -> None:
        """These axes move from now on, all others stand; what is awake may move, too."""
        if self.culls:
            self._ways.stand(self._d)
            self._active, self._moved = active, True

    def follow(self, axes: Index, x: Array) -> None:
        """Axes go by positions (ticks, n) [m] from now on."""
        if self.culls:
            self._ways.go(axes, x)
            self._moved = True

    @property
    def complete(self) -> bool:
        """Whether everything is looked at."""
        return bool(self._seen.all())

    def astray(self) -> bool:
        """Whether a holder is off its way, and something is left out that it may meet there."""
        return not self.complete and self._ways.left(self._d)

    def look(self) -> None:
        """Look at what moves, at what has been given something, and at all that these can meet
        until they are told another way."""
        fresh = {*self._masks.fresh} - {NOBODY}
        self._masks.fresh.clear()
        if self._active is None or not (self._moved or fresh) or self._d.time < self._calm:
            return
        moves = np.zeros_like(self._seen)
        moves[self._masks.code[self._bodies[self._d.tree_asleep < 0]]] = True
        moves[self._holder[self._active]] = True
        moves[[*fresh]] = True
        moves[NOBODY] = self._moved = False
        (moving,) = moves.nonzero()
        if len(moving) * len(moves) > MANY:
            self._seen = np.ones_like(moves)
        else:
            self._seen = _met(moving, *self.boxes())
        self._masks.look(self._seen)

    def boxes(self) -> tuple[Array, Array]:
        """The corners (2, holders) of the box that each holder sweeps until it is told another way,
        with all that it ever holds [m]."""
        ways, robots = self._ways, self._holder[self._ways.axes]
        low, high = (corners.copy() for corners in self._box)
        ends = np.stack([ways.low, ways.high]) - self._began
        swept = ends[:, None] * ways.along.T
        np.add.at(low.T, robots, swept.min(axis=0).T)
        np.add.at(high.T, robots, swept.max(axis=0).T)
        return low, high

    def everything(self) -> None:
        """Look at everything for a while."""
        self._calm, self._moved = self._d.time + CALM, True
        if not self.complete:
            self._seen[:] = True
            self._masks.look(self._seen)


def _holders(parts: Parts, axes: Axes, shutter: int) -> Index:
    """The code of the holder that each axis (axes,) is of; the shutter holds nothing."""
    robots = (axis.robot.index + 1 for axis in parts.model.factory.axes)
    return np.array([*robots, parts.tray, shutter])


def _of_trees(m: mujoco.MjModel, code: Index) -> Index:
    """For each kinematic tree a body that tells its holder."""
    body_of = np.zeros(m.ntree, np.intp)
    for bodies in (np.arange(m.nbody), np.flatnonzero(code != NOBODY)):
        moving = bodies[m.body_treeid[bodies] >= 0]
        body_of[m.body_treeid[moving]] = moving
    return body_of


def _met(holders: Index, low: Array, high: Array) -> Truth:
    """Which boxes (n,), with these corners (2, n) [m], come near those of some holders; each is
    near itself, empty ones too."""
    near = low[0, holders, None] <= high[0]
    near &= high[0, holders, None] >= low[0]
    near &= low[1, holders, None] <= high[1]
    near &= high[1, holders, None] >= low[1]
    met = near.any(axis=0)
    met[holders] = True
    return np.asarray(met)


def _boxes(m: mujoco.MjModel, d: mujoco.MjData, parts: Parts, count: int) -> tuple[Array, Array]:
    """The corners (2, count) [m] of the box of each holder where it is now, with all that it ever
    holds."""
    masks = parts.masks
    low, high = boxes(m, d, masks)
    bodies = np.flatnonzero(masks.code != NOBODY)
    welds, codes = np.array([*parts.holdings.welds()]).T
    held = m.eq_obj2id[welds]
    code = np.concatenate([masks.code[bodies], codes])
    place = np.concatenate([d.xpos[bodies], held_at(m, welds, d.xpos, d.xmat)])[:, :2]
    which = np.concatenate([bodies, held])
    least, most = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    np.minimum.at(least, code, place + low[which])
    np.maximum.at(most, code, place + high[which])
    return least.T - MARGIN, most.T + MARGIN


def _turned(low: Array, high: Array, holders: Index, middle: Array) -> None:
    """Widen the boxes with these corners (2, count) [m] of holders that turn about vertical axes at
    `middle` (n, 2), to what they fill in any turn."""
    reach = np.maximum(high[:, holders] - middle.T, middle.T - low[:, holders])
    radius = np.hypot(*reach)
    low[:, holders], high[:, holders] = middle.T - radius, middle.T + radius


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
