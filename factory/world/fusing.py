"""Parts that are joined for good become one rigid body: same mass, pose and momentum.

Newton's law does not see the exchange: linear and angular momentum of the bodies go over to the one
that takes their place, whose mass and inertia are theirs together. What is lost is their motion
against each other, which the welds that join them have brought to rest before.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

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


@dataclass(frozen=True, slots=True, eq=False)
class Groups:
    """Bodies in groups: all `bodies` (n,) one group after another, the number of each group's first
    in `starts`, and of each body's group in `owner` (n,)."""

    bodies: Index
    starts: Index
    owner: Index

    @classmethod
    def of(cls, groups: Sequence[Sequence[int]]) -> Groups:
        """From lists of bodies, none of them empty."""
        sizes = np.array([len(group) for group in groups], np.intp)
        bodies = np.array([body for group in groups for body in group], np.intp)
        return cls(bodies, np.cumsum(sizes) - sizes, np.repeat(np.arange(len(sizes)), sizes))

    def sum(self, values: Array) -> Array:
        """The sum of values (n, ...) over each group (groups, ...)."""
        return np.asarray(np.add.reduceat(values, self.starts))

    def first(self, values: Array) -> Array:
        """For each body (n, ...) the value that the first of its group has."""
        return np.asarray(values[self.starts][self.owner])


def misfit(d: mujoco.MjData, groups: Groups, places: Array, radii: Array) -> Array:
    """How far at most any vertex of each group (groups,) is from its place beside the first
    body [m].

    `places` (n, 3): their centres of mass in the frame of the product; `radii` (n,): how far their
    vertices are from those. Bodies never turn but by what their welds yield.
    """
    here, turn = d.xpos[groups.bodies], d.xmat[groups.bodies].reshape(-1, 3, 3)
    against, straight = groups.first(turn), places - groups.first(places)
    apart = ((here - groups.first(here))[:, None] @ against)[:, 0] - straight
    tilt = (turn - against).reshape(-1, 9)
    far = np.sqrt((apart * apart).sum(axis=1)) + np.sqrt((tilt * tilt).sum(axis=1)) * radii
    return np.asarray(np.maximum.reduceat(far, groups.starts))


def fuse(m: mujoco.MjModel, d: mujoco.MjData, groups: Groups, wholes: Index) -> None:
    """Put each of the bodies `wholes` (groups,) in the place of a group of free bodies: pose,
    momentum and angular momentum are theirs. Its turn is that of the heaviest, and all origins are
    centres of mass; speeds of turning are in a body's own frame, inertia is in that of its
    principal axes."""
    bodies, owner = groups.bodies, groups.owner
    joint = m.body_jntadr[bodies]
    q, v = m.jnt_qposadr[joint], m.jnt_dofadr[joint]
    mass = m.body_mass[bodies]
    share = (mass / groups.sum(mass)[owner])[:, None]
    pose = d.qpos[q[:, None] + np.arange(7)]
    speed = d.qvel[v[:, None] + np.arange(6)]
    count = len(bodies)
    principal = turns(m.body_iquat[np.concatenate([bodies, wholes])])
    turn, axes = turns(pose[:, 3:]), principal[:count]
    centre, common = groups.sum(share * pose[:, :3]), groups.sum(share * speed[:, :3])
    arm, drift = mass[:, None] * (pose[:, :3] - centre[owner]), speed[:, :3] - common[owner]
    moment = groups.sum(arm[:, :, None] * drift[:, None])  # m r vᵀ
    spin = (moment - moment.transpose(0, 2, 1))[:, [1, 2, 0], [2, 0, 1]]
    own = _times(axes, m.body_inertia[bodies] * _times(axes.transpose(0, 2, 1), speed[:, 3:]))
    spin += groups.sum(_times(turn, own))
    heaviest = np.lexsort((-mass, owner))[groups.starts]
    joint = m.body_jntadr[wholes]
    q, v = m.jnt_qposadr[joint][:, None], m.jnt_dofadr[joint][:, None]
    d.qpos[q + np.arange(3)], d.qpos[q + np.arange(3, 7)] = centre, pose[heaviest, 3:]
    axes = principal[count:]
    back = axes.transpose(0, 2, 1) @ turn[heaviest].transpose(0, 2, 1)
    d.qvel[v + np.arange(3)] = common
    d.qvel[v + np.arange(3, 6)] = _times(axes, _times(back, spin) / m.body_inertia[wholes])
    d.xpos[wholes] = groups.sum(share * d.xpos[bodies])
    d.xmat[wholes], d.xquat[wholes] = d.xmat[bodies[heaviest]], d.xquat[bodies[heaviest]]


def turns(quaternions: Array) -> Array:
    """Rotation matrices (n, 3, 3) of unit quaternions (n, 4)."""
    products = (quaternions[:, :, None] * quaternions[:, None]).reshape(-1, 16)
    return np.asarray((products @ TURN).reshape(-1, 3, 3))


def _times(matrices: Array, vectors: Array) -> Array:
    """Each matrix (n, 3, 3) times its vector (n, 3)."""
    return np.asarray((matrices @ vectors[:, :, None])[:, :, 0])
