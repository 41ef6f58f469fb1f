"""Overlaps of parts that are taken from the shapes, and pairs that are left out of contact.

Parts overlap a little where a model has no fits: pegs as wide as their holes, panels that reach
into each other. So that they are tested against each other all the same, the convex bodies that
collide are made smaller where they overlap, by half of it each, and no more. What is drawn, the
masses and the clearance are those of the whole shapes. Parts that overlap deeper, or are too thin
to become smaller, are left out.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import ceil
from types import MappingProxyType

from factory.floor.geometry.insets import breadth
from factory.floor.layout.layout import Layout
from factory.floor.mating.paths import TOLERANCE
from factory.theory.plant.approaches import Pair

LEFT = 0.5
"""A body keeps at least this share of its thickness."""

NONE: Mapping[int, float] = MappingProxyType({})


@dataclass(frozen=True)
class Insets:
    """How far [m] the faces of convex bodies recede, by part and number, in whole micrometres;
    `excluded`: pairs of parts between which there is no contact."""

    depths: Mapping[str, Mapping[int, float]] = field(default_factory=dict, repr=False)
    excluded: tuple[Pair, ...] = ()

    def of(self, part: str) -> Mapping[int, float]:
        """Those of a part."""
        return self.depths.get(part, NONE)


def insets_of(layout: Layout, overlap: float) -> Insets:
    """What is taken from the shapes of a layout's parts where they overlap by no more than
    `overlap` [m]; nothing where that is 0."""
    radii: dict[tuple[str, int], float] = {}

    def radius(part: str, number: int) -> float:
        """That of the largest ball in a convex body [m], of equal meshes found once."""
        solid = layout.product.solids[part]
        key = solid.mesh.name if solid.mesh else part, number
        if key not in radii:
            radii[key] = breadth(solid, number)
        return radii[key]

    depths: dict[str, dict[int, float]] = {}
    excluded: list[Pair] = []
    for overlapping in layout.overlaps:
        receding = [
            (part, number, ceil(far / 2 * 1e6 - 1e-3) / 1e6)
            for one, other, far in overlapping.bodies
            for part, number in zip(overlapping.parts, (one, other), strict=True)
        ]
        if (
            not overlap
            or overlapping.deep > overlap + TOLERANCE
            or any(half > (1 - LEFT) * radius(part, number) for part, number, half in receding)
        ):
            excluded.append(overlapping.parts)
            continue
        for part, number, half in (near for near in receding if near[2] > 0):
            mine = depths.setdefault(part, {})
            mine[number] = max(mine.get(number, 0.0), half)
    return Insets(depths, tuple(excluded))
