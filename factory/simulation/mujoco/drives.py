"""What the drives are told: their setpoints in every step of some ticks, written before them.

Each drive has a buffer. The engine reads it late (`mjModel.actuator_delay`), so whatever is written
before a call of the engine is read in its steps, and there is no need to come back from it in
between. The last sample is for ever after: in each step the engine puts `ctrl` in place of the
oldest one, and that is the same. A step in which something falls asleep reads its sample once more,
after that: there is one to spare.

A buffer in `mjData.history`: one number for users, the place of the newest sample, the samples'
times, their values. The value at a time is that of the last sample before it, so samples are half a
step early.

The engine's speeds are those of half a timestep before: it adds to a position what comes of the
speed after the step. So are the speeds that drives are told, or else they would push robots off
their references by half a timestep's acceleration, to a place where their stiffness pushes back.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from factory.control.mode import Array, Index, Truth
from factory.support.engine import mujoco

INPUTS = 3
"""A drive follows a position [m] and a speed [m/s], and pushes with a force besides [N]."""

Leg = tuple[Array, Array, Array]
"""A tick of n axes: the positions [m] and speeds [m/s] where it begins, its accelerations
[m/s²]."""


@dataclass(frozen=True, slots=True, eq=False)
class Told:
    """What n axes are told for some ticks: their `setpoints` in every step, and those `after` it
    (n, (steps + 1) * 3), position [m], speed [m/s] and force [N], so many `samples` each.
    `drives` (n,): by number."""

    setpoints: Array
    drives: Index
    after: Array
    samples: int

    @staticmethod
    def of(setpoints: Array, drives: Index) -> Told:
        """Of setpoints (n, steps + 1, 3)."""
        axes, samples, _ = setpoints.shape
        flat = setpoints.reshape(axes, samples * INPUTS)
        return Told(flat, drives, flat[:, -INPUTS:], samples)


class Setpoints:
    """The setpoints of axes, whose drives are `actuators`, for ticks of so many `steps`; each feeds
    forward what accelerates its `mass` [kg], of its own at first, and carries its `weight` [N].

    `control` (axes,): where in `ctrl` an axis's setpoints begin. `any_due`: some axis is to be told
    what `move`, `stand` or `load` has changed.
    """

    def __init__(
        self,
        m: mujoco.MjModel,
        d: mujoco.MjData,
        actuators: Index,
        steps: int,
        mass: Array,
        weight: Array,
    ) -> None:
        self.d, self.own, self.mass, self.weight = d, mass, mass.copy(), weight
        self.control = m.actuator_ctrladr[actuators]
        self._drives, self._ctrl = actuators, d.ctrl.reshape(-1, INPUTS)
        self._timestep, self._half = float(m.opt.timestep), float(m.opt.timestep) / 2
        samples = int(m.actuator_history[actuators[0], 0])
        most = samples - 2
        m.actuator_delay[actuators] = most * self._timestep
        self._ahead = self._timestep * np.arange(most)
        self._steps = steps
        size = 2 + (1 + INPUTS) * samples
        buffers = d.history.reshape(-1, size)
        self._heads = buffers[:, 1 : 2 + samples]
        self._tails = [buffers[:, size - INPUTS * told :] for told in range(samples)]
        self._head = np.full(1 + samples, samples - 1.0)
        self._times = self._head[1:]
        self._early = self._timestep * (np.arange(samples) - samples - most - 0.5)
        self._latest: list[tuple[float, float, Told]] = []
        self._plan = np.zeros((4, len(actuators)))
        self._due, self.any_due = np.zeros(len(actuators), bool), False

    def of(self, axes: Index, legs: Sequence[Leg], x1: Array, v1: Array) -> Told:
        """What axes are told that run through `legs`, a tick each, and are at x1 [m] with the speed
        v1 when the engine comes back. Who is at rest then stands until told otherwise."""
        setpoints = np.empty((len(axes), len(legs) * self._steps + 1, INPUTS))
        t, weight = self._ahead[: self._steps], self.weight[axes]
        for tick, (x, v, a) in enumerate(legs):
            here = setpoints[:, tick * self._steps : (tick + 1) * self._steps]
            force = self.mass[axes] * a + weight
            speed = v[:, None] + t * a[:, None]
            here[:, :, 0] = x[:, None] + (t / 2) * (v[:, None] + speed)
            here[:, :, 1] = speed - self._half * a[:, None]
            here[:, :, 2] = force[:, None]
        after = setpoints[:, -1]
        after[:, 0], after[:, 1] = x1, v1
        after[:, 2] = np.where(v1 == 0.0, weight, force)
        return Told.of(setpoints, self._drives[axes])

    def tell(self, told: Told) -> None:
        """Tell drives; the first tick begins now. Who is told to stand is for a tick at least."""
        now = float(self.d.time)
        end = now + max(told.samples - 1, self._steps) * self._timestep
        self._latest = [said for said in self._latest if said[0] > now + self._timestep / 2]
        self._latest.append((end, now, told))
        self._write(now, told)
        self._ctrl[told.drives] = told.after

    def again(self) -> None:
        """Tell again what is not over yet: the engine has gone back in time."""
        for _, begin, told in self._latest:
            self._write(begin, told)

    def _write(self, begin: float, told: Told) -> None:
        samples = told.samples
        np.add(self._early, begin + samples * self._timestep, out=self._times)
        self._heads[told.drives] = self._head
        self._tails[samples][told.drives] = told.setpoints

    def follow(self, axes: Index, told: Told) -> None:
        """Tell axes what comes, whatever `move` has told them."""
        if self.any_due:
            self._due[axes] = False
            self.any_due = bool(self._due.any())
        self.tell(told)

    def move(self, axes: Index, x: Array, v: Array, a: Array) -> None:
        """From now on axes run from x [m] at speed v under acceleration a, until they are told
        otherwise."""
        plan = self._plan
        plan[0, axes] = self.d.time
        plan[1, axes], plan[2, axes], plan[3, axes] = x, v, a
        self._due[axes] = self.any_due = True

    def stand(self, axes: Index, x: Array, going: Truth) -> None:
        """From now on axes stand at x [m]; those that are `going` are to be told."""
        self._plan[1, axes], self._plan[2:, axes] = x, 0.0
        if np.count_nonzero(going):
            self._due[axes[going]] = self.any_due = True

    def load(self, axes: Index, mass: Array | float, weight: Array | float) -> None:
        """From now on axes move a mass each beside their own [kg], and carry a weight [N]. Those
        that carry more or less than before are to be told."""
        changed = self.weight[axes] != weight
        if np.count_nonzero(changed):
            self._due[axes[changed]] = self.any_due = True
        self.mass[axes], self.weight[axes] = self.own[axes] + mass, weight

    def update(self, steps: int) -> tuple[Index, Truth]:
        """Tell those what comes that are due, before so many steps of the engine; gives who they
        are, and which of them are under way."""
        (axes,) = self._due.nonzero()
        moves = under_way(*self._plan[2:, axes])
        self._due[axes], self.any_due = moves, bool(moves.any())
        self.tell(self._planned(axes, steps) if self.any_due else self._standing(axes))
        return axes, moves

    def _standing(self, axes: Index) -> Told:
        """What axes are told that stand where they are to stand."""
        after = np.zeros((len(axes), 1, INPUTS))
        after[:, 0, 0], after[:, 0, 2] = self._plan[1, axes], self.weight[axes]
        return Told.of(after, self._drives[axes])

    def _planned(self, axes: Index, steps: int) -> Told:
        """What axes are told that `move` has set going, for as many ticks as so many steps take."""
        begun, x, v, a = self._plan[:, axes]
        since, ahead = self.d.time - begun, steps * self._timestep
        x, v = x + since * (v + 0.5 * since * a), v + since * a
        x1, v1 = x + ahead * (v + 0.5 * ahead * a), v + ahead * a
        begin = self._ahead[: max(steps, 1) : self._steps]
        legs = [(x + t * (v + 0.5 * t * a), v + t * a, a) for t in begin]
        return self.of(axes, legs, x1, v1)


def under_way(v: Array, a: Array) -> Truth:
    """Which axes do not stand: they have a speed [m/s], or get one by an acceleration [m/s²]."""
    return np.asarray((v != 0.0) | (a != 0.0))
