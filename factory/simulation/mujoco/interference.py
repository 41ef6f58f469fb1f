"""What disturbances do to the engine: forces, masses, drives, friction, measurements.

Masses, friction and limits are written into the model at once. Pushes, measurements and weak drives
act before every timestep. A drive's force is kp (reference - measured) + ...; a measurement that is
off by e enters the engine's own feedback as the constant -kp e - kv e', which is added to its bias.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from factory.control.mode import Array, Index
from factory.simulation.mujoco.drives import INPUTS
from factory.simulation.mujoco.world import MujocoWorld
from factory.support.engine import mujoco

Measure = Callable[[Array, Array], tuple[Array, Array]]
"""True positions [m] and speeds [m/s] of the axes -> measured ones; called once a timestep."""

HARD = 0.9999
"""Impedance of dry friction: at the engine's default of 0.9 a robot creeps under forces far below
it, and nothing ever sticks."""


class Interference:
    """Acts on a world. Axes are carriages and lifts, by number; the outfeed is left alone."""

    def __init__(self, world: MujocoWorld) -> None:
        self._world, self._m, self._d = world, world.m, world.d
        axes = world.motion.axes
        self._robots = slice(axes.tray)
        self._qpos, self._dof = axes.qpos[self._robots], axes.dof[self._robots]
        self._actuator = axes.actuator[self._robots]
        self._gain = np.ones(len(self._actuator))
        self._measures: list[Measure] = []
        self._measured: tuple[Array, Array] | None = None
        self._hooked = False

    def weigh(self, bodies: Iterable[int], factor: float) -> None:
        """Bodies weigh `factor` times as much."""
        heavier = [*bodies]
        self._world.inspection.soundness.weigh(heavier, factor)
        for body in heavier:
            self._m.body_mass[body] *= factor
            self._m.body_inertia[body] *= factor
        mujoco.mj_setConst(self._m, mujoco.MjData(self._m))
        self._world.parts.joining.weigh(self._m, self._d)

    def rub(self, axes: Index, newtons: float) -> None:
        """Axes have dry friction when they are empty, and as much more under a load as ever."""
        self._world.motion.guides.rub(axes, newtons)
        self._m.dof_solimp[self._dof[axes], :2] = HARD

    def drag(self, axes: Index, speed: Array) -> None:
        """Axes have damping with which their drives' greatest force holds a `speed` [m/s]."""
        force = self._m.actuator_forcerange[self._actuator[axes], 1]
        self._m.dof_damping[self._dof[axes]] = force / speed

    def weaken(self, axes: Index, factor: float) -> None:
        """Drives give `factor` times the force that they are asked for."""
        drives = self._actuator[axes]
        self._gain[axes] *= factor
        self._m.actuator_biasprm[drives, 1:3] *= factor
        self._m.actuator_forcerange[drives] *= factor
        if factor != 1.0:
            self._hook()

    def mismeasure(self, measure: Measure) -> None:
        """Positions and speeds are measured like this, by drives and supervisor."""
        self._measures.append(measure)
        self._hook()
        self._measure()

    def push(self, body: int, force: Array | None) -> None:
        """A body is pushed with a force (3,) [N] from now on, or no more."""
        self._d.xfrc_applied[body, :3] = 0.0 if force is None else force
        self._world.motion.sleep.wake([body])

    def off(self, axis: int) -> float:
        """How far an axis is from its setpoint [m]."""
        setpoint = self._d.ctrl.reshape(-1, INPUTS)[self._actuator[axis], 0]
        return float(self._d.qpos[self._qpos[axis]] - setpoint)

    def greatest_force(self, axis: int) -> float:
        """Of an axis's drive [N]."""
        return float(self._m.actuator_forcerange[self._actuator[axis], 1])

    def _hook(self) -> None:
        if not self._hooked:
            self._hooked = True
            self._world.hooks.before_step.append(self._act)
            self._world.hooks.sensors.append(lambda x, v: self._measured or (x, v))

    def _act(self) -> None:
        """Before a timestep."""
        self._measure()
        bias = np.zeros(len(self._gain))
        for axis in np.flatnonzero(self._gain != 1.0).tolist():
            bias[axis] = (self._gain[axis] - 1.0) * self._setpoint(axis)[2]
        if self._measured is not None:
            q, v = self._measured
            kp, kv = self._m.actuator_biasprm[self._actuator, 1:3].T
            bias += kp * (q - self._d.qpos[self._qpos]) + kv * (v - self._d.qvel[self._dof])
            self._world.motion.sleep.wake(self._world.motion.axes.body[self._robots].tolist())
        self._m.actuator_biasprm[self._actuator, 0] = bias

    def _setpoint(self, axis: int) -> Array:
        """What a drive reads in this step: position [m], speed [m/s], force [N]."""
        m, d, read = self._m, self._d, np.zeros((INPUTS, 1))
        return np.asarray(mujoco.mj_readCtrl(m, d, self._actuator[axis], d.time, read, -1))

    def _measure(self) -> None:
        if self._measures:
            q, v = self._d.qpos[self._qpos].copy(), self._d.qvel[self._dof].copy()
            for measure in self._measures:
                q, v = measure(q, v)
            self._measured = q, v
