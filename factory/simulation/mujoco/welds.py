"""The welds that a run switches, and bodies that it places: all changes between two steps of the
engine, gathered and written at once."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from factory.control.mode import Array
from factory.simulation.mujoco.contacts import ContactMasks
from factory.simulation.mujoco.pad_gaps import PadGaps
from factory.simulation.mujoco.sleep import Sleep
from factory.simulation.mujoco.takeovers import Takeovers
from factory.support.engine import mujoco

Place = tuple[float, float, float]


@dataclass(slots=True)
class Gathered:
    """What is to be switched `on` and `off` (welds, the former with the bodies that they hold), of
    these what takes bodies over (`gripped`), who has what (`held`), and what is put where."""

    on: dict[int, int] = field(default_factory=dict)
    off: set[int] = field(default_factory=set)
    gripped: dict[int, int] = field(default_factory=dict)
    held: dict[int, int] = field(default_factory=dict)
    placed: dict[int, Place] = field(default_factory=dict)


class Welds:
    """Gathers what is to be switched until `write`; the last that is said of a weld or body counts.

    `radii` (nbody,): how far vertices are from their body's origin [m]; `taken`: what was measured
    of bodies that were taken over; `pads`: how far holders' pads were from them; `closed`: when a
    weld was switched on last [s].
    """

    def __init__(
        self, m: mujoco.MjModel, d: mujoco.MjData, masks: ContactMasks, sleep: Sleep, radii: Array
    ) -> None:
        self.masks = masks
        self._m, self._d, self._sleep = m, d, sleep
        mujoco.mj_kinematics(m, d)
        self.taken = Takeovers(m, d, radii)
        self.pads = PadGaps(m, d)
        self.closed = -np.inf
        self._next = Gathered()
        self._bent: dict[int, Array] = {}

    def loose(self, welds: Iterable[int]) -> None:
        """Switch welds off."""
        for weld in welds:
            self._next.on.pop(weld, None)
            self._next.gripped.pop(weld, None)
            self._next.off.add(weld)

    def join(self, welds: Mapping[int, int]) -> None:
        """Switch welds on, each aimed at a body."""
        self._next.on.update(welds)

    def grip(self, welds: Mapping[int, int]) -> None:
        """Close welds that take bodies over: their gaps are measured."""
        self.join(welds)
        self._next.gripped.update(welds)

    def hold(self, bodies: Iterable[int], holder: int) -> None:
        """Put parts into the hands of a holder (code)."""
        self._next.held.update(dict.fromkeys(bodies, holder))

    def place(self, body: int, at: Place) -> None:
        """Place a free body [m], at rest, in the orientation in which it is presented."""
        self._next.placed[body] = at

    def bend(self, weld: int, place: Array) -> None:
        """A weld holds its body at another place in its holder (7,), until it is switched on anew,
        or straightened."""
        self._bent.setdefault(weld, self._m.eq_data[weld, 3:10].copy())
        self._m.eq_data[weld, 3:10] = place

    def straighten(self, welds: Iterable[int]) -> None:
        """Welds hold their bodies where they should."""
        for weld in self._bent.keys() & welds:
            self._m.eq_data[weld, 3:10] = self._bent.pop(weld)

    def turn(self, body: int, quaternion: Array, aside: Array) -> None:
        """Turn a free body, displaced by `aside` (3,) [m]."""
        address = self._m.jnt_qposadr[self._m.body_jntadr[body]]
        self._d.qpos[address : address + 3] += aside
        self._d.qpos[address + 3 : address + 7] = quaternion
        self._d.xquat[body] = quaternion
        self._sleep.wake([body])

    def write(self) -> None:
        """Write all gathered changes into the engine, and wake the bodies concerned."""
        if self._next == Gathered():
            return
        self.straighten(self._next.on)
        self._put()
        self.pads.measure(self._next.on)
        if self._next.gripped:
            welds, bodies = np.array([*self._next.gripped.items()]).T
            self.taken.measure(welds, bodies)
        m, d = self._m, self._d
        off, on = np.array([*self._next.off], np.intp), np.array([*self._next.on], np.intp)
        bodies = np.array([*self._next.on.values()], np.intp)
        touched = [m.eq_obj1id[off], m.eq_obj2id[off], m.eq_obj1id[on], bodies]
        d.eq_active[off] = False
        m.eq_obj2id[on], d.eq_active[on] = bodies, True
        if len(on):
            self.closed = float(d.time)
        self._sleep.wake({*np.concatenate(touched).tolist(), *self._next.placed})
        self.masks.hold(self._next.held)
        self._next = Gathered()

    def _put(self) -> None:
        """Place bodies; `xpos` too, which the engine renews in its next step."""
        if not self._next.placed:
            return
        bodies, at = np.array([*self._next.placed]), np.array([*self._next.placed.values()])
        joint, d = self._m.body_jntadr[bodies], self._d
        address = self._m.jnt_qposadr[joint][:, None] + np.arange(7)
        d.qpos[address] = np.hstack([at, self._m.qpos0[address[:, 3:]]])
        d.qvel[self._m.jnt_dofadr[joint][:, None] + np.arange(6)] = 0.0
        d.xpos[bodies] = at
