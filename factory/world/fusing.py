"""Parts that are joined for good become one rigid body: same mass, pose and momentum.

Newton's law does not see the exchange: linear and angular momentum of the bodies go over to the one
that takes their place, whose mass and inertia are theirs together. What is lost is their motion
against each other, which the welds that join them have brought to rest before.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot

import numpy as np

from factory.engine import mujoco
from factory.meshes import Array
from factory.world.memory import plain

SETTLING = 0.025
"""It takes that long at least [s]: nobody looks before."""

RIGID = 1e-6
"""Bodies have settled when none of their vertices is further than this from where it belongs beside
the others [m]."""

Vector = list[float]

Matrix = list[float]
"""Nine numbers, row by row."""


class Fusion:
    """Of free bodies whose origins are their centres of mass.

    `places` (nbody, 3): where those are in the frame of the product; `radii` (nbody,): how far
    their vertices are from there [m].
    """

    def __init__(self, m: mujoco.MjModel, d: mujoco.MjData, places: Array, radii: Array) -> None:
        self._places, self._radii = places.tolist(), radii.tolist()
        self._mass = m.body_mass.tolist()
        self._pose_of = m.jnt_qposadr[m.body_jntadr].tolist()
        self._speed_of = m.jnt_dofadr[m.body_jntadr].tolist()
        self._pose, self._speed = plain(d.qpos), plain(d.qvel)
        self._place, self._axes, self._turn = map(plain, (d.xpos, d.xmat, d.xquat))
        axes = turns(m.body_iquat)
        back, least = axes.transpose(0, 2, 1), np.finfo(float).tiny
        self._inertia = _flat((axes * m.body_inertia[:, None]) @ back)
        self._yields = _flat((axes / np.maximum(m.body_inertia, least)[:, None]) @ back)

    def misfit(self, bodies: Sequence[int]) -> float:
        """How far at most any vertex of some bodies is from its place beside the first [m]. Bodies
        never turn but by what their welds yield."""
        first = bodies[0]
        here, axes = self._at(self._place, 3 * first), self._at(self._axes, 9 * first, 9)
        worst = 0.0
        for body in bodies[1:]:
            away = _back(axes, _less(self._at(self._place, 3 * body), here))
            apart = _less(away, _less(self._places[body], self._places[first]))
            tilt = _less(self._at(self._axes, 9 * body, 9), axes)
            worst = max(worst, hypot(*apart) + hypot(*tilt) * self._radii[body])
        return worst

    def fuse(self, bodies: Sequence[int], whole: int) -> None:
        """Put the body `whole` in the place of others: pose, momentum and angular momentum are
        theirs. Its turn is that of the heaviest. Speeds of turning are in a body's own frame."""
        mass = [self._mass[body] for body in bodies]
        share = [m / sum(mass) for m in mass]
        poses = [self._at(self._pose, self._pose_of[body], 7) for body in bodies]
        speeds = [self._at(self._speed, self._speed_of[body], 6) for body in bodies]
        x, v = _mean(share, poses), _mean(share, speeds)
        spin: Vector = [0.0, 0.0, 0.0]
        for body, m, pose, speed in zip(bodies, mass, poses, speeds, strict=True):
            own = _times(turned(*pose[3:]), _times(self._inertia[body], speed[3:]))
            moment = _cross(_less(pose[:3], x), _less(speed[:3], v))
            spin = [s + m * r + o for s, r, o in zip(spin, moment, own, strict=True)]
        most = mass.index(max(mass))
        heaviest, turn = bodies[most], poses[most][3:]
        turning = _times(self._yields[whole], _back(turned(*turn), spin))
        self._put(self._pose, self._pose_of[whole], x + turn)
        self._put(self._speed, self._speed_of[whole], v + turning)
        places = [self._at(self._place, 3 * body) for body in bodies]
        self._put(self._place, 3 * whole, _mean(share, places))
        for values, size in ((self._axes, 9), (self._turn, 4)):
            self._put(values, size * whole, self._at(values, size * heaviest, size))

    @staticmethod
    def _at(values: memoryview[float], at: int, count: int = 3) -> Vector:
        found: Vector = [*values[at : at + count]]
        return found

    @staticmethod
    def _put(values: memoryview[float], at: int, numbers: Vector) -> None:
        for number in numbers:
            values[at] = number
            at += 1


def turns(quaternions: Array) -> Array:
    """Rotation matrices (n, 3, 3) of unit quaternions (n, 4)."""
    return np.array(turned(*quaternions.T)).T.reshape(-1, 3, 3)


def turned(w: float, x: float, y: float, z: float) -> Matrix:
    """The rotation matrix of a unit quaternion."""
    ww, xx, yy, zz = w * w, x * x, y * y, z * z
    wx, wy, wz, xy, xz, yz = w * x, w * y, w * z, x * y, x * z, y * z
    return [
        *(ww + xx - yy - zz, 2 * (xy - wz), 2 * (xz + wy)),
        *(2 * (xy + wz), ww - xx + yy - zz, 2 * (yz - wx)),
        *(2 * (xz - wy), 2 * (yz + wx), ww - xx - yy + zz),
    ]


def _flat(matrices: Array) -> list[Matrix]:
    found: list[Matrix] = matrices.reshape(-1, 9).tolist()
    return found


def _mean(share: Sequence[float], vectors: Sequence[Vector]) -> Vector:
    """The mean of vectors by their first three components, each with its share."""
    return [sum(s * v[k] for s, v in zip(share, vectors, strict=True)) for k in range(3)]


def _less(one: Vector, other: Vector) -> Vector:
    return [a - b for a, b in zip(one, other, strict=True)]


def _times(m: Matrix, v: Vector) -> Vector:
    x, y, z = v
    return [m[k] * x + m[k + 1] * y + m[k + 2] * z for k in (0, 3, 6)]


def _back(m: Matrix, v: Vector) -> Vector:
    """With the transpose."""
    x, y, z = v
    return [m[k] * x + m[k + 3] * y + m[k + 6] * z for k in range(3)]


def _cross(one: Vector, other: Vector) -> Vector:
    (a, b, c), (x, y, z) = one, other
    return [b * z - c * y, c * x - a * z, a * y - b * x]
