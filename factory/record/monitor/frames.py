"""Where welds keep the parts that they hold, from the kinematic tree: holders do nothing but
slide."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from factory.record.monitor.observation import Array, Index

SLIDE = 2
"""The engine's number for a slide joint."""

SLIDES = 2
"""A holder has no more slide joints: a carriage, and a lift on it."""


@dataclass(frozen=True, eq=False)
class Frames:
    """Where n constraints keep their parts: at `base` (n, 3) + sum over k of `way` (n, 2, 3) ·
    qpos[`along` (n, 2)] [m], turned by `turn` (n, 4), a quaternion."""

    base: Array = field(repr=False)
    along: Index = field(repr=False)
    way: Array = field(repr=False)
    turn: Array = field(repr=False)

    def of(self, chosen: Index) -> Frames:
        """Those of some of the constraints, in that order."""
        return Frames(self.base[chosen], self.along[chosen], self.way[chosen], self.turn[chosen])

    def keep(self, qpos: Array) -> Array:
        """Where they keep their parts now (n, 3) [m]."""
        return np.asarray(self.base + np.einsum("nk,nkj->nj", qpos[self.along], self.way))


def frames_of(m: Any, chosen: Sequence[bool]) -> Frames:
    """The frames of the `chosen` constraints of an engine's model; nothing for others. Raises
    ValueError where a holder does more than slide."""
    count = len(chosen)
    base, way, turn = np.zeros((count, 3)), np.zeros((count, SLIDES, 3)), np.zeros((count, 4))
    along = np.zeros((count, SLIDES), np.intp)
    rests: dict[int, tuple[Array, Array, Array, list[tuple[int, Array]]]] = {}
    for e in np.flatnonzero(chosen).tolist():
        holder = int(m.eq_obj1id[e])
        if holder not in rests:
            rests[holder] = _rest(m, holder)
        origin, quaternion, matrix, slides = rests[holder]
        base[e] = origin + matrix @ m.eq_data[e, 3:6]
        turn[e] = _product(quaternion, m.eq_data[e, 6:10])
        for k, (address, direction) in enumerate(slides):
            along[e, k], way[e, k] = address, direction
    return Frames(base, along, way, turn)


def _rest(m: Any, body: int) -> tuple[Array, Array, Array, list[tuple[int, Array]]]:
    """Where a body is when the coordinates of the slides under it are 0, its orientation, which
    never changes, and those slides: address and direction of each."""
    chain = []
    while body:
        chain.append(body)
        body = int(m.body_parentid[body])
    at, turn = np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])
    slides: list[tuple[int, Array]] = []
    for b in reversed(chain):
        at = at + _matrix(turn) @ m.body_pos[b]
        turn = _product(turn, m.body_quat[b])
        for j in range(int(m.body_jntadr[b]), int(m.body_jntadr[b] + m.body_jntnum[b])):
            if m.jnt_type[j] != SLIDE or len(slides) == SLIDES:
                raise ValueError(f"{m.body(b).name} holds parts and does more than slide")
            address, direction = int(m.jnt_qposadr[j]), _matrix(turn) @ m.jnt_axis[j]
            at = at - direction * m.qpos0[address]
            slides.append((address, direction))
    return at, turn, _matrix(turn), slides


def _product(p: Array, q: Array) -> Array:
    """The product of two quaternions (w, x, y, z)."""
    w = p[0] * q[0] - p[1:] @ q[1:]
    return np.asarray([w, *(p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:]))])


def _matrix(q: Array) -> Array:
    """The rotation matrix of a unit quaternion."""
    w, x, y, z = q / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
