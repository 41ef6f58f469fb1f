"""What arms bring: parts from feeders, and sub-assemblies from the carriers that they are built on;
from where each comes to its place, and where an arm's pad holds it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from factory.api import Factory, Operation, Product, Solid
from factory.apps.arms.chain import steiner
from factory.apps.arms.holds import UP, Hold, holds
from factory.support.arrays import Array


@dataclass(frozen=True, eq=False)
class Burden:
    """What an arm brings on a tour.

    Attributes:
        label: of the operation in which it is taken: that of a part, or of a sub-assembly.
        parts: labels of its parts.
        product: that has them.
        source: the carrier (index) that it is taken from; None for a part from a feeder.
        onto: the carrier (index) on which it is placed.
        takes: the operation in which it is taken.
        join: that in which it is placed.
        there: the parts that it is placed onto.
    """

    label: str
    parts: tuple[str, ...]
    product: Product
    source: int | None
    onto: int
    takes: Operation
    join: Operation
    there: frozenset[str]

    @cached_property
    def solids(self) -> tuple[Solid, ...]:
        """Its parts as solids."""
        return tuple(self.product.solids[part] for part in self.parts)

    @cached_property
    def low(self) -> Array:
        """Lower corner of its bounding box, in the product (3,) [m]."""
        return np.asarray(np.min([solid.low for solid in self.solids], axis=0))

    @cached_property
    def high(self) -> Array:
        """Upper corner (3,) [m]."""
        return np.asarray(np.max([solid.high for solid in self.solids], axis=0))

    @cached_property
    def mass(self) -> float:
        """Of all of it [kg]."""
        return float(sum(solid.mass for solid in self.solids))

    @cached_property
    def centre(self) -> Array:
        """Its centre of mass (3,) [m]."""
        moment = sum((solid.mass * solid.centre for solid in self.solids), np.zeros(3))
        return np.asarray(moment / self.mass)

    @cached_property
    def inertia(self) -> Array:
        """Its inertia tensor about that (3, 3) [kg m²]."""
        about = (s.inertia + steiner(s.mass, s.centre - self.centre) for s in self.solids)
        return np.asarray(sum(about, np.zeros((3, 3))))

    @property
    def fed(self) -> float:
        """Angle about the vertical by which it is turned where it is taken [rad]."""
        return self.solids[0].fed if self.source is None else 0.0

    @property
    def stops(self) -> dict[int | None, Operation]:
        """By carriers (index) the operation in which an arm places it on that, or takes it."""
        return {self.onto: self.join, self.source: self.takes}

    @property
    def comes(self) -> Array:
        """The direction from which it comes to its place (3,): from above, or from a side."""
        approach = self.join.approach
        if approach is None or self.join.lowered >= 0:
            return UP
        (side,) = approach.sides
        return np.asarray(side * np.eye(3)[approach.axis])

    def reach(self, along: Array, parts: Iterable[str]) -> float:
        """How far some parts of the product reach along a direction (3,), an axis [m]."""
        solids = [self.product.solids[part] for part in parts]
        return max(float(along @ end) for solid in solids for end in (solid.low, solid.high))

    @cached_property
    def hold(self) -> Hold:
        """The pad on top; of what comes from a side that on top or behind, whichever its weight
        needs less of."""
        there = [self.product.solids[part] for part in sorted(self.there)]
        normals = [UP] if self.comes is UP else [UP, self.comes]
        best = [holds(self.solids, there, self.centre, normal)[0] for normal in normals]
        free = [one for one in best if one.clear and one.pad.level]
        if not free:
            return best[-1]
        return min(free, key=lambda one: one.used(self.mass, self.centre))


def burden_of(factory: Factory, product: Product, first: int) -> Burden:
    """What is brought on the tour of an arm that begins with an operation (index)."""
    takes, join = factory.operations[first], factory.operations[factory.parents[first]]
    source = next((robot for robot in takes.robots if robot != takes.carrier), None)
    parts = factory.contents[takes.label]
    there = frozenset(factory.contents[join.pile])
    return Burden(takes.label, tuple(parts), product, source, join.carrier, takes, join, there)
