"""Parts that are joined for good become one rigid body: same mass, pose and momentum.

Newton's law does not see the exchange: linear and angular momentum of the bodies go over to the one
that takes their place, whose mass and inertia are theirs together. What is lost is their motion
against each other, which the welds that join them have brought to rest before.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from factory.engine import mujoco
from factory.meshes import Array

SETTLING = 0.025
"""It takes that long at least [s]: nobody looks before."""

RIGID = 1e-6
"""Bodies have settled when none of their vertices is further than this from where it belongs beside
the others [m]."""


def misfit(d: mujoco.MjData, bodies: Sequence[int], places: Array, radii: Array) -> float:
    """How far at most any vertex of some bodies is from its place beside the first [m].

    `places` (n, 3): their centres of mass in the frame of the product; `radii` (n,): how far their
    vertices are from those. Bodies never turn but by what their welds yield.
    """
    chosen = list(bodies)
    here, turn = d.xpos[chosen], d.xmat[chosen].reshape(-1, 3, 3)
    apart = (here - here[0]) @ turn[0] - (places - places[0])
    tilt = np.linalg.norm(turn - turn[0], axis=(1, 2))
    return float((np.linalg.norm(apart, axis=1) + tilt * radii).max())


def fuse(m: mujoco.MjModel, d: mujoco.MjData, bodies: Sequence[int], whole: int) -> None:
    """Put the body `whole` in the place of free bodies: pose, momentum and angular momentum are
    theirs. Its turn is that of the heaviest, and all origins are centres of mass; speeds of turning
    are in a body's own frame, inertia is in that of its principal axes."""
    chosen = list(bodies)
    joint = m.body_jntadr[chosen]
    q, v = m.jnt_qposadr[joint], m.jnt_dofadr[joint]
    mass = m.body_mass[chosen]
    share = mass / mass.sum()
    pose = d.qpos[q[:, None] + np.arange(7)]
    speed = d.qvel[v[:, None] + np.arange(6)]
    centre, common = share @ pose[:, :3], share @ speed[:, :3]
    moment = (mass[:, None] * (pose[:, :3] - centre)).T @ (speed[:, :3] - common)  # sum of m r vᵀ
    spin = np.array((moment - moment.T)[[1, 2, 0], [2, 0, 1]])
    for body, quaternion, turning in zip(chosen, pose[:, 3:], speed[:, 3:], strict=True):
        axes = _turn(m.body_iquat[body])
        spin += _turn(quaternion) @ (axes @ (m.body_inertia[body] * (turning @ axes)))
    heaviest = int(mass.argmax())
    at, dof = (int(a[m.body_jntadr[whole]]) for a in (m.jnt_qposadr, m.jnt_dofadr))
    d.qpos[at : at + 3], d.qpos[at + 3 : at + 7] = centre, pose[heaviest, 3:]
    axes = _turn(m.body_iquat[whole])
    local = spin @ _turn(pose[heaviest, 3:])
    d.qvel[dof : dof + 3] = common
    d.qvel[dof + 3 : dof + 6] = axes @ (local @ axes / m.body_inertia[whole])
    d.xpos[whole] = share @ d.xpos[chosen]
    d.xmat[whole], d.xquat[whole] = d.xmat[chosen[heaviest]], d.xquat[chosen[heaviest]]


def _turn(quaternion: Array) -> Array:
    matrix = np.empty(9)
    mujoco.mju_quat2Mat(matrix, quaternion)
    return matrix.reshape(3, 3)
