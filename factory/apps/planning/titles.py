"""Names that a person would give to sub-assemblies: what came last, and on what."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import count

import numpy as np

from factory.api import DrawnSolids
from factory.apps.planning.parts import InPlace, PlacedPart
from factory.support.arrays import Array

LONGEST = 40
"""The most letters of a name of two parts."""

INSIDE, SIDES = 0.8, 4
"""A part is in another if the box of that has so much of the volume of its box, and that surrounds
its middle on so many of six sides."""

MUCH = 20.0
"""A part whose box is so many times larger gives its name before that onto which others come."""


@dataclass
class Titles:
    """Gives each sub-assembly of a source a name that nothing else has; `taken`: those that are
    there."""

    source: InPlace
    taken: set[str]
    units: dict[str, tuple[PlacedPart, ...]] = field(init=False)

    def __post_init__(self) -> None:
        self.units = dict(self.source.units())

    def joined(self, piled: Sequence[str], came: Sequence[str]) -> str:
        """The name of a pile, by the units in it, the base first, onto which others came last:
        `lid_on_tub`, or for long names that of its biggest part. The biggest of what came is named,
        and the base of the pile, or its biggest where that is MUCH bigger, as it is behind a part
        that is MUCH smaller."""
        one, other = max(came, key=self._volume), max(piled, key=self._volume)
        if self._volume(other) < MUCH * self._volume(piled[0]):
            other = piled[0]
        if self._volume(one) > MUCH * self._volume(other):
            one, other = other, one
        name = f"{one}_{'in' if self._is_in(one, other) else 'on'}_{other}"
        if len(name) > LONGEST:
            every = (*piled, *came)
            name = f"{max(every, key=self._volume)}_with_{len(every) - 1}"
        return self.free(name)

    def passed(self, units: Sequence[str]) -> str:
        """The name of a sub-assembly that another robot takes over."""
        return self.free(f"{units[0]}_passed_on")

    def free(self, name: str) -> str:
        """A name or, if there is one like it, the name with a number; it is taken from now on."""
        names: Iterator[str] = (name if n == 1 else f"{name}-{n}" for n in count(1))
        label = next(name for name in names if name not in self.taken)
        self.taken.add(label)
        return label

    def _is_in(self, one: str, other: str) -> bool:
        """Whether a unit is in another, not only on or beside it."""
        (low, high), (bottom, top) = self._box(one), self._box(other)
        shared = np.prod(np.maximum(np.minimum(high, top) - np.maximum(low, bottom), 0.0))
        if shared < INSIDE * np.prod(high - low):
            return False
        bodies = [DrawnSolids.body(part.solid) for part in self.units[other]]
        middle, far = (low + high) / 2, float(np.linalg.norm(top - bottom))
        ends = [middle + far * way for way in (*np.eye(3), *-np.eye(3))]
        around = [any(b is not None and b.ray_cast(middle, end) for b in bodies) for end in ends]
        return None in bodies or sum(around) >= SIDES

    def _box(self, label: str) -> tuple[Array, Array]:
        solids = [part.solid for part in self.units[label]]
        return np.min([s.low for s in solids], axis=0), np.max([s.high for s in solids], axis=0)

    def _volume(self, label: str) -> float:
        low, high = self._box(label)
        return float(np.prod(high - low))
