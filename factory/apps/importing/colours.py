"""Colours of parts that have none: a restrained palette by size, and steel for fasteners.

The largest kind is as light as a housing, the next dark, the others muted, so that each is told
from its neighbours and none shouts.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

Colour = tuple[float, float, float, float]

PALETTE: tuple[Colour, ...] = (
    (0.84, 0.845, 0.85, 1.0),
    (0.23, 0.25, 0.28, 1.0),
    (0.35, 0.46, 0.58, 1.0),
    (0.76, 0.68, 0.55, 1.0),
    (0.25, 0.46, 0.46, 1.0),
    (0.66, 0.38, 0.29, 1.0),
    (0.51, 0.53, 0.38, 1.0),
    (0.44, 0.40, 0.52, 1.0),
)
"""From the largest kind to the smallest, again from the third on."""

STEEL: Colour = (0.70, 0.715, 0.735, 1.0)

FASTENER = re.compile(
    r"(?i)(^|[^a-z])(screw|bolt|nut|washer|rivet|stud|dowel|pin|spring|circlip|bearing)s?(?![a-z])"
)
"""Names of what is of steel."""

MANY, SMALL = 3, 0.15
"""Kinds of at least so many parts that are smaller than this share of the product are fasteners."""


@dataclass(frozen=True, slots=True)
class PartKind:
    """A kind of parts: the names of its parts, and its size as a share of the product's."""

    names: tuple[str, ...]
    size: float

    @property
    def is_fastener(self) -> bool:
        """Whether it is of steel."""
        many = len(self.names) >= MANY and self.size < SMALL
        return many or any(FASTENER.search(name) for name in self.names)


def colours_by_size(kinds: Mapping[int, PartKind]) -> dict[int, Colour]:
    """The colour of each kind."""
    others = [number for number, kind in kinds.items() if not kind.is_fastener]
    others.sort(key=lambda number: -kinds[number].size)
    chosen = dict.fromkeys(kinds, STEEL)
    for rank, number in enumerate(others):
        again = 2 + (rank - 2) % (len(PALETTE) - 2)
        chosen[number] = PALETTE[rank if rank < 2 else again]
    return chosen


def kinds_of(
    kinds: Sequence[int], names: Sequence[str], sizes: Sequence[float], whole: float
) -> dict[int, PartKind]:
    """The kinds of parts by number, from those and the names and sizes of the parts."""
    members: dict[int, list[int]] = {}
    for part, kind in enumerate(kinds):
        members.setdefault(kind, []).append(part)
    return {
        kind: PartKind(tuple(names[part] for part in parts), sizes[parts[0]] / whole)
        for kind, parts in members.items()
    }
