"""The welds of a compiled model: the frames that they join, and how far these are apart.

A weld joins a part, at its origin, with a frame fixed to the part's holder. Holders do nothing but
slide: a carriage along its guidepath, a lift on a carriage. So the frame on a holder follows from
the coordinates of at most two slide joints, or three where guidepaths have bends, and never
turns.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from factory.control.mode import Array, Index

if TYPE_CHECKING:
    from factory.support.engine import mujoco

PARK, FEED, GRIP, HOLD = range(4)
KINDS = {"park": PARK, "feed": FEED, "grip": GRIP, "hold": HOLD}
"""What holds a part, by the first word of a weld's name: its parking place, its feeder, a robot,
the outfeed's tray."""

SLIDE = 2
"""The engine's number of the slide joint, `mjJNT_SLIDE`: logs are written and read without the
engine."""

ROWS = 6
"""Rows of a weld among the engine's constraints: three of place, three of turn."""


@dataclass(frozen=True, eq=False)
class Slides:
    """The slide joints that carry each body (nbody, k), its own before those of its parent:
    addresses `qpos` and `dof` of each, and its direction `way` (nbody, k, 3), 0 for none. A body
    has one slide, or two where it follows a guidepath with bends: k is 2 or 4."""

    qpos: Index = field(repr=False)
    dof: Index = field(repr=False)
    way: Array = field(repr=False)

    @classmethod
    def of(cls, m: mujoco.MjModel, d: mujoco.MjData) -> Slides:
        """Those of a model, whose kinematics in `d` are up to date."""
        most = 1 + int((m.body_jntnum > 1).any())
        own = m.body_jntadr[:, None] + np.arange(most)
        own[np.arange(most) >= m.body_jntnum[:, None]] = -1
        own[m.jnt_type[own] != SLIDE] = -1
        joint = np.concatenate([own, own[m.body_parentid]], axis=1)
        way = np.where(joint[:, :, None] < 0, 0.0, d.xaxis[joint])
        return cls(m.jnt_qposadr[joint], m.jnt_dofadr[joint], way)

    def velocity(self, bodies: Index, qvel: Array) -> Array:
        """Velocities of bodies that only slide (..., n, 3) [m/s] from all speeds (..., nv)."""
        return np.asarray(
            np.einsum("...nk,nkj->...nj", qvel[..., self.dof[bodies]], self.way[bodies])
        )


@dataclass(frozen=True, eq=False)
class WeldFrames:
    """Where n welds hold the origins of their parts: at `base` (n, 3) + sum over k of
    `way` (n, k, 3) · qpos[`along` (n, k)] [m], turned by the quaternion `turn` (n, 4)."""

    base: Array = field(repr=False)
    along: Index = field(repr=False)
    way: Array = field(repr=False)
    turn: Array = field(repr=False)

    @classmethod
    def of(cls, m: mujoco.MjModel, d: mujoco.MjData) -> WeldFrames:
        """Those of all welds of a model, in order; `d` is in any configuration, and its kinematics
        are up to date."""
        slides, holder = Slides.of(m, d), m.eq_obj1id
        along, way = slides.qpos[holder], slides.way[holder]
        base = held_at(m, np.arange(m.neq), d.xpos, d.xmat)
        base -= (way * d.qpos[along][:, :, None]).sum(axis=1)
        return cls(base, along, way, _products(d.xquat[holder], m.eq_data[:, 6:10]))

    def chosen(self, welds: Index) -> WeldFrames:
        """Those of some welds, in that order."""
        return WeldFrames(self.base[welds], self.along[welds], self.way[welds], self.turn[welds])

    def at(self, slides: Array) -> Array:
        """Where they are (n, 3) [m] at coordinates of their slides (n, k), which are
        qpos[`along`]."""
        return np.asarray(self.base + np.einsum("nk,nkj->nj", slides, self.way))


def check_holders(m: mujoco.MjModel, welds: Index) -> None:
    """Raises ValueError where the first body of a weld does more than slide."""
    joints, up = m.body_jntnum, m.body_parentid
    first = m.jnt_type[np.minimum(m.body_jntadr, m.njnt - 1)]
    last = m.jnt_type[np.minimum(m.body_jntadr + np.maximum(joints, 1), m.njnt) - 1]
    slides = (joints == 0) | (joints <= 2) & (first == SLIDE) & (last == SLIDE)
    for body in np.unique(m.eq_obj1id[welds]):
        if not (slides[body] and slides[up[body]] and m.body_weldid[up[up[body]]] == 0):
            raise ValueError(f"{m.body(int(body)).name} holds parts and does more than slide")


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


def soften(m: mujoco.MjModel, factor: float) -> None:
    """Multiply the time constants of all welds by a factor."""
    m.eq_solref[:, 0] *= factor


def _products(p: Array, q: Array) -> Array:
    """The products of quaternions (n, 4), w first."""
    scalar = p[:, :1] * q[:, :1] - (p[:, 1:] * q[:, 1:]).sum(axis=1, keepdims=True)
    vector = p[:, :1] * q[:, 1:] + q[:, :1] * p[:, 1:] + np.cross(p[:, 1:], q[:, 1:])
    return np.hstack([scalar, vector])
