"""How much room there is on the way of each operation of a product."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from factory.compiler.expanding import Node
from factory.compiler.mating.bodies import bodies
from factory.compiler.mating.meetings import Meeting, meetings
from factory.compiler.mating.overlaps import Finder
from factory.compiler.mating.paths import SIGNS
from factory.geometry.solids import Product
from factory.plant.approaches import Approach

AMPLE = 5e-3
"""More room than this [m] is not measured."""

UPRIGHT = 2
"""The axis z, along which inputs are lowered."""


def rooms(
    nodes: Mapping[str, Node], product: Product, chosen: Mapping[str, Approach]
) -> Mapping[str, float]:
    """The least room [m] between the inputs of each operation on the way that was chosen for it
    (from all of its `sides`), by its label: less than 0 where parts overlap, infinite where it is
    more than AMPLE. But for the last millimetre: finished parts may touch."""
    found = meetings(nodes)
    ways = [_way(meeting, chosen.get(meeting.label)) for meeting in found.all]
    least = np.full(len(found.all), np.inf)
    if not found.all:
        return {}
    finder = Finder(bodies(product, found.parts), found)
    for axis in range(3):
        wanted = np.array([way == axis for way, _ in ways])
        if not wanted.any():
            continue
        other, one, room = finder.rooms(axis, AMPLE)
        meeting = found.of(one, other)
        rows = np.flatnonzero(wanted[meeting] & (other >= found.splits[meeting]))
        sides = np.array([sides for _, sides in ways])[meeting[rows]]
        np.minimum.at(least, meeting[rows], np.where(sides, room[rows], np.inf).min(axis=1))
    least[least >= AMPLE] = np.inf
    labels = [meeting.label for meeting in found.all]
    return {label: float(r) for label, r in zip(labels, least, strict=True) if label in chosen}


def _way(meeting: Meeting, approach: Approach | None) -> tuple[int, tuple[bool, bool]]:
    """The axis, -1 for none, and from which of its sides the last input comes: what is lowered
    comes from above, so where that is another the last comes from below."""
    if approach is None:
        return -1, (False, False)
    if approach.kind == "lower":
        last = approach.lowered == meeting.inputs[-1]
        return UPRIGHT, (not last, last)
    low, high = (sign in approach.sides for sign in SIGNS)
    return approach.axis, (low, high)
