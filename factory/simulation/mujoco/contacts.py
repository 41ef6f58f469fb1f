"""Contact masks of parts by who holds them, and the pairs of parts left out.

Parts in the same hands are joined and ignore each other; everything else collides. A holder has a
code; a part in its hands has the code for its contype and the code's complement for its
conaffinity, so two parts collide exactly if their codes differ. The lowest bit is that of robots
and stations, which collide with every part. Masks are written on geoms *and* bodies: the broad
phase looks at those of bodies.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from factory.control.mode import Index, Truth
from factory.plant.approaches import Pair
from factory.support.engine import mujoco

NOBODY = 0
"""The code of no holder: such a part, a spare one out of sight, touches nothing."""

ALL = (1 << 30) - 1
"""All bits of a code."""

LAST = 2**32 - 1
"""The greatest of all signatures, which no pair has."""


class ContactMasks:
    """The masks and exclusions of a model, for parts whose bodies are given by label and copy.

    `code` and `unit` (nbody,): the holder of each part's body, or the code of a holder itself
    (`own`), and the unit that a part belongs to, -1 for none. `solid`: the geoms of each part's
    body that collide. `fresh`: holders that have been given something. `excluded`: pairs of labels
    whose parts of one unit do not collide.
    """

    def __init__(
        self, m: mujoco.MjModel, bodies: Mapping[str, Index], excluded: Sequence[Pair]
    ) -> None:
        self.code, self.unit = np.zeros(m.nbody, np.int64), np.full(m.nbody, -1)
        self._m, self._masks = m, np.array([m.body_contype, m.body_conaffinity])
        self.solid = {int(b): self._solid_geoms(int(b)) for ids in bodies.values() for b in ids}
        self._partners: dict[str, list[str]] = {}
        for one, other in excluded:
            self._partners.setdefault(one, []).append(other)
            self._partners.setdefault(other, []).append(one)
        self.fresh: set[int] = set()
        self._present: dict[tuple[str, int], int] = {}
        self._signatures: set[int] = set()

    def _solid_geoms(self, body: int) -> Index:
        """The geoms of a body that collide: all but those of group 1, which are shown in place of
        convex pieces."""
        geoms = self._m.body_geomadr[body] + np.arange(self._m.body_geomnum[body])
        return np.asarray(geoms[self._m.geom_group[geoms] != 1])

    def own(self, trees: Mapping[int, int], last: int) -> int:
        """Give what collides and is no part a code: that of its kinematic tree, or one of its own
        after the `last` where it is fixed to the floor. Gives the greatest code."""
        for body in np.flatnonzero(self._masks.any(axis=0)).tolist():
            if body not in self.solid:
                tree = int(self._m.body_treeid[body])
                last += tree not in trees
                self.code[body] = trees.get(tree, last)
        return last

    def look(self, seen: Truth) -> None:
        """Leave the bodies of all holders out of the broad phase but those that are `seen`
        (holders,), by code."""
        shown = seen[self.code]
        np.multiply(self._masks[0], shown, out=self._m.body_contype)
        np.multiply(self._masks[1], shown, out=self._m.body_conaffinity)

    def hold(self, holders: Mapping[int, int]) -> None:
        """From now on parts are each in the hands of a holder (its code), by body."""
        m = self._m
        for body, holder in holders.items():
            geoms = self.solid[body]
            contype = holder << 1
            conaffinity = 0 if holder == NOBODY else ((~holder & ALL) << 1) | 1
            self.code[body] = holder
            self.fresh.add(holder)
            self._masks[:, body] = contype, conaffinity
            m.body_contype[body], m.body_conaffinity[body] = contype, conaffinity
            m.geom_contype[geoms], m.geom_conaffinity[geoms] = contype, conaffinity

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
        engine merges the exclusions, a sorted list of unsigned numbers, with its sorted pairs; free
        slots are behind."""
        present = [self._present.get((partner, unit)) for partner in self._partners.get(label, ())]
        pairs = [sorted((body, other)) for other in present if other is not None]
        for low, high in pairs:
            (self._signatures.add if now else self._signatures.discard)((low << 16) + high)
        if pairs:
            listed = self._m.exclude_signature.view(np.uint32)
            listed[: len(self._signatures)] = sorted(self._signatures)
            listed[len(self._signatures) :] = LAST
