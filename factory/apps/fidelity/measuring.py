"""Measurement of a run in MuJoCo, by an observer that only reads.

The run is the same, to the last bit, with and without it.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np

from factory.api import MujocoWorld, Run, Simulation, State
from factory.apps.fidelity.hidden import HiddenPenetrations
from factory.apps.monitor import beside
from factory.support.arrays import Array
from factory.support.engine import mujoco

FULL = 0.999
"""Share of its limit from which a force is saturated."""

OF_THE_RUN = (
    "handoffs",
    "handoff_gap_max_mm",
    "handoff_angle_max_deg",
    "weld_residual_max_mm",
    "product_error_max_mm",
    "product_angle_max_deg",
    "grip_gap_max_mm",
    "grip_strength_share_max",
    "unintended_contacts",
    "engine_warnings",
)
"""The figures that a run measures itself."""


class Measurement:
    """Measurement of a simulation, which `run` runs."""

    def __init__(self, simulation: Simulation) -> None:
        self.simulation = simulation
        world, settings = simulation.physical, simulation.request.settings
        self.hidden = HiddenPenetrations.of(simulation)
        self.steps = Steps(world.m, world.d, settings.steps)
        self.drives = DriveFigures(world)

    def run(self, max_time: float | None = None) -> Run:
        """Run and measure the simulation, with a monitor beside it unless it recovers: the monitor
        then judges its log (`record.monitor.calm`)."""
        with self.steps.sampled():
            if self.simulation.request.recovers:
                return self.simulation.run([self.observe], max_time)
            watcher = beside(self.simulation)
            run = self.simulation.run([self.observe, watcher.observe], max_time)
        return replace(run, monitor=watcher.report(run.lasting))

    def observe(self, state: State) -> None:
        """Measure a tick."""
        self.drives.tick(*self.steps.take())
        self.hidden.look(state.observation.qpos, state.time)

    def figures(self) -> dict[str, float | None]:
        """The figures of the MuJoCo run alone, by the keys of their quantities."""
        drives, m = self.drives, self.simulation.physical.m
        physics = self.simulation.physical.figures()
        return {
            **{key: getattr(physics, key) for key in OF_THE_RUN},
            "tracking_error_max_mm": 1e3 * drives.error,
            "hidden_penetration_max_mm": self.hidden.deepest(),
            "force_saturated_percent": 1e2 * drives.saturation,
            "force_peak_percent": 1e2 * drives.peak,
            "drive_work_J": drives.work,
            "moved_mass_kg": float(m.body_mass[m.body_treeid >= 0].sum()),
        }


class Steps:
    """Speeds of all degrees of freedom and forces of all drives in the steps of the tick under
    way; `room`: the number of steps of a tick. One at a time in a process.

    The engine calls its control callback in every step, when the state is that at the step's
    beginning and the forces are still those of the step before. The callback only copies.
    """

    def __init__(self, m: mujoco.MjModel, d: mujoco.MjData, room: int) -> None:
        self._qvel, self._force = d.qvel, d.actuator_force
        self._v = np.zeros((room + 1, m.nv))
        self._f = np.zeros((room + 1, len(self._force)))
        self._t = np.zeros(room + 1)
        self._count = 0

    @contextmanager
    def sampled(self) -> Iterator[None]:
        """Sample the steps of a run made in this context."""
        mujoco.set_mjcb_control(self._step)
        try:
            yield
        finally:
            mujoco.set_mjcb_control(None)

    def _step(self, m: Any, d: Any) -> None:
        at = int(np.searchsorted(self._t[: self._count], d.time))
        if at == self._count:  # else the step is repeated: it has woken a body, or met a contact
            self._t[at], self._v[at], self._f[at] = d.time, self._qvel, self._force
        self._count = at + 1

    def take(self) -> tuple[Array, Array]:
        """Speeds (n + 1, nv) before, between and after the n steps since the last call, and the
        forces (n, nu) in them. Valid until the next step."""
        n, self._count = self._count, 0
        self._v[n] = self._qvel
        self._f[n] = self._force
        return self._v[: n + 1], self._f[1 : n + 1]


class DriveFigures:
    """Largest tracking error [m], largest force as a share of its limit, share of the steps in
    which a drive is at its limit, and work [J]."""

    def __init__(self, world: MujocoWorld) -> None:
        self.world, m = world, world.m
        self.error = self.peak = self.work = 0.0
        self.dof = m.jnt_dofadr[m.actuator_trnid[:, 0]]
        self.limit = m.actuator_forcerange[:, 1]
        self.saturated = np.zeros(len(self.limit), np.int64)
        self.steps = 0

    def tick(self, v: Array, force: Array) -> None:
        """The steps of a tick: speeds (n + 1, nv), forces (n, nu)."""
        d, motion = self.world.d, self.world.motion
        error = motion.axes.off(d, motion.robots.x)
        self.error = max(self.error, float(error.max()))
        share = np.abs(force) / self.limit
        self.peak = max(self.peak, float(share.max()))
        self.saturated += (share >= FULL).sum(axis=0)
        self.steps += len(force)
        speed, timestep = v[:, self.dof], float(self.world.m.opt.timestep)
        self.work += timestep * float(np.abs(force * (speed[1:] + speed[:-1]) / 2).sum())

    @property
    def saturation(self) -> float:
        """Share of the steps in which the worst drive was at its limit."""
        return float(self.saturated.max()) / self.steps if self.steps else 0.0
