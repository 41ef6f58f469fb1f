"""What arms bring: parts from feeders, and sub-assemblies from the carriers that they are built on;
and where an arm's pad holds each."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from factory.api import Array, Factory, Operation, Product, Solid
from factory.apps.arms.body import PAD_RADIUS
from factory.apps.arms.chain import steiner
from factory.floor.geometry.suction import PadPlace, pad_place

SHARES = 0.45, 0.35, 0.25
"""Radii of pads as shares of a part's least extent in plan that are tried."""

BESIDE = 0.002
"""Between a pad and what is higher beside it [m]."""


@dataclass(frozen=True, eq=False)
class Burden:
    """What an arm brings on a tour.

    Attributes:
        label: of the operation in which it is taken: that of a part, or of a sub-assembly.
        parts: labels of its parts.
        product: that has them.
        source: the carrier (index) that it is taken from; None for a part from a feeder.
        onto: the carrier (index) on which it is placed.
        join: the operation in which it is.
        there: the parts that it is placed onto.
    """

    label: str
    parts: tuple[str, ...]
    product: Product
    source: int | None
    onto: int
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
    def held(self) -> str:
        """The part that a pad is on."""
        return self._grip[0]

    @property
    def pad(self) -> PadPlace:
        """Where the pad is on it."""
        return self._grip[1]

    @cached_property
    def _grip(self) -> tuple[str, PadPlace]:
        """The part and the place of the largest pad that is level, with nothing higher beside it;
        of the nearest to the centre of mass among equals."""
        every = [(solid, _largest_pad(solid)) for solid in self.solids]
        clear = [one for one in every if self._is_clear(one[1], one[0])]

        def rank(one: tuple[Solid, PadPlace]) -> tuple[bool, float, float]:
            _, place = one
            off = float(np.linalg.norm(place.at[:2] - self.centre[:2]))
            return not place.level, -round(place.radius, 4), off

        solid, place = min(clear or every, key=rank)
        return solid.label, place

    def _is_clear(self, place: PadPlace, of: Solid) -> bool:
        """Whether no other part is above a pad on one of them."""
        reach = place.radius + BESIDE
        low, high = place.at[:2] - reach, place.at[:2] + reach
        return not any(
            solid is not of
            and solid.high[2] > place.at[2]
            and (solid.low[:2] < high).all()
            and (solid.high[:2] > low).all()
            for solid in self.solids
        )


def burden_of(factory: Factory, product: Product, first: int) -> Burden:
    """What is brought on the tour of an arm that begins with an operation (index)."""
    takes, join = factory.operations[first], factory.operations[factory.parents[first]]
    source = next((robot for robot in takes.robots if robot != takes.carrier), None)
    parts = factory.contents[takes.label]
    there = frozenset(factory.contents[join.pile])
    return Burden(takes.label, tuple(parts), product, source, join.carrier, join, there)


def _largest_pad(solid: Solid) -> PadPlace:
    """The largest pad that a part is level under; one of the least share for none."""
    for share in SHARES:
        place = pad_place(solid, (1.0, 0.0), largest=PAD_RADIUS, share=share)
        if place.level:
            break
    return place
