"""The axes of a factory in the engine: addresses of their state."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from factory.engine.mjcf import names
from factory.engine.mjcf.tools import gyration
from factory.floor.layout.layout import Layout
from factory.floor.layout.way import Ways
from factory.support.arrays import Array, Index, Truth
from factory.support.engine import mujoco
from factory.theory.problem.robot_bodies import LIFT_JOINT


@dataclass(frozen=True, slots=True, eq=False)
class Across:
    """The second slides of b robots whose guidepaths have bends.

    Attributes:
        axes: their carriages (b,).
        ways: the curves of their guidepaths.
        row: the index of an axis in `axes`, -1 for none (axes,).
        qpos: addresses of the slides' positions in the engine's data (b, 2).
        dof: addresses of their speeds (b, 2).
        actuator: the drives of the second slides (b,).
        latest: the last arc lengths and speeds, by the state that they belong to.
    """

    axes: Index
    ways: Ways
    row: Index
    qpos: Index
    dof: Index
    actuator: Index
    latest: dict[bytes, tuple[Array, Array]] = field(default_factory=dict, repr=False)

    @classmethod
    def of(cls, m: mujoco.MjModel, layout: Layout, count: int) -> Across:
        """The second slides of a layout with a given number of axes in its compiled model."""
        robots, ways = layout.bent
        called = [layout.factory.robots[robot].name for robot in robots]
        pairs = [
            [m.joint(slide(n)).id for slide in (names.slide, names.slide_across)] for n in called
        ]
        joint = np.array(pairs, np.intp).reshape(-1, 2)
        drives = [m.actuator(names.drive_across(name)).id for name in called]
        axes, row = np.array(robots, np.intp), np.full(count, -1)
        row[axes] = np.arange(len(axes))
        address, dof = m.jnt_qposadr[joint], m.jnt_dofadr[joint]
        return cls(axes, ways, row, address, dof, np.array(drives, np.intp))

    def among(self, axes: Index) -> tuple[Index, Index]:
        """Which of some axes have a second slide, and their indices."""
        row = self.row[axes]
        (which,) = (row >= 0).nonzero()
        return which, row[which]

    def spread(self, x: Array, along: Array) -> Array:
        """A quantity along axes (k, axes) at positions (axes,) [m], resolved into first and second
        slides (k, axes + b)."""
        _, first, _ = self.ways.at(np.arange(len(self.axes)), x[self.axes])
        both, slides = along[:, self.axes, None] * first, along.copy()
        slides[:, self.axes] = both[..., 0]
        return np.concatenate([slides, both[..., 1]], axis=1)

    def along(self, places: Array, speeds: Array) -> tuple[Array, Array]:
        """Arc lengths [m] and speeds [m/s] (b,) of positions and velocities (b, 2)."""
        state = places.tobytes() + speeds.tobytes()
        if state not in self.latest:
            x, first = self.ways.nearest(places)
            self.latest.clear()
            self.latest[state] = x, (speeds * first).sum(axis=-1) / (first**2).sum(axis=-1)
        return self.latest[state]


@dataclass(frozen=True, slots=True, eq=False)
class Axes:
    """The slides of robots and of the outfeed: carriages in order, then lifts, then the outfeed's
    tray and the shutter of its shed.

    Attributes:
        qpos: addresses of positions in the engine's data (axes,).
        dof: addresses of speeds (axes,).
        body: the bodies that they move (axes,).
        tree: their kinematic trees (axes,).
        actuator: their drives (axes,).
        lift: by robot (index), the axis of its lift.
        across: the second slides of robots whose guidepaths have bends.
        inertia: what a load of 1 kg adds to what an axis moves (axes,): 1 kg, or the moment of
            inertia [kg m²] for one that turns about the vertical, whose position is an angle
            [rad].
        heads: mass that lifts bear without payload, 0 for other axes (axes,) [kg].
    """

    qpos: Index
    dof: Index
    body: Index
    tree: Index
    actuator: Index
    lift: Mapping[int, int]
    across: Across
    inertia: Array
    heads: Array

    @classmethod
    def of(cls, m: mujoco.MjModel, layout: Layout) -> Axes:
        """The axes of a layout in its compiled model."""
        factory = layout.factory
        carriages = [robot.name for robot in factory.robots]
        lifts = [carriages[robot] for robot in factory.strokes]
        slides = [*map(names.first_axis, factory.robots), *map(names.lift, lifts)]
        drives = [*map(names.drive, carriages), *map(names.hoist, lifts)]
        slides += names.OUTFEED_SLIDE, names.SHUTTER
        drives += names.OUTFEED_DRIVE, names.SHUTTER
        joint = np.array([m.joint(name).id for name in slides])
        body = m.jnt_bodyid[joint]
        actuator = np.array([m.actuator(name).id for name in drives])
        lift = {robot: len(carriages) + n for n, robot in enumerate(factory.strokes)}
        address, dof = m.jnt_qposadr[joint], m.jnt_dofadr[joint]
        across, inertia = Across.of(m, layout, len(slides)), np.ones(len(joint))
        for robot in factory.robots:
            if robot.fixed:
                inertia[robot.index] = gyration(layout, robot.index) ** 2
        heads = np.zeros(len(joint))
        for number, axis in lift.items():
            heads[axis] = factory.robots[number].body.axis(LIFT_JOINT).mass
        return cls(address, dof, body, m.body_treeid[body], actuator, lift, across, inertia, heads)

    @property
    def is_rotary(self) -> Truth:
        """Whether each axis is a rotation about the vertical (axes,)."""
        return np.asarray(self.inertia != 1.0)

    def __len__(self) -> int:
        return len(self.qpos)

    @property
    def tray(self) -> int:
        """The axis of the outfeed's tray; the shutter's is the next and last one."""
        return len(self.qpos) - 2

    def of_robot(self, robot: int) -> list[int]:
        """The axes of a robot (index): its carriage, and its lift if it has one."""
        return [robot, self.lift[robot]] if robot in self.lift else [robot]

    def measured(self, d: mujoco.MjData) -> tuple[Array, Array]:
        """Positions [m] and speeds [m/s] of all carriages and lifts."""
        x, v = d.qpos[self.qpos[: self.tray]], d.qvel[self.dof[: self.tray]]
        bent = self.across
        if len(bent.axes):
            x[bent.axes], v[bent.axes] = bent.along(d.qpos[bent.qpos], d.qvel[bent.dof])
        return x, v

    def put(self, d: mujoco.MjData, axes: Index, x: Array) -> None:
        """Place axes at positions [m], at rest."""
        self.configure(d.qpos, axes, x)
        d.qvel[self.dof[axes]] = 0.0
        d.qvel[self.across.dof[self.across.among(axes)[1]]] = 0.0

    def configure(self, qpos: Array, axes: Index, x: Array) -> None:
        """Place axes at positions [m] in a configuration (nq,)."""
        qpos[self.qpos[axes]] = x
        which, rows = self.across.among(axes)
        if len(rows):
            place, _, _ = self.across.ways.at(rows, x[which])
            qpos[self.across.qpos[rows]] = place

    def off(self, d: mujoco.MjData, x: Array) -> Array:
        """Distance of all axes (axes,) from positions [m]."""
        off = np.abs(d.qpos[self.qpos] - x)
        bent = self.across
        if len(bent.axes):
            place, _, _ = bent.ways.at(np.arange(len(bent.axes)), x[bent.axes])
            off[bent.axes] = np.linalg.norm(d.qpos[bent.qpos] - place, axis=-1)
        return np.asarray(off)
