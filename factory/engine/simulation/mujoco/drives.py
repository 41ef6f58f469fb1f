"""The drives' setpoints, written ahead into the engine's sample buffers.

Each actuator reads its setpoint from a buffer with a delay (`mjModel.actuator_delay`), so samples
that are written before a call of the engine are read in its steps. The last sample is held. A step
in which something falls asleep reads its sample once more, so one sample is kept to spare. A drive
that stands has no delay and keeps no samples: it reads `ctrl`.

A buffer in `mjData.history` is one number for users, the index of the newest sample, the samples'
times, and their values. The value at a time is that of the last sample before it, so the times are
half a step early.

The engine's speeds lag its positions by half a timestep (semi-implicit Euler). Current-time
velocities bias the drives by h a / (2 omega), so setpoints have the speeds of half a step before.
"""

from __future__ import annotations

import numpy as np

from factory.engine.simulation.mujoco.curves import Curves
from factory.engine.simulation.mujoco.model_arrays import ModelArrays
from factory.support.arrays import Array, Index
from factory.support.engine import mujoco

NO_AXES = np.empty(0, np.intp)

INPUTS = 3
"""A setpoint: position [m], speed [m/s], force [N]."""


class Drives:
    """The drives of some axes.

    Args:
        arrays: the arrays of the model.
        d: the engine's data.
        actuators: the drive of each axis (axes,), one perhaps of several axes of which at most one
            moves; their buffers are of one size, and side by side.
        inertia: what moves without a load (axes,) [kg].
        curves: the axes that move several joints, with a drive for each.

    Attributes:
        own: what moves without a load (axes,) [kg].
        mass: what the force of a setpoint accelerates (axes,) [kg].
        weight: what the drive bears (axes,) [N].
    """

    def __init__(
        self,
        arrays: ModelArrays,
        d: mujoco.MjData,
        actuators: Index,
        inertia: Array,
        curves: Curves | None = None,
    ) -> None:
        self.own, self.mass, self.weight = inertia, inertia.copy(), np.zeros(len(inertia))
        self._curves = curves
        if curves is not None:
            actuators = np.concatenate([actuators, curves.actuator.ravel()])
        m = arrays.m
        self.timestep = float(m.opt.timestep)
        self._d, self._actuators = d, actuators
        self._delay, self._history = arrays["actuator_delay"], arrays["actuator_history"]
        samples = int(m.actuator_history[actuators[0], 0])
        size = 2 + (1 + INPUTS) * samples
        at = m.actuator_historyadr[actuators]
        first, self._row = int(at.min()), (at - at.min()) // size
        count = int(self._row.max()) + 1
        self._buffers = d.history[first : first + count * size].reshape(-1, size)
        early = np.arange(samples) - 2 * samples + 1.5
        self._head = np.concatenate([[samples - 1.0], self.timestep * early])

    @property
    def most(self) -> int:
        """Number of setpoints that fit into a buffer, one to spare."""
        return len(self._head) - 3

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return float(self._d.time)

    def sampled(self, axes: Index, x: Array, v: Array, a: Array, steps: int) -> Array:
        """Setpoints (n, legs * steps + 1, 3) at every step of legs of `steps` steps, and at the
        end. `x` [m], `v` [m/s] (legs + 1, n): at the ends of legs; `a` [m/s²] (legs, n)."""
        t = self.timestep * np.arange(steps)[:, None]
        weight = self.weight[axes]
        force = self.mass[axes] * a + weight
        speed = v[:-1, None] + t * a[:, None]
        place = x[:-1, None] + (t / 2) * (v[:-1, None] + speed)
        lagging = speed - (self.timestep / 2) * a[:, None]
        legs = np.stack([place, lagging, np.broadcast_to(force[:, None], place.shape)], axis=-1)
        rest = np.where(v[-1] == 0.0, weight, force[-1])
        after = np.stack([x[-1], v[-1], rest], axis=-1)
        setpoints = np.concatenate([legs.reshape(-1, *after.shape), after[None]]).swapaxes(0, 1)
        if len(self._curved(axes)[1]):
            a = np.concatenate([np.repeat(a, steps, axis=0), np.where(v[-1] == 0.0, 0.0, a[-1:])])
            lag = np.append(np.full(len(a) - 1, self.timestep / 2), 0.0)
            return self.spread(axes, setpoints, a.T, lag)
        return setpoints

    def spread(self, axes: Index, setpoints: Array, a: Array, lag: Array) -> Array:
        """Setpoints of joints, those beyond the first of an axis appended (n + b (d - 1), samples,
        3), from setpoints (n, samples, 3) along axes, whose speeds are those of `lag` (samples,)
        [s] before, and accelerations (n, samples) [m/s²]."""
        which, rows = self._curved(axes)
        if self._curves is None or not len(rows):
            return setpoints
        x, v, a = setpoints[which, :, 0].T, (setpoints[which, :, 1] + a[which] * lag).T, a[which].T
        ways, now, empty = self._curves.ways, self._curves.now[rows], self.own[axes[which]]
        place, first, second = ways.at(now, x)
        speed = first * v[..., None]
        gain = first * a[..., None] + second * (v**2)[..., None]
        force = ways.force(now, (x, v, a), empty, self.mass[axes[which]] - empty)
        every = np.stack([place, speed - lag[:, None, None] * gain, force], axis=-1)
        every, setpoints = every.transpose(1, 2, 0, 3), setpoints.copy()
        setpoints[which] = every[:, 0]
        return np.concatenate([setpoints, every[:, 1:].reshape(-1, *setpoints.shape[1:])])

    def _curved(self, axes: Index) -> tuple[Index, Index]:
        """Which of some axes move several joints, and their rows."""
        if self._curves is None or not len(self._curves.axes):
            return NO_AXES, NO_AXES
        return self._curves.among(axes)

    def _rows(self, axes: Index) -> Index:
        """The drives of axes: those of first joints, then all others."""
        _, rows = self._curved(axes)
        if self._curves is None or not len(rows):
            return axes
        return np.concatenate([axes, len(self.own) + self._curves.further(rows)])

    def follow(self, axes: Index, setpoints: Array) -> None:
        """Let axes follow setpoints (n, samples, 3), one each timestep; the last is held."""
        drives, samples = self._rows(axes), setpoints.shape[1]
        actuators, rows, head = self._actuators[drives], self._row[drives], self._head.copy()
        self._delay[actuators] = self.most * self.timestep
        self._history[actuators, 0] = len(head) - 1
        head[1:] += self.time + samples * self.timestep
        self._buffers[rows, 1 : 1 + len(head)] = head
        self._buffers[rows, -INPUTS * samples :] = setpoints.reshape(len(drives), -1)
        self.show(axes, setpoints[:, -1])

    def show(self, axes: Index, setpoint: Array) -> None:
        """Write the current setpoints (n, 3) into `ctrl`, which a step appends to the samples."""
        self._d.ctrl.reshape(-1, INPUTS)[self._actuators[self._rows(axes)]] = setpoint

    def stand(self, axes: Index, x: Array) -> None:
        """Let axes stand at x [m]."""
        actuators = self._actuators[self._rows(axes)]
        self._delay[actuators] = self._history[actuators, 0] = 0
        setpoint = self._d.ctrl.reshape(-1, INPUTS)
        setpoints = np.stack([x, np.zeros(len(axes)), self.weight[axes]], axis=-1)[:, None]
        setpoint[actuators] = self.spread(axes, setpoints, np.zeros((len(axes), 1)), np.zeros(1))[
            :, 0
        ]

    def load(self, axes: Index, mass: Array, weight: Array) -> None:
        """Set the added mass [kg] and weight [N] of axes, from their next setpoints on."""
        self.mass[axes], self.weight[axes] = self.own[axes] + mass, weight
