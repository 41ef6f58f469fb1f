"""The slides of a factory in the engine: where the state of each axis is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from factory.control.mode import Array, Index
from factory.mjcf import names
from factory.plant.factory import Factory
from factory.support.engine import mujoco


@dataclass(frozen=True, slots=True, eq=False)
class Axes:
    """The slides of robots and of the outfeed: carriages in order, then lifts, then the outfeed's
    tray and the shutter of its shed.

    Each (axes,): `qpos`, `dof`, `body`, `tree`, `actuator`: addresses in the engine's model.
    `lift`: the axis of a robot's lift, by the robot (index).
    """

    qpos: Index
    dof: Index
    body: Index
    tree: Index
    actuator: Index
    lift: Mapping[int, int]

    @classmethod
    def of(cls, m: mujoco.MjModel, factory: Factory) -> Axes:
        """The axes of a factory in its compiled model."""
        carriages = [robot.name for robot in factory.robots]
        lifts = [carriages[robot] for robot in factory.strokes]
        slides = [*map(names.slide, carriages), *map(names.lift, lifts)]
        drives = [*map(names.drive, carriages), *map(names.hoist, lifts)]
        slides += names.OUTFEED_SLIDE, names.SHUTTER
        drives += names.OUTFEED_DRIVE, names.SHUTTER
        joint = np.array([m.joint(name).id for name in slides])
        body = m.jnt_bodyid[joint]
        actuator = np.array([m.actuator(name).id for name in drives])
        lift = {robot: len(carriages) + n for n, robot in enumerate(factory.strokes)}
        address, dof = m.jnt_qposadr[joint], m.jnt_dofadr[joint]
        return cls(address, dof, body, m.body_treeid[body], actuator, lift)

    def __len__(self) -> int:
        return len(self.qpos)

    @property
    def tray(self) -> int:
        """The axis of the outfeed's tray; that of the shutter is the next, and the last."""
        return len(self.qpos) - 2

    def of_robot(self, robot: int) -> list[int]:
        """The axes of a robot (index): its carriage, and its lift if it has one."""
        return [robot, self.lift[robot]] if robot in self.lift else [robot]

    def measured(self, d: mujoco.MjData) -> tuple[Array, Array]:
        """Positions [m] and speeds [m/s] of all carriages and lifts."""
        return d.qpos[self.qpos[: self.tray]], d.qvel[self.dof[: self.tray]]
