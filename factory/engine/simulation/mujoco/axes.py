"""The axes of a factory in the engine: addresses of their state, and what loads add to them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from factory.engine.mjcf import names
from factory.engine.mjcf.driving import inertia_of
from factory.engine.simulation.mujoco.curves import Curves
from factory.floor.layout.layout import Layout
from factory.support.arrays import Array, Index, Truth
from factory.support.engine import mujoco


@dataclass(frozen=True, slots=True, eq=False)
class Axes:
    """The axes that follow modes, and those of the outfeed: those of the factory in order, then the
    tray's and the shutter's.

    Attributes:
        qpos: addresses of positions in the engine's data (axes,).
        dof: addresses of speeds (axes,).
        body: the bodies that they move (axes,).
        tree: their kinematic trees (axes,).
        actuator: their drives (axes,).
        of_robot: the axes of each robot (index), its first one first.
        curves: those that move several joints.
        inertia: what a load of 1 kg adds to what an axis moves (axes,): 1 kg, or a moment of
            inertia [kg m²].
        rotary: whether the position is an angle about the vertical [rad] (axes,).
        rolls: whether a load adds to the friction (axes,).
        hanging: mass that a drive bears without payload, 0 where a guide bears it (axes,) [kg].
    """

    qpos: Index
    dof: Index
    body: Index
    tree: Index
    actuator: Index
    of_robot: tuple[tuple[int, ...], ...]
    curves: Curves
    inertia: Array
    rotary: Truth
    rolls: Truth
    hanging: Array

    @classmethod
    def of(cls, m: mujoco.MjModel, layout: Layout) -> Axes:
        """The axes of a layout in its compiled model."""
        factory = layout.factory
        joints = *map(names.joint, factory.axes), names.OUTFEED_SLIDE, names.SHUTTER
        drives = *map(names.actuator, factory.axes), names.OUTFEED_DRIVE, names.SHUTTER
        joint = np.array([m.joint(name).id for name in joints])
        body, stations = m.jnt_bodyid[joint], len(joints) - len(factory.axes)
        motions = [axis.motion for axis in factory.axes]
        masses = [axis.joint.mass * axis.motion.hangs for axis in factory.axes]
        return cls(
            m.jnt_qposadr[joint],
            m.jnt_dofadr[joint],
            body,
            m.body_treeid[body],
            np.array([m.actuator(name).id for name in drives]),
            tuple(tuple(factory.axes_of(robot.index)) for robot in factory.robots),
            Curves.of(m, layout, len(joints)),
            np.array([*(inertia_of(layout, a) for a in factory.axes), *[1.0] * stations]),
            np.array([*(motion.rotary for motion in motions), *[False] * stations]),
            np.array([*(motion.rolls for motion in motions), *[True] * stations]),
            np.array([*masses, *[0.0] * stations]),
        )

    def __len__(self) -> int:
        return len(self.qpos)

    @property
    def tray(self) -> int:
        """The axis of the outfeed's tray; the shutter's is the next and last one."""
        return len(self.qpos) - 2

    def measured(self, d: mujoco.MjData) -> tuple[Array, Array]:
        """Positions [m; rad] and speeds of all axes of robots."""
        x, v = d.qpos[self.qpos[: self.tray]], d.qvel[self.dof[: self.tray]]
        curves = self.curves
        if len(curves.axes):
            x[curves.axes], v[curves.axes] = curves.along(d.qpos[curves.qpos], d.qvel[curves.dof])
        return x, v

    def put(self, d: mujoco.MjData, axes: Index, x: Array) -> None:
        """Place axes at positions [m], at rest."""
        self.configure(d.qpos, axes, x)
        d.qvel[self.dof[axes]] = 0.0
        d.qvel[self.curves.dof[self.curves.among(axes)[1]]] = 0.0

    def configure(self, qpos: Array, axes: Index, x: Array) -> None:
        """Place axes at positions [m] in a configuration (nq,)."""
        qpos[self.qpos[axes]] = x
        which, rows = self.curves.among(axes)
        if len(rows):
            curves = self.curves
            qpos[curves.qpos[rows]] = curves.ways.at(curves.now[rows], x[which])[0]
            curves.at[rows] = x[which]

    def apart(self) -> Axes:
        """A copy for other data of the engine, which follows curves of its own."""
        return replace(self, curves=self.curves.apart())

    def off(self, d: mujoco.MjData, x: Array) -> Array:
        """Distance of all axes (axes,) from positions [m]."""
        off, curves = np.abs(d.qpos[self.qpos] - x), self.curves
        if len(curves.axes):
            place, _, _ = curves.ways.at(curves.now, x[curves.axes])
            off[curves.axes] = np.linalg.norm(d.qpos[curves.qpos] - place, axis=-1)
        return np.asarray(off)
