"""What the drives are told: their setpoints in every step of a tick, written before it.

Each drive has a buffer. The engine reads it a tick late (`mjModel.actuator_delay`), so whatever is
written before a tick is read in its steps, and there is no need to come back from the engine in
between. In each step the engine puts `ctrl` in place of the oldest sample: who has been told to
stand needs to be told no more. It does so twice in a step that has woken a body, and is begun anew;
so there are two samples for each step of a tick, and those that come first are spare.

A buffer in `mjData.history`: one number for users, the place of the newest sample, the samples'
times, their values. The value at a time is that of the last sample before it, so samples are half a
step early.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from factory.control.mode import Array, Index, Truth
from factory.engine import mujoco
from factory.mjcf.model import SAMPLES

INPUTS = 3
"""A drive follows a position [m] and a speed [m/s], and pushes with a force besides [N]."""

NOBODY = np.empty(0, np.intp)


@dataclass(frozen=True, slots=True, eq=False)
class Told:
    """What n axes are told for a tick: `terms` (n, 5) that give every step's setpoints, their
    position [m], speed [m/s], acceleration [m/s²], force [N] and 1; and the setpoints `after` it
    (n, 3)."""

    terms: Array
    after: Array


@dataclass(frozen=True, slots=True, eq=False)
class Where:
    """Where the drives of n axes are told: the numbers of their `buffers` (n,), and their `inputs`
    in `ctrl` (n, 3)."""

    buffers: Index
    inputs: Index


class Setpoints:
    """The setpoints of axes, whose drives are `actuators`; each feeds forward what accelerates its
    `mass` [kg], of its own at first, and carries its `weight` [N].

    `control` (axes,): where in `ctrl` an axis's setpoints begin.
    """

    def __init__(
        self, m: mujoco.MjModel, d: mujoco.MjData, actuators: Index, mass: Array, weight: Array
    ) -> None:
        self.d, self.own, self.mass, self.weight = d, mass, mass.copy(), weight
        self.control = m.actuator_ctrladr[actuators]
        self._timestep = float(m.opt.timestep)
        samples = int(m.actuator_history[actuators[0], 0])
        steps = samples // SAMPLES
        self._tick = steps * self._timestep
        m.actuator_delay[actuators] = self._tick
        size = 2 + (1 + INPUTS) * samples
        self._buffer = m.actuator_historyadr[actuators] // size
        self._buffers = d.history.reshape(-1, size)[:, 1:]
        self._samples = _samples(steps, self._timestep)
        self._times = self._samples[4, 1 : 1 + samples]
        self._early = self._times.copy()
        self._latest: list[tuple[float, Index, Array]] = []
        self._plan = np.zeros((4, len(actuators)))
        self._due, self._any_due = np.zeros(len(actuators), bool), False

    def where(self, axes: Index) -> Where:
        """Where the drives of axes are told."""
        return Where(self._buffer[axes], self.control[axes][:, None] + np.arange(INPUTS))

    def of(self, axes: Index, x: Array, v: Array, a: Array, x1: Array, v1: Array) -> Told:
        """What axes are told that run from x [m] at speed v under acceleration a, and are at x1
        with the speed v1 when the engine comes back."""
        terms, after = np.empty((5, len(axes))), np.empty((INPUTS, len(axes)))
        terms[0], terms[1], terms[2], terms[4] = x, v, a, 1.0
        terms[3] = self.mass[axes] * a + self.weight[axes]
        after[0], after[1], after[2] = x1, v1, terms[3]
        return Told(terms.T, after.T)

    def tell(self, where: Where, told: Told) -> None:
        """Tell drives; the tick begins now."""
        now = float(self.d.time)
        over = now - self._tick + self._timestep / 2
        self._latest = [said for said in self._latest if said[0] > over]
        self._latest.append((now, where.buffers, told.terms))
        self._write(now, where.buffers, told.terms)
        self.d.ctrl[where.inputs] = told.after

    def again(self) -> None:
        """Tell again what is not over yet: the engine goes back in time."""
        for said in self._latest:
            self._write(*said)

    def _write(self, begin: float, buffers: Index, terms: Array) -> None:
        np.add(self._early, begin, out=self._times)
        self._buffers[buffers] = terms @ self._samples

    def follow(self, axes: Index, where: Where, told: Told) -> None:
        """Tell axes what comes, whatever `move` has told them."""
        self._due[axes] = False
        self.tell(where, told)

    def move(self, axes: Index, x: Array, v: Array, a: Array) -> None:
        """From now on axes run from x [m] at speed v under acceleration a, until they are told
        otherwise."""
        plan = self._plan
        plan[0, axes] = self.d.time
        plan[1, axes], plan[2, axes], plan[3, axes] = x, v, a
        self._due[axes] = self._any_due = True

    def load(self, axis: int, mass: float, weight: float) -> None:
        """From now on an axis moves a mass [kg] beside its own, and carries a weight [N]."""
        self.mass[axis], self.weight[axis] = self.own[axis] + mass, weight
        self._due[axis] = self._any_due = True

    def update(self, steps: int) -> tuple[Index, Truth]:
        """Tell those what comes that `move` has set going or stopped, before so many steps of the
        engine; gives who they are, and which of them are under way."""
        (axes,) = self._due.nonzero() if self._any_due else (NOBODY,)
        self._any_due = len(axes) > 0
        if not self._any_due:
            return NOBODY, NOBODY != 0
        begun, x, v, a = self._plan[:, axes]
        since, ahead = self.d.time - begun, steps * self._timestep
        x, v = x + since * (v + 0.5 * since * a), v + since * a
        x1, v1 = x + ahead * (v + 0.5 * ahead * a), v + ahead * a
        self.tell(self.where(axes), self.of(axes, x, v, a, x1, v1))
        self._due[axes] = moves = under_way(*self._plan[2:, axes])
        self._any_due = bool(moves.any())
        return axes, moves


def under_way(v: Array, a: Array) -> Truth:
    """Which axes do not stand: they have a speed [m/s], or get one by an acceleration [m/s²]."""
    return np.asarray((v != 0.0) | (a != 0.0))


def _samples(steps: int, timestep: float) -> Array:
    """What (x, v, a, force, 1) is multiplied by to give a buffer's content: the place of the newest
    sample, the samples' times from now, and their values (5, 1 + 4 samples)."""
    count = SAMPLES * steps
    late = np.arange(count) - (count - steps)
    ahead = timestep * np.maximum(late, 0)
    newest, times, values = np.zeros((5, 1)), np.zeros((5, count)), np.zeros((5, count, INPUTS))
    newest[4], times[4] = count - 1, timestep * (late - steps - 0.5)
    values[0, :, 0], values[1, :, 0], values[2, :, 0] = 1.0, ahead, ahead**2 / 2
    values[1, :, 1], values[2, :, 1] = 1.0, ahead
    values[3, :, 2] = 1.0
    return np.concatenate([newest, times, values.reshape(5, -1)], axis=1)
