"""How strictly the inputs of each operation can come together along either axis, whoever holds the
pile: what the choice of forms goes by."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from factory.compiler.expanding import Node
from factory.compiler.mating.bodies import bodies
from factory.compiler.mating.findings import STRICT
from factory.compiler.mating.mating import UPRIGHT, levels_of
from factory.compiler.mating.meetings import meetings
from factory.compiler.mating.overlaps import Finder
from factory.geometry.solids import Product


@dataclass(frozen=True, slots=True)
class Admitted:
    """The best levels (`findings`) of one operation: its inputs `slides` along x and y from the
    better side; the first, or the last of them is lowered (`lowers`)."""

    slides: tuple[int, int] = (STRICT, STRICT)
    lowers: tuple[int, int] = (STRICT, STRICT)


def admitted(nodes: Mapping[str, Node], product: Product) -> Mapping[str, Admitted]:
    """What each operation with two inputs or more admits, by its label. As costly as `matings`
    twice."""
    found = meetings(nodes)
    if not found.all:
        return {}
    finder, count = Finder(bodies(product, found.parts), found), len(found.all)
    every = np.ones(count, bool)
    slides = [levels_of(finder.along(axis, every), count)[0].max(axis=1) for axis in (0, 1)]
    lowers = levels_of(finder.along(UPRIGHT, every), count)[0]
    rows = zip(found.all, *(s.tolist() for s in slides), lowers.tolist(), strict=True)
    return {m.label: Admitted((x, y), (first, last)) for m, x, y, (first, last) in rows}
