"""Solids as they are drawn, in their places: the volumes that they bound and share, and which
touch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from factory.floor.geometry.decomposition import can_decompose
from factory.floor.geometry.overlap import Common, drawn, overlap_of
from factory.floor.geometry.overlapping import DrawnOverlaps, near_pairs, overlaps_of
from factory.floor.geometry.solids import Product, Solid
from factory.floor.geometry.touching_groups import TouchingGroups, groups_of
from factory.support.arrays import Indices


@dataclass(frozen=True)
class DrawnSolids:
    """Solids as drawn, in one frame.

    Attributes:
        solids: the solids.
    """

    solids: Sequence[Solid]

    @staticmethod
    def body(solid: Solid) -> Any:
        """The volume that a part's surface bounds, as a `manifold3d.Manifold`, computed once; None
        for a mesh that bounds none."""
        return drawn(solid)

    @staticmethod
    def can_decompose() -> bool:
        """Whether open meshes can be represented by convex pieces here."""
        return can_decompose()

    @staticmethod
    def overlaps(product: Product) -> DrawnOverlaps:
        """The overlaps of all parts of a product, computed once."""
        return overlaps_of(product)

    @cached_property
    def bodies(self) -> list[Any]:
        """The volume of each solid; None for an open mesh."""
        return [*map(drawn, self.solids)]

    def near(self, gap: float) -> Indices:
        """The pairs (n, 2) of solids, by number, whose boxes are at most a gap apart [m]; with a
        negative gap, whose boxes overlap by at least as much."""
        return near_pairs(self.solids, gap)

    def common(self, one: int, other: int) -> Common:
        """The common volume of two solids (by number) that bound volumes, computed once."""
        return overlap_of(self.solids[one], self.solids[other])

    @property
    def groups(self) -> TouchingGroups:
        """The groups of solids that touch each other."""
        return groups_of(self.solids)
