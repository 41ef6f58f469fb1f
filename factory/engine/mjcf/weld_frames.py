"""The welds of a compiled model: the frames that they join, and how far these are apart.

A weld joins a part, at its origin, with a frame fixed to the part's holder. Holders slide: a
carriage along its guidepath, a lift on a carriage; and the tool of a fixed robot turns about the
vertical on a lift that slides. So the frame on a holder follows from the coordinates of at most two
joints, or three where guidepaths have bends, of which the holder's first may turn it.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING

import numpy as np

from factory.support.arrays import Array, Index

if TYPE_CHECKING:
    from factory.support.engine import mujoco


SLIDE, HINGE = 2, 3
"""The engine's numbers of the joints `mjJNT_SLIDE` and `mjJNT_HINGE`: logs are written and read
without the engine."""

ROWS = 6
"""Rows of a weld among the engine's constraints: three of place, three of turn."""


@dataclass(frozen=True, eq=False)
class WeldFrames:
    """Where n welds hold the origins of their parts: at `base` (n, 3) + sum over k of
    `way` (n, k, 3) · qpos[`along` (n, k)] [m], turned by the quaternion `turn` (n, 4). A holder
    that turns has turned its part by `spin` (n,) · qpos[`along` (n, 0)] besides, about a vertical
    axis that is `arm` (n, 2) away from there when that is 0 [m]."""

    base: Array = field(repr=False)
    along: Index = field(repr=False)
    way: Array = field(repr=False)
    turn: Array = field(repr=False)
    spin: Array = field(repr=False)
    arm: Array = field(repr=False)

    @classmethod
    def of(cls, m: mujoco.MjModel, d: mujoco.MjData) -> WeldFrames:
        """Those of all welds of a model, in order; `d` is in any configuration, and its kinematics
        are up to date."""
        along, way, anchor, spin = (array[m.eq_obj1id] for array in _joints(m, d))
        base = held_at(m, np.arange(m.neq), d.xpos, d.xmat)
        base -= (way * d.qpos[along][:, :, None]).sum(axis=1)
        turn = _products(d.xquat[m.eq_obj1id], m.eq_data[:, 6:10])
        angle = spin * d.qpos[along[:, 0]]
        away = base[:, :2] - anchor[:, :2]
        arm = np.where(spin[:, None] != 0, _turned(away, -angle), 0.0)
        base[:, :2] += np.where(spin[:, None] != 0, arm - away, 0.0)
        return cls(base, along, way, _spun(turn, -angle), spin, arm)

    def chosen(self, welds: Index) -> WeldFrames:
        """Those of some welds, in that order."""
        return WeldFrames(*(getattr(self, array.name)[welds] for array in fields(self)))

    def at(self, slides: Array) -> Array:
        """Where they are (n, 3) [m] at coordinates of their joints (n, k), which are
        qpos[`along`]."""
        places = np.asarray(self.base + np.einsum("nk,nkj->nj", slides, self.way))
        if self.spin.any():
            places[:, :2] += _turned(self.arm, self.spin * slides[:, 0]) - self.arm
        return places

    def turned(self, slides: Array) -> Array:
        """How they are turned (n, 4), quaternions, at coordinates of their joints (n, 2)."""
        return _spun(self.turn, self.spin * slides[:, 0]) if self.spin.any() else self.turn


def _joints(m: mujoco.MjModel, d: mujoco.MjData) -> tuple[Index, Array, Array, Array]:
    """The joints that carry each body (nbody, k), its own before those of its parent, of a model
    whose kinematics in `d` are up to date: their addresses in qpos, and the direction (nbody, k, 3)
    of one that slides, 0 for none. A body has one slide, or two where it follows a guidepath with
    bends: k is 2 or 4. Where the axis of its own that turns it about the vertical stands (nbody,
    3), and how far by each unit of its coordinate (nbody): 1 or -1, 0 for none."""
    most = 1 + int((m.body_jntnum > 1).any())
    joints = m.body_jntadr[:, None] + np.arange(most)
    joints[np.arange(most) >= m.body_jntnum[:, None]] = -1
    turns = (joints[:, 0] >= 0) & (m.jnt_type[joints[:, 0]] == HINGE)
    joints[(m.jnt_type[joints] != SLIDE) & (m.jnt_type[joints] != HINGE)] = -1
    joint = np.concatenate([joints, joints[m.body_parentid]], axis=1)
    slides = (joint >= 0) & (m.jnt_type[joint] == SLIDE)
    way = np.where(slides[:, :, None], d.xaxis[joint], 0.0)
    spin = np.where(turns, d.xaxis[joints[:, 0]][:, 2].round(), 0.0)
    return m.jnt_qposadr[joint], way, d.xanchor[joints[:, 0]], spin


def held_at(m: mujoco.MjModel, welds: Index, xpos: Array, xmat: Array) -> Array:
    """Where welds hold the origins of their parts (n, 3) [m], with bodies at `xpos` (nbody, 3),
    `xmat` (nbody, 9)."""
    holder = m.eq_obj1id[welds]
    reach = xmat[holder].reshape(-1, 3, 3) @ m.eq_data[welds, 3:6, None]
    return np.asarray(xpos[holder] + reach[:, :, 0])


def gaps(m: mujoco.MjModel, welds: Index, xpos: Array, xmat: Array) -> Array:
    """Distances (n,) [m] between the frames that welds join, with bodies at `xpos`, `xmat`."""
    apart = xpos[m.eq_obj2id[welds]] - held_at(m, welds, xpos, xmat)
    return np.asarray(np.linalg.norm(apart, axis=1))


def residuals(d: mujoco.MjData) -> Array:
    """How far apart (k, 3) [m] the frames of each active, awake weld were in the engine's last
    step."""
    return np.asarray(d.efc_pos[: d.ne].reshape(-1, ROWS)[:, :3])


def _turned(points: Array, angle: Array) -> Array:
    """Points of the plane (n, 2), turned about 0 by angles (n,)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * points[:, 0] - s * points[:, 1], s * points[:, 0] + c * points[:, 1]], 1)


def _spun(turn: Array, angle: Array) -> Array:
    """Quaternions (n, 4), turned further about the vertical by angles (n,)."""
    zero = np.zeros(len(angle))
    return _products(np.stack([np.cos(angle / 2), zero, zero, np.sin(angle / 2)], axis=1), turn)


def _products(p: Array, q: Array) -> Array:
    """The products of quaternions (n, 4), w first."""
    scalar = p[:, :1] * q[:, :1] - (p[:, 1:] * q[:, 1:]).sum(axis=1, keepdims=True)
    vector = p[:, :1] * q[:, 1:] + q[:, :1] * p[:, 1:] + np.cross(p[:, 1:], q[:, 1:])
    return np.hstack([scalar, vector])
