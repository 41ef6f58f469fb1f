"""Grips: which robot holds which body, and where in its hand."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from factory.geometry.meshes import Array
from factory.layout.layout import Layout
from factory.layout.visits import Visit
from factory.mjcf.parts import place_in
from factory.plant.fused_bodies import FusedBodies, bodies_of

Point3 = tuple[float, float, float]


@dataclass(frozen=True, eq=False, slots=True)
class Grip:
    """A robot (index) holds a body, by its `label` in the factory, with its `centre` (3,) of mass
    [m], on a tour that begins with an operation (index) of a `layout` that has it."""

    robot: int
    label: str
    centre: Array
    layout: Layout
    begins: int

    @property
    def visit(self) -> Visit:
        """The first visit of the tour."""
        return self.layout.visits[self.begins, self.robot]

    @property
    def position(self) -> Point3:
        """Where the body's centre of mass is, in the frame of the robot's carriage, or of its head
        [m]."""
        path = self.layout.guidepaths[self.robot]
        at, foot = path.middle(0.0), path.carriage(0.0)
        (x, y), height = self.visit.shift, self.visit.height
        middle = (at[0] + x - foot[0], at[1] + y - foot[1])
        return turned(place_in(self.layout.product, self.centre, middle, height), path.heading)


def grips_of(layout: Layout, bodies: FusedBodies) -> Iterator[Grip]:
    """All grips of a layout's robots on its bodies, robot by robot, with those of deputies."""
    every, factory = layout.whole, layout.whole.factory
    if every is not layout:
        bodies = bodies_of(factory, every.product, bool(bodies.wholes))
    for robot in range(len(factory.robots)):
        found = dict[str, str]()
        for label in bodies.handled(factory, robot):
            found.setdefault(layout.named(label), label)
        for name, label in found.items():
            begins, *_ = factory.tours[robot][factory.tour_with(robot, label)]
            yield Grip(robot, name, bodies.centre[label], every, begins)


def turned(v: Point3, heading: tuple[float, float]) -> Point3:
    """A vector of the world in a frame whose x is the heading."""
    u, w = heading
    return (v[0] * u + v[1] * w, -v[0] * w + v[1] * u, v[2])
