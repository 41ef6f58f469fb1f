"""Parts that are joined for good become one rigid body: same mass, pose and momentum.

Newton's law does not see the exchange: linear and angular momentum of the bodies go over to the one
that takes their place, whose mass and inertia are theirs together. What is lost is their motion
against each other, which the welds that join them have brought to rest before.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate

import numpy as np

from factory.control.mode import Index
from factory.engine import mujoco
from factory.meshes import Array

SETTLING = 0.025
"""It takes that long at least [s]: nobody looks before."""

RIGID = 1e-6
"""Bodies have settled when none of their vertices is further than this from where it belongs beside
the others [m]."""


TURN = np.array(
    [  # ww wx wy wz  xw xx xy xz  yw yx yy yz  zw zx zy zz
        [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1],
        [0, 0, 0, -1, 0, 0, 1, 0, 0, 1, 0, 0, -1, 0, 0, 0],
        [0, 0, 1, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, 0],
        [0, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 0],
        [1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1],
        [0, -1, 0, 0, -1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 1, 0],
        [0, 0, -1, 0, 0, 0, 0, 1, -1, 0, 0, 0, 0, 1, 0, 0],
        [0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 1, 0],
        [1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1],
    ],
    float,
).T
"""The rotation matrix, row by row, of the quaternion (w, x, y, z), by the products of its
components."""


CURL = np.array(
    [  # xx xy xz  yx yy yz  zx zy zz
        [0, 0, 0, 0, 0, 1, 0, -1, 0],
        [0, 0, -1, 0, 0, 0, 1, 0, 0],
        [0, 1, 0, -1, 0, 0, 0, 0, 0],
    ],
    float,
).T
"""The cross product of two vectors, by the products of their components."""


@dataclass(frozen=True, slots=True, eq=False)
class Groups:
    """Bodies in groups: all `bodies` (n,), one group after another; where each group begins in
    `starts`; for each body (n,) its group in `owner`, and where that begins in `head`."""

    bodies: Index
    starts: Index
    owner: Index
    head: Index

    @classmethod
    def of(cls, groups: Sequence[Sequence[int]]) -> Groups:
        """From lists of bodies, none of them empty."""
        starts = [*accumulate(map(len, groups[:-1]), initial=0)]
        owner = [number for number, group in enumerate(groups) for _ in group]
        bodies = [body for group in groups for body in group]
        return cls(*map(np.array, (bodies, starts, owner, [starts[number] for number in owner])))

    def sum(self, values: Array) -> Array:
        """The sum of values (n, ...) over each group (groups, ...)."""
        return np.asarray(np.add.reduceat(values, self.starts))


class Fusion:
    """Of free bodies whose origins are their centres of mass.

    `places` (nbody, 3): where those are in the frame of the product; `radii` (nbody,): how far
    their vertices are from there [m].
    """

    def __init__(self, m: mujoco.MjModel, d: mujoco.MjData, places: Array, radii: Array) -> None:
        self.d, self._places, self._radii, self._mass = d, places, radii, m.body_mass
        self._pose = m.jnt_qposadr[m.body_jntadr][:, None] + np.arange(7)
        self._speed = m.jnt_dofadr[m.body_jntadr][:, None] + np.arange(6)
        axes = turns(m.body_iquat)
        back, least = axes.transpose(0, 2, 1), np.finfo(float).tiny
        self._inertia = (axes * m.body_inertia[:, None]) @ back
        self._yields = (axes / np.maximum(m.body_inertia, least)[:, None]) @ back

    def misfit(self, groups: Groups) -> Array:
        """How far at most any vertex of each group (groups,) is from its place beside the first
        body [m]. Bodies never turn but by what their welds yield."""
        bodies, head = groups.bodies, groups.head
        here, turn, places = self.d.xpos[bodies], self.d.xmat[bodies], self._places[bodies]
        back = turn[head].reshape(-1, 3, 3)
        apart = ((here - here[head])[:, None] @ back)[:, 0] - (places - places[head])
        tilt = turn - turn[head]
        far = np.sqrt((apart * apart).sum(axis=1))
        far += np.sqrt((tilt * tilt).sum(axis=1)) * self._radii[bodies]
        return np.asarray(np.maximum.reduceat(far, groups.starts))

    def fuse(self, groups: Groups, wholes: Index) -> None:
        """Put each of the bodies `wholes` (groups,) in the place of a group: pose, momentum and
        angular momentum are theirs. Its turn is that of the heaviest. Speeds of turning are in a
        body's own frame."""
        d, bodies, owner = self.d, groups.bodies, groups.owner
        mass, pose = self._mass[bodies], d.qpos[self._pose[bodies]]
        speed, turn = d.qvel[self._speed[bodies]], turns(pose[:, 3:])
        share = (mass / groups.sum(mass)[owner])[:, None]
        each = np.concatenate([pose[:, :3], speed[:, :3], d.xpos[bodies]], axis=1)
        common = groups.sum(share * each)
        apart = each - common[owner]
        moment = (apart[:, :3, None] * apart[:, None, 3:6]).reshape(-1, 9) @ CURL  # r x v
        own = turn @ (self._inertia[bodies] @ speed[:, 3:, None])
        spin = groups.sum(mass[:, None] * moment + own[:, :, 0])
        heaviest = np.lexsort((-mass, owner))[groups.starts]
        turned = turn[heaviest].transpose(0, 2, 1) @ spin[:, :, None]
        turning = (self._yields[wholes] @ turned)[:, :, 0]
        d.qpos[self._pose[wholes]] = np.concatenate([common[:, :3], pose[heaviest, 3:]], axis=1)
        d.qvel[self._speed[wholes]] = np.concatenate([common[:, 3:6], turning], axis=1)
        d.xpos[wholes] = common[:, 6:]
        d.xmat[wholes], d.xquat[wholes] = d.xmat[bodies[heaviest]], d.xquat[bodies[heaviest]]


def turns(quaternions: Array) -> Array:
    """Rotation matrices (n, 3, 3) of unit quaternions (n, 4)."""
    products = (quaternions[:, :, None] * quaternions[:, None]).reshape(-1, 16)
    return np.asarray((products @ TURN).reshape(-1, 3, 3))
