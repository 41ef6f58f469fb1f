"""What is switched between two steps of the engine: welds, who holds what, and bodies put
somewhere; all at once.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from factory.simulation.mujoco.contacts import Contacts
from factory.simulation.mujoco.fast.broad_phase import Vicinity
from factory.simulation.mujoco.fast.memory import BYTES, PLACE, writer
from factory.simulation.mujoco.gaps import Gaps
from factory.support.engine import mujoco

AWAKE = -0.0
"""Written over a speed of zero it wakes a sleeping body and changes nothing else."""

FRESH = -1 - int(mujoco.mjMINAWAKE)
"""What the engine has for a tree that has just begun to be slow."""

Place = tuple[float, float, float]


class Switchboard:
    """Gathers what is to be switched until `write`; what is said last of a weld or a body holds."""

    def __init__(
        self, m: mujoco.MjModel, d: mujoco.MjData, contacts: Contacts, vicinity: Vicinity
    ) -> None:
        self.contacts, self.vicinity, self.gaps = contacts, vicinity, Gaps(m, d)
        self._tree = np.where(m.body_dofnum > 0, m.body_treeid, -1).tolist()
        self._dof, self._holder = m.body_dofadr.tolist(), m.eq_obj1id.tolist()
        self._qpos = np.where(m.body_jntnum > 0, m.jnt_qposadr[m.body_jntadr], -1).tolist()
        self._aim, self._active = memoryview(m.eq_obj2id), memoryview(d.eq_active)
        self._asleep = memoryview(d.tree_asleep)
        self._speed, self._set_speed = d.qvel.data, writer(d.qvel, 6)
        self._set_pose, self._set_place = writer(d.qpos, 7), writer(d.xpos, 3)
        self._on: dict[int, int] = {}
        self._off: set[int] = set()
        self._gripped: list[int] = []
        self._held: dict[int, int] = {}
        self._placed: dict[int, Place] = {}

    def loose(self, welds: Iterable[int]) -> None:
        """Switch welds off; the bodies they joined are woken."""
        for weld in welds:
            self._on.pop(weld, None)
            self._off.add(weld)

    def join(self, welds: Iterable[int], bodies: Iterable[int]) -> None:
        """Switch welds on, each aimed at a body first; the bodies they join are woken."""
        self._on.update(zip(welds, bodies, strict=True))

    def grip(self, welds: Sequence[int], bodies: Sequence[int]) -> None:
        """Switch welds on that take bodies over: their gaps are measured."""
        self.join(welds, bodies)
        self._gripped += welds

    def hold(self, bodies: Iterable[int], holder: int) -> None:
        """From now on parts are in the hands of a holder (its code)."""
        self._held.update(dict.fromkeys(bodies, holder))

    def place(self, bodies: Iterable[int], at: Iterable[Place]) -> None:
        """Put free bodies somewhere [m], upright and at rest."""
        self._placed.update(zip(bodies, at, strict=True))

    def write(self) -> int:
        """Let the engine know. Gives how many bodies have been taken over."""
        if not (self._on or self._off or self._held or self._placed):
            return 0
        self._put()
        gripped = len(self._gripped)
        if gripped:
            self.gaps.note(self._gripped, [self._on[weld] for weld in self._gripped])
        aim, active = self._aim, self._active
        touched = {self._holder[weld] for weld in (*self._off, *self._on)}
        for weld in self._off:
            active[weld] = False
            touched.add(aim[weld])
        for weld, body in self._on.items():
            aim[weld], active[weld] = body, True
            touched.add(body)
        self.wake(touched)
        self.contacts.hold(self._held)
        for gathered in (self._on, self._off, self._gripped, self._held, self._placed):
            gathered.clear()
        return gripped

    def _put(self) -> None:
        """Put bodies where they belong."""
        for body, at in self._placed.items():
            self._set_pose(BYTES * self._qpos[body], *at, 1.0, 0.0, 0.0, 0.0)
            self._set_place(PLACE * body, *at)
            self._set_speed(BYTES * self._dof[body], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        self.vicinity.woken(self._placed)

    def wake(self, bodies: Iterable[int]) -> None:
        """Wake bodies that sleep, and let those that are about to, being slow, wait as long
        again."""
        asleep, speed = self._asleep, self._speed
        woken: list[int] = []
        for body in bodies:
            tree = self._tree[body]
            if tree < 0:
                continue
            if asleep[tree] < 0:
                asleep[tree] = FRESH
                continue
            dof = self._dof[body]
            if speed[dof] == 0.0:
                speed[dof] = AWAKE
            woken.append(body)
        self.vicinity.woken(woken)
