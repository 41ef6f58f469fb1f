"""Names that a person would give to sub-assemblies: what came last, and on what."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import count

import numpy as np

from factory.api import Array
from factory.apps.planning.parts import InPlace

LONGEST = 40
"""The most letters of a name of two parts."""

INSIDE = 0.8
"""A part is in another if the box of that has so much of the volume of its box."""


@dataclass
class Titles:
    """Gives each sub-assembly of a source a name that nothing else has; `taken`: those that are
    there."""

    source: InPlace
    taken: set[str]
    boxes: dict[str, tuple[Array, Array]] = field(init=False)

    def __post_init__(self) -> None:
        self.boxes = {part.label: (part.solid.low, part.solid.high) for part in self.source.parts}

    def joined(self, piled: Sequence[str], came: Sequence[str]) -> str:
        """The name of a pile, by the units in it, onto which others came last; the base of each
        comes first: `lid_on_tub`, or for long names that of its biggest part."""
        name = f"{came[0]}_{self._where(came[0], piled[0])}_{piled[0]}"
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

    def _where(self, come: str, pile: str) -> str:
        """Whether a part is in another, or on it."""
        if come not in self.boxes or pile not in self.boxes:
            return "on"
        (low, high), (bottom, top) = self.boxes[come], self.boxes[pile]
        shared = np.prod(np.maximum(np.minimum(high, top) - np.maximum(low, bottom), 0.0))
        return "in" if shared >= INSIDE * np.prod(high - low) else "on"

    def _volume(self, label: str) -> float:
        low, high = self.boxes.get(label, (np.zeros(3), np.zeros(3)))
        return float(np.prod(high - low))
