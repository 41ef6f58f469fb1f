"""Disturbances put to work in a simulation that is ready to run.

Masses, friction and limits are written into the engine's model at once. Pushes, noise, delay and
weak drives act in every timestep: `advance` and `sense` of that one world are wrapped. A drive's
force is kp (reference - measured) + ...; a measurement that is off by e enters the engine's own
feedback as the constant -kp e - kv e', which is added to its bias."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from factory.control.mode import Array, Index, Limits
from factory.mjcf import names
from factory.simulation.disturbance.values import (
    Delay,
    Disturbance,
    Dragged,
    Friction,
    Gain,
    Mass,
    Noise,
    Push,
    Slowed,
)
from factory.simulation.mujoco.drives import INPUTS
from factory.support.engine import mujoco
from factory.support.errors import Diagnostic, InputError, did_you_mean

if TYPE_CHECKING:
    from factory.simulation.simulation import Simulation

Measure = Callable[[Array, Array], tuple[Array, Array]]
"""True positions [m] and speeds [m/s] of the axes -> measured ones; called once a timestep."""

HARD = 0.9999
"""Impedance of dry friction: at the engine's default of 0.9 a robot creeps under forces far below
it, and nothing ever sticks."""


def disturb(simulation: Simulation, *disturbances: Disturbance) -> Simulation:
    """The same simulation, disturbed; call it once, before `run`. With no disturbances it is
    untouched.

    Raises InputError (BadValue) in the ideal world, which has no bodies, and where a disturbance
    names a body, part or robot that is not there.
    """
    if not disturbances:
        return simulation
    if simulation.model is None:
        raise _bad("the ideal world has nothing to disturb", "take the world mujoco")
    acting = _Acting(simulation)
    for disturbance in disturbances:
        acting.add(disturbance)
    acting.begin()
    return simulation


class _Acting:
    """The disturbances of one world: what they have written, and what acts in every timestep."""

    def __init__(self, simulation: Simulation) -> None:
        self.simulation, self.world = simulation, simulation.world
        world, m = self.world, self.world.m
        self.m, self.d = m, world.d
        self.axes = np.arange(world.tray)
        self.qpos, self.dof = world.qpos[self.axes], world.dof[self.axes]
        number = {int(adr): n for n, adr in enumerate(m.actuator_ctrladr)}
        self.actuator = np.array([number[int(adr)] for adr in world.control[self.axes]])
        self.gain = np.ones(len(self.axes))
        self.pushes: list[tuple[int, Push]] = []
        self.measures: list[Measure] = []
        self.measured: tuple[Array, Array] | None = None

    def add(self, disturbance: Disturbance) -> None:
        match disturbance:
            case Push():
                self.pushes.append((self._body(disturbance.body), disturbance))
                self.world.vicinity.everything()
            case Mass():
                self._weigh(disturbance)
            case Gain():
                self.gain[self._of(disturbance.robots)] *= disturbance.factor
            case Friction():
                dofs = self.dof[self._of(disturbance.robots)]
                self.m.dof_frictionloss[dofs] = disturbance.newtons
                self.m.dof_solimp[dofs, :2] = HARD
            case Noise():
                self.measures.append(_noise(disturbance, len(self.axes)))
            case Delay():
                late = round(disturbance.seconds / self.m.opt.timestep)
                self.measures.append(_late(deque(maxlen=late + 1)))
            case Slowed():
                self._slow(disturbance)
            case Dragged():
                self._drag(disturbance)

    def begin(self) -> None:
        """Write the gains, and wrap the world where something acts as it goes."""
        m, touched = self.m, self.actuator[self.gain != 1.0]
        factor = self.gain[self.gain != 1.0][:, None]
        m.actuator_biasprm[touched, 1:3] *= factor
        m.actuator_forcerange[touched] *= factor
        if not (self.pushes or self.measures or len(touched)):
            return
        advance, sense = self.world.advance, self.world.sense

        def disturbed(substeps: int) -> None:
            for _ in range(substeps):
                self._act()
                advance(1)

        def sensed() -> tuple[Array, Array]:
            return sense() if self.measured is None else self.measured

        self.world.advance, self.world.sense = disturbed, sensed
        self.world.at_once = 1
        self._measure()

    def _act(self) -> None:
        """Before a timestep."""
        now, half = self.d.time, self.m.opt.timestep / 2
        for body, _ in self.pushes:
            self.d.xfrc_applied[body, :3] = 0.0
        for body, push in self.pushes:
            if push.at - half <= now < push.at + push.duration - half:
                self.d.xfrc_applied[body, :3] += push.force
        self._measure()
        bias = np.zeros(len(self.gain))
        for axis in np.flatnonzero(self.gain != 1.0).tolist():
            bias[axis] = (self.gain[axis] - 1.0) * self._told(axis)[2]
        if self.measured is not None:
            q, v = self.measured
            kp, kv = self.m.actuator_biasprm[self.actuator, 1:3].T
            bias += kp * (q - self.d.qpos[self.qpos]) + kv * (v - self.d.qvel[self.dof])
            self.world.rouse(self.axes)  # or the engine lets sleep what stands
        self.m.actuator_biasprm[self.actuator, 0] = bias

    def _told(self, axis: int) -> Array:
        """What a drive reads in this step: position [m], speed [m/s], force [N]."""
        m, d, read = self.m, self.d, np.zeros((INPUTS, 1))
        return np.asarray(mujoco.mj_readCtrl(m, d, self.actuator[axis], d.time, read, -1))

    def _measure(self) -> None:
        if not self.measures:
            return
        q, v = self.d.qpos[self.qpos].copy(), self.d.qvel[self.dof].copy()
        for measure in self.measures:
            q, v = measure(q, v)
        self.measured = q, v

    def _weigh(self, mass: Mass) -> None:
        copies = self.simulation.model.copies  # type: ignore[union-attr]
        for label in mass.parts:
            _known(label, copies, "part")
        for label in mass.parts or copies:
            for number in range(1, copies[label] + 1):
                body = self.m.body(names.part(label, number)).id
                self.m.body_mass[body] *= mass.factor
                self.m.body_inertia[body] *= mass.factor
        mujoco.mj_setConst(self.m, mujoco.MjData(self.m))
        self.world.stock.weigh()

    def _slow(self, slowed: Slowed) -> None:
        limits = self.simulation.limits
        speed = np.array(limits.speed)
        speed[self._of((slowed.robot,))] *= slowed.factor
        changed = Limits(speed, limits.acceleration)
        self.simulation.limits = changed
        self.simulation.supervisor.limit(changed)

    def _drag(self, dragged: Dragged) -> None:
        axes = self._of((dragged.robot,))
        force = self.m.actuator_forcerange[self.actuator[axes], 1]
        top = dragged.factor * self.simulation.limits.speed[axes]
        self.m.dof_damping[self.dof[axes]] = force / top

    def _of(self, robots: Iterable[str]) -> Index:
        """The axes of some robots, of all for none."""
        chosen = dict.fromkeys(robots)
        if not chosen:
            return self.axes
        known = {robot.name: robot.index for robot in self.simulation.layout.factory.robots}
        for name in chosen:
            _known(name, known, "robot")
        axes = (axis for name in chosen for axis in self.world.axes_of(known[name]))
        return np.array(sorted(axes), np.intp)

    def _body(self, name: str) -> int:
        known = [self.m.body(n).name for n in range(1, self.m.nbody)]
        _known(name, known, "body")
        return int(self.m.body(name).id)


def _noise(noise: Noise, axes: int) -> Measure:
    draw = np.random.default_rng(noise.seed)

    def measure(q: Array, v: Array) -> tuple[Array, Array]:
        return q + noise.metres * draw.normal(size=axes), v + noise.speed * draw.normal(size=axes)

    return measure


def _late(kept: deque[tuple[Array, Array]]) -> Measure:
    """The oldest of the last measurements."""

    def measure(q: Array, v: Array) -> tuple[Array, Array]:
        kept.append((q, v))
        return kept[0]

    return measure


def _known(name: str, known: Iterable[str], kind: str) -> None:
    if name not in known:
        hint = did_you_mean(name, sorted(known), f"{kind} names")
        raise _bad(f"there is no {kind} '{name}' to disturb", hint)


def _bad(message: str, hint: Any) -> InputError:
    return InputError(Diagnostic("BadValue", message, None, hint))
