"""The rigid bodies that sub-assemblies become once their parts are joined for good, and the solids
of parts for each unit of a period."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import product as pairs
from types import MappingProxyType

import numpy as np

from factory.floor.geometry.meshes import sound
from factory.floor.geometry.solids import Product
from factory.support.arrays import Array
from factory.theory.plant.factory import Factory
from factory.theory.problem.pag import NOPART

Inside = tuple[str, str]
"""Labels of a body and of a part that it has."""


@dataclass(frozen=True, slots=True)
class Whole:
    """A sub-assembly as one rigid body, in the frame of the finished product: the labels of its
    `parts`, and their common `mass` [kg], `centre` (3,) of mass [m] and `inertia` (3, 3) about it
    [kg m²]."""

    label: str
    parts: tuple[str, ...]
    mass: float
    centre: Array = field(repr=False)
    inertia: Array = field(repr=False)


@dataclass(frozen=True)
class FusedBodies:
    """What bodies a run has: one a part, or (`wholes` not empty) one a sub-assembly too.

    `carried`: for each label that is carried, the labels of the bodies it consists of; of each
    body, by its label: `centre` (3,) of mass [m], `mass` [kg], and `radius`, no less than how far
    any vertex is from there [m]. A sub-assembly that is only worked upon stays the
    body that it is.
    """

    carried: Mapping[str, tuple[str, ...]]
    centre: Mapping[str, Array] = field(repr=False)
    mass: Mapping[str, float] = field(repr=False)
    radius: Mapping[str, float] = field(repr=False)
    wholes: Mapping[str, Whole]

    def __post_init__(self) -> None:
        for name in ("carried", "centre", "mass", "radius", "wholes"):
            object.__setattr__(self, name, MappingProxyType(dict(getattr(self, name))))

    def parts(self, body: str) -> tuple[str, ...]:
        """The parts that a body is."""
        return self.wholes[body].parts if body in self.wholes else (body,)

    def handled(self, factory: Factory, robot: int) -> tuple[str, ...]:
        """The bodies that a robot (index) ever holds: what it delivers, and what it is made of."""
        if not self.wholes:
            labels = factory.deliveries(robot)
            return tuple(body for label in labels for body in self.carried[label])
        bodies: dict[str, None] = {}
        for number in factory.robots[robot].operations:
            operation = factory.operations[number]
            if operation.carrier == robot and operation.label in self.carried:
                for label in (*operation.inputs, operation.label):
                    bodies.update(dict.fromkeys(self.carried[label]))
        return tuple(bodies)

    def meeting(self, factory: Factory, pair: tuple[str, str]) -> list[tuple[Inside, Inside]]:
        """Two parts, each with a body that it may belong to as the operation begins that joins
        them: the body that its input becomes, or one of those that have not yet become it."""
        if not self.wholes:
            return [((pair[0], pair[0]), (pair[1], pair[1]))]
        ways = [_way(factory, part) for part in pair]
        common = {*ways[0]} & {*ways[1]}
        bodies = [
            dict.fromkeys(
                (self.carried[factory.operations[number].label][0], part)
                for number in way
                if number not in common
            )
            for way, part in zip(ways, pair, strict=True)
        ]
        one, other = ([*inside][-2:] for inside in bodies)
        return [*pairs(one, other)]


def bodies_of(factory: Factory, product: Product, fuse: bool = False) -> FusedBodies:
    """The bodies of a factory's run; with `fuse`, or where it `takes_wholes`, every operation with
    two inputs or more makes one of its own. Mass and inertia add up from the inputs, so this is
    linear in the labels, but for the lists of parts."""
    solids = product.solids
    centre = {label: solid.centre for label, solid in solids.items()}
    mass = {label: solid.mass for label, solid in solids.items()}
    radius = {
        label: float(np.linalg.norm(solid.corners - solid.centre, axis=1).max())
        for label, solid in solids.items()
    }
    if not (fuse or factory.takes_wholes):
        return FusedBodies(factory.contents, centre, mass, radius, {})
    inertia = {label: solid.inertia for label, solid in solids.items()}
    carried: dict[str, tuple[str, ...]] = {}
    wholes: dict[str, Whole] = {}
    for operation in reversed(factory.making):
        label, inputs = operation.label, [carried[i][0] for i in operation.inputs]
        if len(inputs) < 2:
            carried[label] = (inputs[0] if inputs else label,)
            continue
        carried[label] = (label,)
        mass[label] = sum(mass[i] for i in inputs)
        centre[label] = np.asarray(sum(mass[i] * centre[i] for i in inputs) / mass[label])
        away = [(mass[i], centre[i] - centre[label]) for i in inputs]
        inertia[label] = sum((inertia[i] for i in inputs), np.zeros((3, 3)))
        inertia[label] = inertia[label] + sum(
            m * (r @ r * np.eye(3) - np.outer(r, r)) for m, r in away
        )
        reach = (float(np.linalg.norm(r)) for _, r in away)
        radius[label] = max(radius[i] + r for i, r in zip(inputs, reach, strict=True))
        parts = factory.contents[label]
        wholes[label] = Whole(label, parts, mass[label], centre[label], sound(inertia[label]))
    return FusedBodies(carried, centre, mass, radius, wholes)


def fused_copies(bodies: FusedBodies, factory: Factory, units: int | None) -> dict[str, int]:
    """How many copies of each body a fused run needs: of a part one in its feeder and one with its
    robot, or not yet fused; of a sub-assembly one with its robot; of the product a further one on
    the outfeed's tray; of what is relayed a further one with each further robot."""
    copies = {operation.label: 2 for operation in factory.leaves}
    roots = {body for label in factory.products for body in bodies.carried[label]}
    copies |= {label: 2 if label in roots else 1 for label in bodies.wholes}
    for operation in factory.making:
        carrier = operation.template.carrier - 1
        if len(operation.inputs) == 1 and operation.before[carrier] == NOPART:
            copies[bodies.carried[operation.label][0]] += 1
    most = max(copies.values()) if units is None else units
    return {label: min(number, most) for label, number in copies.items()}


def _way(factory: Factory, part: str) -> list[int]:
    """The operations (index) that a part goes through, its own first."""
    way, number = list[int](), factory.by_label[part].index
    while number >= 0:
        way.append(number)
        number = factory.parents[number]
    return way
