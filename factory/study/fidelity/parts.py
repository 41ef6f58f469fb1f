"""Parts: the figures of each hand-off, and the places of all in the finished product."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from factory.control.mode import Array, Index
from factory.mjcf import names
from factory.mjcf.model import Model
from factory.mjcf.weld_frames import HOLD, gaps
from factory.simulation.mujoco.fusing import angles, rotations
from factory.study.fidelity.readings import ActiveWelds, Velocities
from factory.study.fidelity.record import HandOff, Misplaced
from factory.support.engine import mujoco

WINDOW = 0.05
"""Time after the switch in which a hand-off is watched [s]; a weld settles in a fifth of it."""


class HandOffs:
    """The hand-offs of a run: gap, speed step, impulse and injected energy of each.

    The parts that one carrier takes over in one tick are one hand-off; they are watched for a while
    after the switch.
    """

    def __init__(self, m: mujoco.MjModel, welds: ActiveWelds, velocities: Velocities) -> None:
        self.m, self.welds, self.velocities = m, welds, velocities
        self.turn = rotations(m.body_iquat)
        self.done: list[HandOff] = []
        self._watched: list[_Watched] = []

    def begin(self, fresh: Index, time: float, v: Array, xpos: Array, xmat: Array) -> None:
        """Welds switched on at `time`, when the speeds were `v` (nv,) and bodies at `xpos`."""
        self._finish(lambda watched: not self.welds.active[watched.welds].all())
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

    def tick(self, v: Array, time: float) -> None:
        """Watch the steps of a tick, with speeds (n + 1, nv), that ends at `time`."""
        for watched in self._watched:
            u = self.velocities.relative(v, watched.parts, watched.holders)
            change = np.linalg.norm(u - watched.u, axis=2)
            impulse = _added(self.m.body_mass[watched.parts] * change)
            watched.note(float(impulse.max()), self._energy(u, v, watched.parts))
        self._finish(lambda watched: time - watched.begun >= WINDOW - 1e-9)

    def all(self) -> tuple[HandOff, ...]:
        """Every hand-off so far, in the order of time."""
        self._finish(lambda _: True)
        return tuple(sorted(self.done, key=lambda h: (h.time_s, h.carrier)))

    def _finish(self, over: Callable[[_Watched], bool]) -> None:
        self.done += [watched.result() for watched in self._watched if over(watched)]
        self._watched = [watched for watched in self._watched if not over(watched)]

    def _energy(self, u: Array, v: Array, parts: Index) -> Array:
        """Kinetic energy (n + 1,) of parts in the frame of their carrier [J]."""
        spin = self.velocities.angular(v, parts)
        spin = np.einsum("pji,npj->npi", self.turn[parts], spin)
        turning = (self.m.body_inertia[parts] * spin**2).sum(axis=2)
        return _added(0.5 * (self.m.body_mass[parts] * (u**2).sum(axis=2) + turning))


def _added(values: Array) -> Array:
    """Sums (n,) of rows (n, p), term by term: the same bits however the rows lie in memory."""
    return np.asarray(np.add.reduceat(values, [0], axis=1)[:, 0])


@dataclass(slots=True)
class _Watched:
    """A hand-off that is watched: its welds, parts and holders, the first relative velocity `u` of
    these, its beginning, and the peaks so far."""

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


class Finished:
    """Largest displacement of every part over all products, after a rigid fit on the first part."""

    def __init__(self, model: Model) -> None:
        product = model.layout.product
        contents = model.factory.contents
        products = [contents[label] for label in model.factory.products]
        self.parts = products[0]
        self._number = {part: n for parts in products for n, part in enumerate(parts)}
        solids = [product.solids[part] for part in self.parts]
        self._centres = np.array([s.centre for s in solids]) - solids[0].centre
        counts = [len(s.corners) for s in solids]
        self._owner = np.repeat(np.arange(len(solids)), counts)
        self._local = np.concatenate([s.corners - s.centre for s in solids])
        self._starts = np.cumsum([0, *counts[:-1]])
        self.position = np.zeros(len(solids))
        self.angle = np.zeros(len(solids))
        self.vertex = np.zeros(len(solids))
        self.products = 0
        self._held: Index | None = None

    def tick(self, welds: ActiveWelds, fresh: Index, xpos: Array, xmat: Array) -> None:
        """Measure a product when the outfeed takes it and when it has gone. Welds have been
        switched, those in `fresh` on, with bodies at `xpos`, `xmat`."""
        if self._held is not None and not (welds.kind[self._held] == HOLD).all():
            self.measure(self._held, xpos, xmat)
            self._held = None
        held = welds.target[fresh[welds.kinds[fresh] == HOLD]]
        if len(held):
            labels = [names.label_of(welds.m.body(int(body)).name) for body in held]
            self._held = held[np.argsort([self._number[label] for label in labels])]
            self.measure(self._held, xpos, xmat)

    def measure(self, bodies: Index, xpos: Array, xmat: Array) -> None:
        """Measure a product of `bodies`, in the order of `parts`."""
        turn = xmat[bodies].reshape(-1, 3, 3)
        turn = turn[0].T @ turn
        place = (xpos[bodies] - xpos[bodies[0]]) @ xmat[bodies[0]].reshape(3, 3)
        off = place - self._centres
        spin = np.einsum("nij,nj->ni", turn[self._owner] - np.eye(3), self._local)
        far = np.linalg.norm(off[self._owner] + spin, axis=1)
        self.position = np.maximum(self.position, np.linalg.norm(off, axis=1))
        self.angle = np.maximum(self.angle, angles(turn))
        self.vertex = np.maximum(self.vertex, np.maximum.reduceat(far, self._starts))
        self.products += 1

    def found(self) -> tuple[Misplaced, ...]:
        """The largest deviations of every part; none without a finished product."""
        if not self.products:
            return ()
        rows = zip(
            self.parts,
            1e3 * self.position,
            np.degrees(self.angle),
            1e3 * self.vertex,
            strict=True,
        )
        return tuple(Misplaced(part, float(p), float(a), float(v)) for part, p, a, v in rows)
