"""Axes that move several joints: their coordinate is the arc length of a curve in joint space."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from factory.engine.mjcf import names
from factory.floor.layout.chains import Chains, JointCurves
from factory.floor.layout.layout import Layout
from factory.support.arrays import Array, Index
from factory.support.engine import mujoco


@dataclass(frozen=True, slots=True, eq=False)
class Curves:
    """The b axes that move d joints each, along curves; all others move one joint.

    Attributes:
        axes: their numbers (b,).
        ways: all curves.
        chains: what a layout says of chains; None where axes follow one curve each.
        now: the curve that each axis follows now (b,), its row in `ways`.
        at: the coordinates that were measured last (b,) [m].
        row: the place of an axis in `axes`, -1 for none (axes,).
        qpos: addresses of the joints' positions in the engine's data (b, d).
        dof: addresses of their speeds (b, d).
        actuator: the drives of all joints but the first ones (b, d - 1).
        latest: the last coordinates and speeds, by the state that they belong to.
    """

    axes: Index
    ways: JointCurves
    chains: Chains | None
    now: Index
    at: Array
    row: Index
    qpos: Index
    dof: Index
    actuator: Index
    latest: dict[bytes, tuple[Array, Array]] = field(default_factory=dict, repr=False)

    @classmethod
    def of(cls, m: mujoco.MjModel, layout: Layout, count: int) -> Curves:
        """The curves of a layout with a given number of axes in its compiled model."""
        robots, ways = layout.curves
        moved = [names.moved_along(layout.factory.robots[robot]) for robot in robots]
        joints = [m.joint(joint).id for each in moved for joint, _ in each]
        drives = [m.actuator(drive).id for each in moved for _, drive in each[1:]]
        axes, row = np.array(robots, np.intp), np.full(count, -1)
        row[axes] = np.arange(len(axes))
        joint = np.array(joints, np.intp).reshape(-1, ways.dimension)
        qpos, dof = m.jnt_qposadr[joint], m.jnt_dofadr[joint]
        further = np.array(drives, np.intp).reshape(-1, ways.dimension - 1)
        now, at = np.arange(len(axes)), np.array([layout.guidepaths[r].length for r in robots])
        made = cls(axes, ways, layout.chains, now, at, row, qpos, dof, further)
        for robot in robots:
            made.take(robot, layout.factory.first(robot).index)
        return made

    def take(self, robot: int, operation: int) -> None:
        """Let a robot (index) follow its curve of an operation (index)."""
        if self.chains is not None and self.row[robot] >= 0:
            self.now[self.row[robot]] = self.chains.row(operation, robot)

    def apart(self) -> Curves:
        """A copy with its own state: the curves that are followed, and the coordinates on them."""
        return replace(self, now=self.now.copy(), at=self.at.copy(), latest={})

    def among(self, axes: Index) -> tuple[Index, Index]:
        """Which of some axes move several joints, and their rows."""
        row = self.row[axes]
        (which,) = (row >= 0).nonzero()
        return which, row[which]

    def further(self, rows: Index) -> Index:
        """The places of some rows in an array with one entry a joint but the first ones."""
        count = self.actuator.shape[1]
        return np.asarray((rows[:, None] * count + np.arange(count)).ravel())

    def spread(self, x: Array, along: Array) -> Array:
        """A quantity along axes (k, axes) at positions (axes,), resolved into the first joints,
        then all others (k, axes + b (d - 1))."""
        _, first, _ = self.ways.at(self.now, x[self.axes])
        every, joints = along[:, self.axes, None] * first, along.copy()
        joints[:, self.axes] = every[..., 0]
        return np.concatenate([joints, every[..., 1:].reshape(len(along), -1)], axis=1)

    def along(self, places: Array, speeds: Array) -> tuple[Array, Array]:
        """Coordinates and speeds (b,) of positions and velocities of joints (b, d)."""
        state = places.tobytes() + speeds.tobytes() + self.now.tobytes()
        if state not in self.latest:
            self.latest.clear()
            self.latest[state] = self.ways.along(self.now, places, speeds, self.at)
            self.at[:] = self.latest[state][0]
        return self.latest[state]
