"""What is switched between two steps of the engine: welds, who holds what, and bodies put
somewhere; all at once."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from factory.control.mode import Index
from factory.engine import mujoco
from factory.world.contacts import Contacts
from factory.world.gaps import Gaps
from factory.world.vicinity import Vicinity

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
        self.m, self.d, self.contacts, self.vicinity = m, d, contacts, vicinity
        self._tree = np.where(m.body_dofnum > 0, m.body_treeid, -1)
        self._dof = m.body_dofadr.copy()
        self._holder = m.eq_obj1id.tolist()
        self.gaps = Gaps(m, d)
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
        m, d, on, off = self.m, self.d, [*self._on], [*self._off]
        self._put()
        gripped = len(self._gripped)
        if gripped:
            self.gaps.note(self._gripped, [self._on[weld] for weld in self._gripped])
        if on or off:
            touched = [*self._on.values(), *m.eq_obj2id[off].tolist()]
            touched += [self._holder[weld] for weld in (*on, *off)]
            m.eq_obj2id[on] = touched[: len(on)]
            d.eq_active[off] = False
            d.eq_active[on] = True
            self.wake(np.array(touched))
        if self._held:
            self.contacts.hold(_listed(self._held), _listed(self._held.values()))
        for gathered in (self._on, self._off, self._gripped, self._held, self._placed):
            gathered.clear()
        return gripped

    def _put(self) -> None:
        """Put bodies where they belong."""
        if not self._placed:
            return
        m, d, bodies = self.m, self.d, _listed(self._placed)
        joint, at = m.body_jntadr[bodies], np.array(list(self._placed.values()))
        q, v = m.jnt_qposadr[joint], m.jnt_dofadr[joint]
        d.qpos[q[:, None] + np.arange(3)] = d.xpos[bodies] = at
        d.qpos[q[:, None] + np.arange(3, 7)] = 1.0, 0.0, 0.0, 0.0
        d.qvel[v[:, None] + np.arange(6)] = 0.0
        self.vicinity.woken(bodies)

    def wake(self, bodies: Index) -> None:
        """Wake bodies that sleep, and let those that are about to, being slow, wait as long
        again."""
        tree, asleep, speed = self._tree[bodies], self.d.tree_asleep, self.d.qvel
        movable = tree >= 0
        bodies, tree = bodies[movable], tree[movable]
        sleeps = asleep[tree] >= 0
        asleep[tree[~sleeps]] = FRESH
        bodies = bodies[sleeps]
        if len(bodies):
            dof = self._dof[bodies]
            speed[dof[speed[dof] == 0.0]] = AWAKE
            self.vicinity.woken(bodies)


def _listed(numbers: Iterable[int]) -> Index:
    return np.array([*numbers], np.intp)
