"""Figures of drives, payloads and welds: tracking errors, forces, accelerations, residuals."""

from __future__ import annotations

import numpy as np

from factory.control.mode import REST, Array
from factory.mjcf.weld_frames import FEED, ROWS, Slides, residuals
from factory.simulation.mujoco.world import MujocoWorld
from factory.study.fidelity.readings import ActiveWelds, Velocities
from factory.support.engine import mujoco

FULL = 0.999
"""Share of its limit from which a force is saturated."""

PER_DECADE = 240
LOWEST, HIGHEST = -12, 6
"""Powers of ten; smaller and larger values count to the first and last bin."""


class Histogram:
    """A distribution of positive values [any unit] in fixed memory: the exact maximum, and
    quantiles within 1 % from counts in bins of equal ratio.

    >>> h = Histogram()
    >>> h.add(np.linspace(0.001, 1, 1000))
    >>> h.largest, round(h.quantile(0.99), 2)
    (1.0, 0.99)
    """

    def __init__(self) -> None:
        self.counts = np.zeros((HIGHEST - LOWEST) * PER_DECADE + 1, np.int64)
        self.squares = 0.0
        self.total = 0
        self._largest = 0.0
        self._waiting: list[Array] = []
        self._room = 0

    def add(self, values: Array) -> None:
        """Count values; those below the lowest bin as zero. Many are counted at once, for speed."""
        self._waiting.append(np.ravel(values))
        self._room += values.size
        if len(self._waiting) >= 100 or self._room >= 10_000:
            self._count()

    def _count(self) -> None:
        flat = np.concatenate([np.empty(0), *self._waiting])
        self._waiting, self._room = [], 0
        if not flat.size:
            return
        self.total += flat.size
        self.squares += float(flat @ flat)
        self._largest = max(self._largest, float(flat.max()))
        with np.errstate(divide="ignore"):
            bins = (np.log10(flat) - LOWEST) * PER_DECADE
        np.clip(bins, -1, len(self.counts) - 2, out=bins)
        self.counts += np.bincount(bins.astype(np.intp) + 1, minlength=len(self.counts))

    @property
    def largest(self) -> float:
        """The largest value, 0 where there is none."""
        self._count()
        return self._largest

    def quantile(self, share: float) -> float:
        """The value that a `share` of all values does not exceed: the upper edge of its bin, at
        most the largest; 0 without values."""
        self._count()
        if not self.total:
            return 0.0
        number = int(np.searchsorted(np.cumsum(self.counts), share * self.total))
        edge = 0.0 if number == 0 else 10.0 ** (LOWEST + number / PER_DECADE)
        return float(min(edge, self._largest))

    @property
    def rms(self) -> float:
        """Root mean square."""
        self._count()
        return float(np.sqrt(self.squares / self.total)) if self.total else 0.0


class DriveFigures:
    """Tracking errors [m], forces as a share of their limit, and work [J]."""

    def __init__(self, world: MujocoWorld) -> None:
        self.world, m = world, world.m
        self.tracking = Histogram()
        self.error = self.peak = self.work = 0.0
        self.dof = m.jnt_dofadr[m.actuator_trnid[:, 0]]
        self.limit = m.actuator_forcerange[:, 1]
        self.saturated = np.zeros(len(self.limit), np.int64)
        self.steps = 0

    def tick(self, v: Array, force: Array) -> None:
        """The steps of a tick: speeds (n + 1, nv), forces (n, nu)."""
        d, motion = self.world.d, self.world.motion
        error = np.abs(d.qpos[motion.axes.qpos] - motion.robots.x)
        self.error = max(self.error, float(error.max()))
        self.tracking.add(error[motion.robots.v != 0.0])
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


class Payload:
    """Accelerations [m/s²] of steps, and jerks [m/s³] of ticks, of parts held by robots and the
    tray. Parts in feeders and spare copies are left out: only these are ever teleported."""

    def __init__(self, welds: ActiveWelds, velocities: Velocities, timestep: float) -> None:
        self.welds, self.velocities, self.timestep = welds, velocities, timestep
        self.acceleration, self.jerk = Histogram(), Histogram()
        self._mean = np.zeros((len(welds.kind), 3))
        self._held = np.zeros(len(welds.kind), bool)

    def tick(self, v: Array) -> None:
        """The steps of a tick, speeds (n + 1, nv)."""
        parts, before = self.welds.carried(), self._mean
        self._mean = np.zeros_like(before)
        if len(parts):
            linear = self.velocities.linear(v, parts)
            self.acceleration.add(_lengths((linear[1:] - linear[:-1]) / self.timestep))
            span = (len(v) - 1) * self.timestep
            self._mean[parts] = (linear[-1] - linear[0]) / span
            again = parts[self._held[parts]]
            self.jerk.add(_lengths((self._mean[again] - before[again]) / span))
        self._held = self.welds.kind >= FEED


class Residual:
    """Residuals [m] of active, awake welds at the end of ticks: the `largest` of all, and the
    distribution of those whose holder is faster than robots are when they hand over: a holder at
    rest may be asleep."""

    def __init__(self, m: mujoco.MjModel, d: mujoco.MjData, slides: Slides) -> None:
        self.m, self.d, self.slides = m, d, slides
        self.largest, self.moving = 0.0, Histogram()

    def tick(self, v: Array) -> None:
        """Speeds at the end of a tick (nv,)."""
        length = _lengths(residuals(self.d))
        self.largest = max(self.largest, float(length.max(initial=0.0)))
        holder = self.m.eq_obj1id[self.d.efc_id[: self.d.ne : ROWS]]
        speed = np.linalg.norm(self.slides.velocity(holder, v), axis=1)
        self.moving.add(length[speed > REST])


def _lengths(vectors: Array) -> Array:
    """The lengths (...) of vectors (..., 3)."""
    return np.asarray(np.sqrt(np.einsum("...i,...i->...", vectors, vectors)))
