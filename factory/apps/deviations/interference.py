"""How disturbances act in the engine: forces, masses, drives, friction, measurements.

Masses, friction and limits are written into the model at once. Pushes, measurement errors and weak
drives act before every timestep. A drive's force is kp (reference - measured) + ...; a measurement
error e enters the engine's own feedback as the constant -kp e - kv e', which is added to its
bias.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from factory.api import MujocoWorld
from factory.support.arrays import Array, Index
from factory.support.engine import mujoco

Measure = Callable[[Array, Array], tuple[Array, Array]]
"""True positions [m] and speeds [m/s] of the axes -> measured ones; called once a timestep."""

HARD = 0.9999
"""Impedance of dry friction: at the engine's default of 0.9 a robot creeps under forces far below
it, and nothing ever sticks."""


LEAST_LEVER = 0.05
"""A force that is nearer to a hinge than this has no great moment [m]."""


class Interference:
    """Disturbs a world. Axes are carriages and lifts, by number; the outfeed is left alone."""

    def __init__(self, world: MujocoWorld) -> None:
        self._world, self._m, self._d = world, world.m, world.d
        self._axes = axes = world.motion.axes
        self._robots = slice(axes.tray)
        self._dof = np.concatenate([axes.dof[self._robots], axes.curves.dof[:, 1]])
        self._actuator = np.concatenate([axes.actuator[self._robots], axes.curves.actuator[:, 0]])
        self._gain = np.ones(len(self._actuator))
        self._measures: list[Measure] = []
        self._measured: tuple[Array, Array] | None = None
        self._hooked, self._bias = False, world.arrays["actuator_biasprm"]

    def weigh(self, bodies: Iterable[int], factor: float) -> None:
        """Bodies weigh `factor` times as much."""
        heavier = [*bodies]
        self._world.inspection.soundness.look()
        self._world.inspection.soundness.weigh(heavier, factor)
        for body in heavier:
            self._m.body_mass[body] *= factor
            self._m.body_inertia[body] *= factor
        mujoco.mj_setConst(self._m, mujoco.MjData(self._m))
        self._world.arrays.accept()
        self._world.parts.joining.weigh(self._m, self._d)

    def rub(self, axes: Index, newtons: float) -> None:
        """Set the dry friction of empty axes; the share of the load stays as it is."""
        self._world.motion.guides.rub(axes, newtons)
        self._world.arrays["dof_solimp"][self._dof[self._slides(axes)], :2] = HARD

    def drag(self, axes: Index, speed: Array) -> None:
        """Give axes the damping at which their drives' greatest force sustains a `speed` [m/s]."""
        force, second = self._m.actuator_forcerange[self._actuator[axes], 1], self._second(axes)
        damping = force / speed
        dofs = self._dof[self._slides(axes)]
        self._world.arrays["dof_damping"][dofs] = [*damping, *damping[second]]

    def weaken(self, axes: Index, factor: float) -> None:
        """Scale the forces of drives by `factor`."""
        slides = self._slides(axes)
        drives = self._actuator[slides]
        self._gain[slides] *= factor
        force = self._world.arrays["actuator_forcerange"]
        self._bias[drives, 1:3] = factor * self._bias.now[drives, 1:3]
        force[drives] = factor * force.now[drives]
        if factor != 1.0:
            self._hook()

    def mismeasure(self, measure: Measure) -> None:
        """Set the function by which drives and supervisor measure positions and speeds."""
        self._measures.append(measure)
        self._hook()
        self._measure()

    def push(self, body: int, force: Array | None) -> None:
        """Push a body with a force (3,) [N] from now on, or stop pushing."""
        self._d.xfrc_applied[body, :3] = 0.0 if force is None else force
        self._world.motion.sleep.wake([body])

    def off(self, axis: int) -> float:
        """Deviation of an axis from its setpoint [m]."""
        setpoint = self._d.ctrl.reshape(-1, MujocoWorld.INPUTS)[self._actuator[axis], 0]
        return float(self._d.qpos[self._axes.qpos[axis]] - setpoint)

    def greatest_force(self, axis: int) -> float:
        """Greatest force of an axis's drive [N], or its moment where that is a hinge [N m]."""
        return float(self._m.actuator_forcerange[self._actuator[axis], 1])

    def thrust(self, axis: int, body: int) -> tuple[Array, float]:
        """The force on a body (3,) [N], across a hinge, with the greatest moment that the hinge's
        drive has, and how far from the hinge that is [m]."""
        d, joint = self._d, int(self._m.dof_jntid[self._dof[axis]])
        about, off = d.xaxis[joint], d.xipos[body] - d.xanchor[joint]
        across = np.cross(about, off)
        lever = max(float(np.linalg.norm(across)), LEAST_LEVER)
        return across / lever**2 * self.greatest_force(axis), lever

    def _hook(self) -> None:
        if not self._hooked:
            self._hooked = True
            self._world.hooks.before_step.append(self._act)
            self._world.hooks.sensors.insert(0, lambda x, v: self._measured or (x, v))

    def _act(self) -> None:
        """Act before a timestep."""
        self._measure()
        bias = np.zeros(len(self._gain))
        for axis in np.flatnonzero(self._gain != 1.0).tolist():
            bias[axis] = (self._gain[axis] - 1.0) * self._setpoint(axis)[2]
        if self._measured is not None:
            x, speed = self._axes.measured(self._d)
            wrong = np.stack([self._measured[0] - x, self._measured[1] - speed])
            kp, kv = self._m.actuator_biasprm[self._actuator, 1:3].T
            off, slip = self._axes.curves.spread(x, wrong)
            bias += kp * off + kv * slip
            self._world.motion.sleep.wake(self._world.motion.axes.body[self._robots].tolist())
        self._bias[self._actuator, 0] = bias

    def _setpoint(self, axis: int) -> Array:
        """What a drive reads in this step: position [m], speed [m/s], force [N]."""
        m, d, read = self._m, self._d, np.zeros((MujocoWorld.INPUTS, 1))
        return np.asarray(mujoco.mj_readCtrl(m, d, self._actuator[axis], d.time, read, -1))

    def _measure(self) -> None:
        if self._measures:
            q, v = (values.copy() for values in self._axes.measured(self._d))
            for measure in self._measures:
                q, v = measure(q, v)
            self._measured = q, v

    def _second(self, axes: Index) -> Index:
        """Which of some axes have a second slide."""
        return self._axes.curves.among(np.asarray(axes))[0]

    def _slides(self, axes: Index) -> Index:
        """The slides of axes: their own, and then the second ones."""
        rows = self._axes.curves.among(np.asarray(axes))[1]
        return np.concatenate([np.asarray(axes), self._axes.tray + rows])
