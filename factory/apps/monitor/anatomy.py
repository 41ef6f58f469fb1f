"""Addresses in the engine's model of robots, copies of parts, welds and their frames, from the
names in the model and its kinematic tree."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from factory.api import MonitorSubject, WeldFrames, names
from factory.support.arrays import Array, Index

if TYPE_CHECKING:
    from factory.support.engine import mujoco

PARK, FEED, GRIP, HOLD = range(4)


KINDS = {"park": PARK, "feed": FEED, "grip": GRIP, "hold": HOLD}
"""What holds a part, by the first word of a weld's name: its parking place, its feeder, a robot,
the outfeed's tray."""

Holder = tuple[int, int]
"""Kind and, for a grip, the robot's index; -1 for others."""


@dataclass(frozen=True, eq=False, slots=True)
class BentWays:
    """The `robots` (b,) of a subject whose first axes move d joints, along bends or chains, and the
    addresses (b, d) of the positions, speeds and setpoints of these."""

    robots: Index
    subject: MonitorSubject
    slides: Index
    dofs: Index
    drives: Index

    @classmethod
    def of(cls, m: Any, subject: MonitorSubject) -> BentWays:
        """Those of a subject's robots in a model. Raises KeyError where it lacks them."""
        (robots, ways), factory = subject.bent, subject.factory
        shape = -1, ways.dimension
        moved = [pair for robot in robots for pair in names.moved_along(factory.robots[robot])]
        joints = np.array([m.joint(joint).id for joint, _ in moved], np.intp).reshape(shape)
        drives = np.array([m.actuator(drive).id for _, drive in moved], np.intp).reshape(shape)
        return cls(
            np.array(robots, np.intp),
            subject,
            np.asarray(m.jnt_qposadr[joints], np.intp),
            np.asarray(m.jnt_dofadr[joints], np.intp),
            np.asarray(m.actuator_ctrladr[drives], np.intp),
        )

    def along(self, qpos: Array, qvel: Array) -> tuple[Array, Array]:
        """Their arc lengths [m] and speeds [m/s]."""
        x, first = self.subject.bent[1].nearest(qpos[self.slides])
        return x, (qvel[self.dofs] * first).sum(axis=-1) / (first**2).sum(axis=-1)

    def apart(self, qpos: Array) -> Array:
        """How far robots (b,) are from their ways [m, rad]."""
        return self.subject.bent[1].apart(qpos[self.slides])

    def reached(self, ctrl: Array) -> Array:
        """The arc lengths [m] of their setpoints."""
        return self.subject.bent[1].nearest(ctrl[self.drives])[0]


@dataclass(frozen=True, eq=False)
class Anatomy:
    """Addresses in the engine's arrays.

    Robots (R,): `slide`, `dof` and `drive`, of their position, speed and setpoint. Actuators (A,):
    `joint`, `setpoint`, and `owner`, a robot's index or -1 for the outfeed. Copies of parts (C,):
    `copies`, their names, `label`, and `body` in qpos; `copy_of` (nbody,): the copy that a body is,
    or -1. Constraints (E,): `holder`, None for one that holds no part, `part`, its label, and
    `frames`, the place of the part. `bent`: the guidepaths with bends.
    """

    slide: Index = field(repr=False)
    dof: Index = field(repr=False)
    drive: Index = field(repr=False)
    joint: Index = field(repr=False)
    setpoint: Index = field(repr=False)
    owner: tuple[int, ...] = field(repr=False)
    copies: tuple[str, ...] = field(repr=False)
    label: tuple[str, ...] = field(repr=False)
    body: Index = field(repr=False)
    copy_of: Index = field(repr=False)
    holder: tuple[Holder | None, ...] = field(repr=False)
    part: tuple[str, ...] = field(repr=False)
    frames: WeldFrames = field(repr=False)
    bent: BentWays = field(repr=False)

    @classmethod
    def of(cls, m: Any, subject: MonitorSubject) -> Anatomy:
        """The anatomy of a model of a subject's factory. Raises ValueError where the model is not
        of that factory."""
        from factory.support.engine import mujoco

        factory = subject.factory
        robots = {r.name: r.index for r in factory.robots}
        try:
            slide = [m.joint(names.first_axis(r)).id for r in factory.robots]
            firsts = factory.axes[: len(factory.robots)]
            drive = [m.actuator(names.actuator(axis)).id for axis in firsts]
            ways = BentWays.of(m, subject)
        except KeyError as error:
            raise ValueError(f"the model is not of this factory: {error}") from error
        actuators = range(len(m.actuator_ctrladr))
        driven = np.array([m.actuator_trnid[a, 0] for a in actuators], np.intp)
        owners = (m.actuator(a).name.partition("/")[0] for a in actuators)
        bodies = [b for b in range(m.nbody) if names.kind(m.body(b).name) == "part"]
        copy_of = np.full(m.nbody, -1, np.intp)
        copy_of[bodies] = np.arange(len(bodies))
        called = [m.body(b).name for b in bodies]
        welds = [m.equality(e).name.split("/", 2) for e in range(m.neq)]
        check_holders(m, np.flatnonzero([words[0] in KINDS for words in welds]))
        d = mujoco.MjData(m)
        mujoco.mj_kinematics(m, d)
        return cls(
            np.asarray(m.jnt_qposadr[slide], np.intp),
            np.asarray(m.jnt_dofadr[slide], np.intp),
            np.asarray(m.actuator_ctrladr[drive], np.intp),
            np.asarray(m.jnt_qposadr[driven], np.intp),
            np.asarray(m.actuator_ctrladr, np.intp),
            tuple(robots.get(name, -1) for name in owners),
            tuple(name.partition("/")[2] for name in called),
            tuple(names.label_of(name) for name in called),
            np.asarray(m.jnt_qposadr[m.body_jntadr[bodies]], np.intp),
            copy_of,
            tuple(_holder(words, robots) for words in welds),
            tuple(_part(words) for words in welds),
            WeldFrames.of(m, d),
            ways,
        )


def _holder(words: list[str], robots: Mapping[str, int]) -> Holder | None:
    kind = KINDS.get(words[0])
    if kind != GRIP:
        return None if kind is None else (kind, -1)
    return (kind, robots[words[1]]) if words[1] in robots else None


def _part(words: list[str]) -> str:
    """The label in a weld's name: `grip/r3/part1`, `park/part1#2`, `feed/part1`."""
    label = words[-1] if words[0] == "grip" else "/".join(words[1:])
    return label.rpartition("#")[0] if words[0] == "park" else label


def check_holders(m: mujoco.MjModel, welds: Index) -> None:
    """Raises ValueError where the first body of a weld does more than slide, or turn about the
    vertical on what slides, and is not at the end of a longer chain of joints."""
    joints, up = m.body_jntnum, m.body_parentid
    first = np.minimum(m.body_jntadr, m.njnt - 1)
    last = m.jnt_type[np.minimum(m.body_jntadr + np.maximum(joints, 1), m.njnt) - 1]
    slide, hinge = (m.jnt_type[first] == kind for kind in (WeldFrames.SLIDE, WeldFrames.HINGE))
    slides = (joints == 0) | (joints <= 2) & slide & (last == WeldFrames.SLIDE)
    turns = (joints == 1) & hinge & (abs(m.jnt_axis[first, 2]) == 1.0)
    for body in np.unique(m.eq_obj1id[welds]):
        if WeldFrames.chain_of(m, int(body)):
            continue
        if not ((slides | turns)[body] and slides[up[body]] and m.body_weldid[up[up[body]]] == 0):
            raise ValueError(f"{m.body(int(body)).name} holds parts and does more than slide")
