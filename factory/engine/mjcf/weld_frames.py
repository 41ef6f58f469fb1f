"""The welds of a compiled model: the frames that they join, and how far these are apart.

A weld joins a part, at its origin, with a frame fixed to the part's holder. Holders slide: a
carriage along its guidepath, a lift on a carriage; and the tool of a fixed robot turns about the
vertical on a lift that slides. So the frame on a holder follows from the coordinates of at most two
joints, or three where guidepaths have bends, of which the holder's first may turn it. A holder at
the end of a longer chain of joints follows from a product of exponentials of their screws.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from factory.support.arrays import Array, Index, Truth

if TYPE_CHECKING:
    from factory.support.engine import mujoco


SLIDE, HINGE = 2, 3
"""The engine's numbers of the joints `mjJNT_SLIDE` and `mjJNT_HINGE`: logs are written and read
without the engine."""

SHALLOW = 3
"""The most joints that a holder on rails has."""

ROWS = 6
"""Rows of a weld among the engine's constraints: three of place, three of turn."""


@dataclass(frozen=True, eq=False)
class WeldFrames:
    """Where n welds hold the origins of their parts: at base + sum over k of way · qpos[along],
    turned by a quaternion. A holder that turns has turned its part by spin · qpos[along, 0]
    besides, about a vertical axis. A holder at the end of a chain moves with the joints `along`,
    from the base on, by their screws.

    Attributes:
        base: where parts are with all coordinates at 0 (n, 3) [m].
        along: addresses of the joints in qpos (n, k).
        way: by how much a unit of each moves the part (n, k, 3).
        turn: how parts are turned, quaternions (n, 4).
        spin: by how much a unit of the first joint turns a part (n,).
        arm: distance of the part from the axis of that, when it is 0 (n, 2) [m].
        deep: whether the holder is at the end of a chain (n,).
        screws: of the joints of chains (n, k, 8): anchor [m], axis, whether it turns, and the
            coordinate at which `base` and `turn` hold; (n, 0, 8) without such holders.
    """

    SLIDE: ClassVar[int] = SLIDE
    HINGE: ClassVar[int] = HINGE

    base: Array = field(repr=False)
    along: Index = field(repr=False)
    way: Array = field(repr=False)
    turn: Array = field(repr=False)
    spin: Array = field(repr=False)
    arm: Array = field(repr=False)
    deep: Truth = field(repr=False)
    screws: Array = field(repr=False)

    @classmethod
    def of(cls, m: mujoco.MjModel, d: mujoco.MjData) -> WeldFrames:
        """Those of all welds of a model, in order; `d` is in any configuration, and its kinematics
        are up to date."""
        along, way, anchor, spin = (array[m.eq_obj1id] for array in _joints(m, d))
        base = held_at(m, np.arange(m.neq), d.xpos, d.xmat)
        held = base.copy()
        base -= (way * d.qpos[along][:, :, None]).sum(axis=1)
        turn = _products(d.xquat[m.eq_obj1id], m.eq_data[:, 6:10])
        angle = spin * d.qpos[along[:, 0]]
        away = base[:, :2] - anchor[:, :2]
        arm = np.where(spin[:, None] != 0, _turned(away, -angle), 0.0)
        base[:, :2] += np.where(spin[:, None] != 0, arm - away, 0.0)
        frames = cls(
            base,
            along,
            way,
            _spun(turn, -angle),
            spin,
            arm,
            np.zeros(len(base), bool),
            np.zeros((len(base), 0, 8)),
        )
        return frames._chained(m, d, held, turn)

    def _chained(self, m: mujoco.MjModel, d: mujoco.MjData, held: Array, turn: Array) -> WeldFrames:
        """The same with the welds of holders at the end of longer chains, which are at `held`
        (n, 3), turned by `turn` (n, 4) now."""
        chains = {int(b): WeldFrames.chain_of(m, int(b)) for b in np.unique(m.eq_obj1id)}
        deep = np.array([bool(chains[int(b)]) for b in m.eq_obj1id], bool)
        if not deep.any():
            return self
        most = max(self.along.shape[1], *(len(chain) for chain in chains.values()))
        wider = most - self.along.shape[1]
        along = np.pad(self.along, ((0, 0), (0, wider)))
        way = np.pad(self.way, ((0, 0), (0, wider), (0, 0)))
        screws, spin = np.zeros((len(deep), most, 8)), np.where(deep, 0.0, self.spin)
        for weld in np.flatnonzero(deep).tolist():
            joints = chains[int(m.eq_obj1id[weld])]
            along[weld], way[weld] = 0, 0.0
            along[weld, : len(joints)] = m.jnt_qposadr[joints]
            turns = (m.jnt_type[joints] == HINGE)[:, None]
            at = d.qpos[m.jnt_qposadr[joints]][:, None]
            row = np.hstack([d.xanchor[joints], d.xaxis[joints], turns, at])
            screws[weld, : len(joints)] = row
        base = np.where(deep[:, None], held, self.base)
        stand = np.where(deep[:, None], turn, self.turn)
        return WeldFrames(base, along, way, stand, spin, self.arm, deep, screws)

    @staticmethod
    def joints_of(m: mujoco.MjModel, body: int) -> list[int]:
        """The joints that slide or turn a body, from the base on."""
        joints = list[int]()
        while body:
            first, count = int(m.body_jntadr[body]), int(m.body_jntnum[body])
            joints = [*range(first, first + count), *joints]
            body = int(m.body_parentid[body])
        return [j for j in joints if m.jnt_type[j] in (SLIDE, HINGE)]

    @staticmethod
    def chain_of(m: mujoco.MjModel, body: int) -> list[int]:
        """The joints of a holder at the end of a chain, from the base on; none of one that slides,
        on what slides, or turns about the vertical there."""
        joints = WeldFrames.joints_of(m, body)
        hinges = [j for j in joints if m.jnt_type[j] == HINGE]
        upright = all(j == joints[-1] and abs(m.jnt_axis[j, 2]) == 1.0 for j in hinges)
        few = len(joints) <= SHALLOW and len({*m.jnt_bodyid[joints].tolist()}) <= 2
        return [] if few and upright else joints

    def chosen(self, welds: Index) -> WeldFrames:
        """Those of some welds, in that order."""
        return WeldFrames(*(getattr(self, array.name)[welds] for array in fields(self)))

    def at(self, slides: Array) -> Array:
        """Where they are (n, 3) [m] at coordinates of their joints (n, k), which are
        qpos[`along`]."""
        places = np.asarray(self.base + np.einsum("nk,nkj->nj", slides, self.way))
        if self.spin.any():
            places[:, :2] += _turned(self.arm, self.spin * slides[:, 0]) - self.arm
        if self.deep.any():
            places[self.deep] = self._moved(slides)[0]
        return places

    def turned(self, slides: Array) -> Array:
        """How they are turned (n, 4), quaternions, at coordinates of their joints (n, k)."""
        turn = _spun(self.turn, self.spin * slides[:, 0]) if self.spin.any() else self.turn
        if self.deep.any():
            turn = turn.copy()
            turn[self.deep] = self._moved(slides)[1]
        return turn

    def _moved(self, slides: Array) -> tuple[Array, Array]:
        """Where those of deep chains are (n, 3) [m], and how they are turned (n, 4), at coordinates
        of the joints of all (n, k)."""
        place, turn = self.base[self.deep].copy(), self.turn[self.deep]
        screws, off = self.screws[self.deep], slides[self.deep] - self.screws[self.deep, :, 7]
        for joint in reversed(range(screws.shape[1])):
            anchor, axis, turns = screws[:, joint, :3], screws[:, joint, 3:6], screws[:, joint, 6]
            angle = (off[:, joint] * turns)[:, None]
            gone = (off[:, joint] * (1.0 - turns))[:, None] * axis
            arm = place - anchor
            along = (arm * axis).sum(axis=1, keepdims=True) * axis
            place = anchor + gone + along * (1 - np.cos(angle))
            place += arm * np.cos(angle) + np.cross(axis, arm) * np.sin(angle)
            about = np.hstack([np.cos(angle / 2), np.sin(angle / 2) * axis])
            turn = _products(about, turn)
        return place, turn


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
