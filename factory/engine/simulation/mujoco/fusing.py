"""Fusion: parts joined for good become one rigid body of the same mass, pose and momentum.

Linear and angular momentum are conserved: they are given to the new body, whose mass and inertia
are the sum of theirs. Only motion of the parts against each other is lost, which the welds have
damped before.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from factory.support.arrays import Array
from factory.support.engine import mujoco

SETTLING = 0.025
"""Bodies take at least that long to settle [s]."""

RIGID = 1e-6
"""Bodies have settled when none of their vertices is further than this from its place beside the
first [m]."""


class Fusion:
    """Fuses free bodies whose origins are their centres of mass. `places` (nbody, 3): their
    positions in the frame of the product; `radii` (nbody,): largest distance of a vertex from there
    [m]."""

    def __init__(self, m: mujoco.MjModel, d: mujoco.MjData, places: Array, radii: Array) -> None:
        self._d, self._mass, self._places, self._radii = d, m.body_mass.copy(), places, radii
        self._tree = m.body_treeid
        self._qpos = m.jnt_qposadr[m.body_jntadr][:, None] + np.arange(7)
        self._dof = m.jnt_dofadr[m.body_jntadr][:, None] + np.arange(6)
        axes = rotations(m.body_iquat)
        back, least = axes.transpose(0, 2, 1), np.finfo(float).tiny
        self._inertia = (axes * m.body_inertia[:, None]) @ back
        self._yields = (axes / np.maximum(m.body_inertia, least)[:, None]) @ back

    def misfits(self, groups: Sequence[Sequence[int]]) -> Array:
        """For groups of bodies (n,): largest displacement of a vertex relative to the group's first
        body [m]. Bodies turn only as far as their welds yield."""
        sizes = [len(group) for group in groups]
        first = np.repeat([group[0] for group in groups], sizes)
        bodies, d = np.concatenate(groups), self._d
        away = (d.xpos[bodies] - d.xpos[first])[:, None] @ d.xmat[first].reshape(-1, 3, 3)
        belongs = self._places[bodies] - self._places[first]
        shift, tilt = away[:, 0] - belongs, d.xmat[bodies] - d.xmat[first]
        apart = np.sqrt((shift * shift).sum(axis=1))
        apart += np.sqrt((tilt * tilt).sum(axis=1)) * self._radii[bodies]
        starts = np.cumsum(sizes, dtype=np.intp) - sizes
        return np.asarray(np.maximum.reduceat(apart, starts))

    def sleeps(self, bodies: Mapping[str, int]) -> bool:
        """Whether the bodies of a holder sleep: all do, or none."""
        return bool(self._d.tree_asleep[self._tree[next(iter(bodies.values()))]] >= 0)

    def turns(self, bodies: Sequence[int]) -> float:
        """Largest rotation of bodies against the first [rad]."""
        turn = self._d.xmat[np.array(bodies)].reshape(-1, 3, 3)
        return float(angles(turn[0].T @ turn).max())

    def fuse(self, bodies: Sequence[int], whole: int) -> None:
        """Replace bodies by the body `whole`, with their momentum and angular momentum, and the
        attitude of the heaviest. Angular velocities are in body frames."""
        d, chosen = self._d, np.array(bodies)
        mass = self._mass[chosen]
        share = mass / mass.sum()
        pose, speed = d.qpos[self._qpos[chosen]], d.qvel[self._dof[chosen]]
        x, v = share @ pose[:, :3], share @ speed[:, :3]
        turns = rotations(pose[:, 3:])
        spin = turns @ (self._inertia[chosen] @ speed[:, 3:, None])
        orbit = _cross(pose[:, :3] - x, speed[:, :3] - v)
        momentum = spin[:, :, 0].sum(axis=0) + mass @ orbit
        heaviest = int(mass.argmax())
        turning = self._yields[whole] @ (turns[heaviest].T @ momentum)
        d.qpos[self._qpos[whole]] = np.concatenate([x, pose[heaviest, 3:]])
        d.qvel[self._dof[whole]] = np.concatenate([v, turning])
        d.xpos[whole] = share @ d.xpos[chosen]
        d.xquat[whole], d.xmat[whole] = d.xquat[chosen[heaviest]], d.xmat[chosen[heaviest]]


def rotations(quaternions: Array) -> Array:
    """Rotation matrices (n, 3, 3) of quaternions (n, 4), which are unit ones but for rounding."""
    w, x, y, z = quaternions.T
    w, x, y, z = quaternions.T / np.sqrt(((x * x + y * y) + z * z) + w * w)
    rows = (
        (x * x - y * y - z * z + w * w, 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), -x * x + y * y - z * z + w * w, 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), -x * x - y * y + z * z + w * w),
    )
    return np.array(rows).transpose(2, 0, 1)


def angles(turns: Array) -> Array:
    """The angles (n,) of rotation matrices (n, 3, 3) [rad]; exact for small ones, from the sine."""
    axis = np.stack([turns[:, i, j] - turns[:, j, i] for i, j in ((2, 1), (0, 2), (1, 0))])
    cosine = (np.trace(turns, axis1=1, axis2=2) - 1) / 2
    return np.asarray(np.arctan2(np.linalg.norm(axis, axis=0) / 2, cosine))


def _cross(one: Array, other: Array) -> Array:
    """The cross products of vectors (n, 3); many times faster than NumPy's for few."""
    ahead, behind = [1, 2, 0], [2, 0, 1]
    return one[:, ahead] * other[:, behind] - one[:, behind] * other[:, ahead]
