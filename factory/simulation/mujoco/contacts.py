"""Who may touch whom: contact masks of parts by who holds them, and the pairs of parts left out.

Parts in the same hands are joined and ignore each other; everything else collides. A holder has a
code; a part in its hands has the code for its contype and the code's complement for its
conaffinity, so two parts collide exactly if their codes differ. The lowest bit is that of robots
and stations, which collide with every part. Written on geoms *and* bodies: the broad phase looks at
those of bodies, and `vicinity` takes bodies out of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from factory.control.mode import Index
from factory.plant.approaches import Pair
from factory.support.engine import mujoco

NOBODY = 0
"""The code of no holder: such a part, a spare one out of sight, touches nothing."""

ALL = (1 << 30) - 1
"""All bits of a code."""


LAST = 2**32 - 1
"""The greatest of all signatures, which no pair has."""


class Contacts:
    """The masks and exclusions of a model, for parts whose bodies are given by label and copy.

    `code` and `unit` (nbody,): the holder of each part's body, or who a holder is itself (`own`),
    and the unit a part belongs to, -1 for none. `contype` and `conaffinity` (nbody,): the masks of
    bodies. `excluded`: pairs of labels whose parts of one unit do not collide.
    """

    def __init__(
        self, m: mujoco.MjModel, bodies: Mapping[str, Index], excluded: Sequence[Pair]
    ) -> None:
        self.m = m
        self.code = np.zeros(m.nbody, np.int64)
        self.unit = np.full(m.nbody, -1)
        self.contype, self.conaffinity = m.body_contype.copy(), m.body_conaffinity.copy()
        self.solid = {int(b): self._solid(int(b)) for ids in bodies.values() for b in ids}
        self._geoms = {body: geoms.tolist() for body, geoms in self.solid.items()}
        self._of_geoms = memoryview(m.geom_contype), memoryview(m.geom_conaffinity)
        masks = self.contype, m.body_contype, self.conaffinity, m.body_conaffinity
        self._of_bodies = tuple(values.data for values in (self.code, *masks))
        self.partners: dict[str, list[str]] = {}
        for one, other in excluded:
            self.partners.setdefault(one, []).append(other)
            self.partners.setdefault(other, []).append(one)
        self._present: dict[tuple[str, int], int] = {}
        self._signatures: set[int] = set()

    def _solid(self, body: int) -> Index:
        """The geoms of a body that collide: all but those of group 1, which are shown in place of
        convex pieces."""
        geoms = self.m.body_geomadr[body] + np.arange(self.m.body_geomnum[body])
        return np.asarray(geoms[self.m.geom_group[geoms] != 1])

    def hold(self, holders: Mapping[int, int]) -> None:
        """From now on parts are each in the hands of a holder (its code), by body."""
        contype, conaffinity = self._of_geoms
        code, own_type, type_, own_affinity, affinity = self._of_bodies
        for body, holder in holders.items():
            code[body] = holder
            own, others = self._masks[holder]
            own_type[body] = type_[body] = own
            own_affinity[body] = affinity[body] = others
            for geom in self._geoms[body]:
                contype[geom], conaffinity[geom] = own, others

    @property
    def collides(self) -> NDArray[np.bool_]:
        """Which bodies can collide with anything (nbody,)."""
        return np.asarray((self.contype | self.conaffinity) != 0)

    def own(self, trees: Mapping[int, int], holders: int) -> int:
        """Give what collides and is no part its own code, and tell how many codes there are then.
        `trees`: the code, of 1 to `holders`, of each kinematic tree of a robot or the tray; what is
        fixed to the floor gets one of its own."""
        for body in self.collides.nonzero()[0].tolist():
            if body not in self.solid:
                fixed = (tree := int(self.m.body_treeid[body])) not in trees
                holders += fixed
                self.code[body] = holders if fixed else trees[tree]
        self._masks = [(code << 1, ((~code & ALL) << 1) | 1) for code in range(holders + 1)]
        self._masks[NOBODY] = 0, 0
        return holders

    def enter(self, label: str, unit: int, body: int) -> None:
        """A part's body comes into the factory, for a unit."""
        self.unit[body] = unit
        self._present[label, unit] = body
        self._exclude(label, unit, body, True)

    def leave(self, label: str, unit: int) -> None:
        """A part's body leaves the factory with its unit."""
        body = self._present.pop((label, unit))
        self._exclude(label, unit, body, False)
        self.unit[body] = -1

    def _exclude(self, label: str, unit: int, body: int, now: bool) -> None:
        """Leave out, or no longer, the pairs of a part with those of its unit that are there. The
        engine reads the exclusions as one sorted list of unsigned numbers, from its beginning for
        every pair that is near: what is free of it is behind."""
        changed = False
        for partner in self.partners.get(label, ()):
            other = self._present.get((partner, unit))
            if other is not None:
                low, high = sorted((body, other))
                (self._signatures.add if now else self._signatures.discard)((low << 16) + high)
                changed = True
        if changed:
            listed = self.m.exclude_signature.view(np.uint32)
            listed[: len(self._signatures)] = sorted(self._signatures)
            listed[len(self._signatures) :] = LAST
