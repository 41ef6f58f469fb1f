"""Parts that are joined for good become one rigid body: same mass, pose and momentum.

Newton's law does not see the exchange: linear and angular momentum of the bodies go over to the one
that takes their place, whose mass and inertia are theirs together. What is lost is their motion
against each other, which the welds that join them have brought to rest before.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import dist
from typing import Any

import numpy as np

from factory.geometry.meshes import Array
from factory.simulation.mujoco.fast.memory import AXES, BYTES, PLACE, TURN, reader, writer
from factory.support.engine import mujoco

SETTLING = 0.025
"""It takes that long at least [s]: nobody looks before."""

RIGID = 1e-6
"""Bodies have settled when none of their vertices is further than this from where it belongs beside
the others [m]."""

Vector = tuple[float, ...]

Matrix = Sequence[float]
"""Nine numbers, row by row."""


class Fusion:
    """Of free bodies whose origins are their centres of mass.

    `places` (nbody, 3): where those are in the frame of the product; `radii` (nbody,): how far
    their vertices are from there [m].
    """

    def __init__(self, m: mujoco.MjModel, d: mujoco.MjData, places: Array, radii: Array) -> None:
        self._places, self._radii = places.tolist(), radii.tolist()
        self._mass = m.body_mass.tolist()
        self._pose_of = (BYTES * m.jnt_qposadr[m.body_jntadr]).tolist()
        self._speed_of = (BYTES * m.jnt_dofadr[m.body_jntadr]).tolist()
        self._pose, self._set_pose = reader(d.qpos, 7), writer(d.qpos, 7)
        self._speed, self._set_speed = reader(d.qvel, 6), writer(d.qvel, 6)
        self._place, self._set_place = reader(d.xpos, 3), writer(d.xpos, 3)
        self._turn, self._set_turn = reader(d.xquat, 4), writer(d.xquat, 4)
        self._axes, self._set_axes = reader(d.xmat, 9), writer(d.xmat, 9)
        axes = turns(m.body_iquat)
        back, least = axes.transpose(0, 2, 1), np.finfo(float).tiny
        self._inertia = _flat((axes * m.body_inertia[:, None]) @ back)
        self._yields = _flat((axes / np.maximum(m.body_inertia, least)[:, None]) @ back)

    def misfit(self, bodies: Sequence[int]) -> float:
        """How far at most any vertex of some bodies is from its place beside the first [m]. Bodies
        never turn but by what their welds yield."""
        first, worst = bodies[0], 0.0
        here, axes, belongs = (
            self._place(PLACE * first),
            self._axes(AXES * first),
            self._places[first],
        )
        for body in bodies[1:]:
            away = _back(axes, _less(self._place(PLACE * body), here))
            apart = dist(away, _less(self._places[body], belongs))
            tilt = dist(axes, self._axes(AXES * body))
            worst = max(worst, apart + tilt * self._radii[body])
        return worst

    def fuse(self, bodies: Sequence[int], whole: int) -> None:
        """Put the body `whole` in the place of others: pose, momentum and angular momentum are
        theirs. Its turn is that of the heaviest. Speeds of turning are in a body's own frame."""
        mass = [self._mass[body] for body in bodies]
        total = sum(mass)
        share = [m / total for m in mass]
        poses = [self._pose(self._pose_of[body]) for body in bodies]
        speeds = [self._speed(self._speed_of[body]) for body in bodies]
        x, v = _mean(share, poses), _mean(share, speeds)
        a = b = c = 0.0
        for body, m, pose, speed in zip(bodies, mass, poses, speeds, strict=True):
            i, j, k = _times(turned(*pose[3:]), _times(self._inertia[body], speed[3:]))
            p, q, r = _cross(_less(pose, x), _less(speed, v))
            a, b, c = a + m * p + i, b + m * q + j, c + m * r + k
        most = mass.index(max(mass))
        heaviest, turn = bodies[most], poses[most][3:]
        turning = _times(self._yields[whole], _back(turned(*turn), (a, b, c)))
        self._set_pose(self._pose_of[whole], *x, *turn)
        self._set_speed(self._speed_of[whole], *v, *turning)
        places = [self._place(PLACE * body) for body in bodies]
        self._set_place(PLACE * whole, *_mean(share, places))
        self._set_turn(TURN * whole, *self._turn(TURN * heaviest))
        self._set_axes(AXES * whole, *self._axes(AXES * heaviest))


def turns(quaternions: Array) -> Array:
    """Rotation matrices (n, 3, 3) of unit quaternions (n, 4)."""
    return np.array(turned(*quaternions.T)).T.reshape(-1, 3, 3)


def turned(w: Any, x: Any, y: Any, z: Any) -> list[Any]:
    """The rotation matrix of a unit quaternion, or those of many, number by number."""
    ww, xx, yy, zz = w * w, x * x, y * y, z * z
    wx, wy, wz, xy, xz, yz = w * x, w * y, w * z, x * y, x * z, y * z
    return [
        *(ww + xx - yy - zz, 2 * (xy - wz), 2 * (xz + wy)),
        *(2 * (xy + wz), ww - xx + yy - zz, 2 * (yz - wx)),
        *(2 * (xz - wy), 2 * (yz + wx), ww - xx - yy + zz),
    ]


def _flat(matrices: Array) -> Sequence[Matrix]:
    found: Sequence[Matrix] = matrices.reshape(-1, 9).tolist()
    return found


def _mean(share: Sequence[float], vectors: Sequence[Vector]) -> Vector:
    """The mean of vectors by their first three components, each with its share."""
    x = y = z = 0.0
    for s, v in zip(share, vectors, strict=True):
        x, y, z = x + s * v[0], y + s * v[1], z + s * v[2]
    return x, y, z


def _less(one: Sequence[float], other: Sequence[float]) -> Vector:
    """By their first three components."""
    return one[0] - other[0], one[1] - other[1], one[2] - other[2]


def _times(m: Matrix, v: Vector) -> Vector:
    (a, b, c, d, e, f, g, h, i), (x, y, z) = m, v
    return a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z


def _back(m: Matrix, v: Vector) -> Vector:
    """With the transpose."""
    (a, b, c, d, e, f, g, h, i), (x, y, z) = m, v
    return a * x + d * y + g * z, b * x + e * y + h * z, c * x + f * y + i * z


def _cross(one: Vector, other: Vector) -> Vector:
    (a, b, c), (x, y, z) = one, other
    return b * z - c * y, c * x - a * z, a * y - b * x
