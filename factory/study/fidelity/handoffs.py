"""Hand-offs: gap, speed step, impulse and injected energy of each."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from factory.control.mode import Array, Index
from factory.mjcf.weld_frames import gaps
from factory.simulation.mujoco.fusing import rotations
from factory.study.fidelity.readings import ActiveWelds, Velocities
from factory.study.fidelity.record import HandOff
from factory.support.engine import mujoco

WINDOW = 0.05
"""Time after the switch in which a hand-off is watched [s]; a weld settles in a fifth of it."""


class HandOffs:
    """The hand-offs of a run; their parts are watched for a while after the switch.

    The parts that one carrier takes over in one tick are one hand-off. The parts of all watched
    hand-offs are joined in arrays.
    """

    def __init__(self, m: mujoco.MjModel, welds: ActiveWelds, velocities: Velocities) -> None:
        self.m, self.welds, self.velocities = m, welds, velocities
        self.turn = rotations(m.body_iquat)
        self.done: list[HandOff] = []
        self._watched: list[_Watched] = []
        self._join()

    def begin(self, fresh: Index, time: float, v: Array, xpos: Array, xmat: Array) -> None:
        """Welds switched on at `time`, when the speeds were `v` (nv,) and bodies at `xpos`."""
        self._finish([w for w in self._watched if self.welds.active[w.welds].all()])
        holders = self.m.eq_obj1id[fresh]
        apart = gaps(self.m, fresh, xpos, xmat)
        for holder in np.unique(holders):
            here = holders == holder
            parts = self.m.eq_obj2id[fresh[here]]
            u = self.velocities.relative(v, parts, holders[here])
            made = HandOff(
                round(time, 9),
                self.m.body(int(holder)).name,
                len(parts),
                float(self.m.body_mass[parts].sum()),
                1e3 * float(apart[here].max()),
                1e3 * float(np.linalg.norm(u, axis=1).max()),
            )
            self._watched.append(_Watched(made, fresh[here], parts, holders[here], u, time))
        self._join()

    def tick(self, v: Array, time: float) -> None:
        """The steps of a tick, speeds (n + 1, nv), that ends at `time`."""
        if not self._watched:
            return
        u = self.velocities.relative(v, self._parts, self._holders)
        gained = self._mass * np.linalg.norm(u - self._before, axis=2)
        impulse = np.add.reduceat(gained, self._starts, axis=1).max(axis=0)
        energy = np.add.reduceat(self._energy(u, v), self._starts, axis=1)
        for watched, most, values in zip(self._watched, impulse, energy.T, strict=True):
            watched.note(float(most), values)
        if time - self._watched[0].begun >= WINDOW - 1e-9:
            self._finish([w for w in self._watched if time - w.begun < WINDOW - 1e-9])

    def all(self) -> tuple[HandOff, ...]:
        """Every hand-off so far, in the order of time."""
        self._finish([])
        return tuple(sorted(self.done, key=lambda h: (h.time_s, h.carrier)))

    def _finish(self, kept: list[_Watched]) -> None:
        self.done += [w.result() for w in self._watched if w not in kept]
        self._watched = kept
        self._join()

    def _energy(self, u: Array, v: Array) -> Array:
        """Kinetic energy (n + 1, p) of the watched parts in the frame of their carrier [J]."""
        spin = self.velocities.angular(v, self._parts)
        spin = np.einsum("pji,npj->npi", self.turn[self._parts], spin)
        turning = (self.m.body_inertia[self._parts] * spin**2).sum(axis=2)
        return np.asarray(0.5 * (self._mass * (u**2).sum(axis=2) + turning))

    def _join(self) -> None:
        watched = self._watched
        sizes = [len(w.parts) for w in watched]
        self._starts = np.cumsum([0, *sizes[:-1]]).astype(np.intp)
        none = np.empty(0, np.intp)
        self._parts = np.concatenate([none, *(w.parts for w in watched)])
        self._holders = np.concatenate([none, *(w.holders for w in watched)])
        self._before = np.concatenate([np.empty((0, 3)), *(w.u for w in watched)])
        self._mass = self.m.body_mass[self._parts]


@dataclass(slots=True)
class _Watched:
    """A hand-off under watch: its welds, parts and holders, their first relative velocity `u`, when
    it began, and the peaks so far."""

    made: HandOff
    welds: Index
    parts: Index
    holders: Index
    u: Array
    begun: float
    impulse: float = 0.0
    peak: float = 0.0
    first: float | None = None

    def note(self, impulse: float, energy: Array) -> None:
        if self.first is None:
            self.first = float(energy[0])
        self.impulse = max(self.impulse, impulse)
        self.peak = max(self.peak, float(energy.max()))

    def result(self) -> HandOff:
        energy = 1e3 * max(0.0, self.peak - (self.first or 0.0)) / self.made.mass_kg
        return replace(self.made, impulse_mNs=1e3 * self.impulse, energy_mJ_per_kg=energy)
