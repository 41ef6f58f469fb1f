"""Grips: which robot holds which body, and where in its hand."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from factory.geometry.meshes import Array
from factory.layout.layout import Layout
from factory.layout.standby import Repertoire
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
    def position(self) -> Point3:
        """Where the body's centre of mass is, in the frame of the robot's carriage, or of its head
        [m]."""
        path = self.layout.guidepaths[self.robot]
        at, foot = path.middle(0.0), path.carriage(0.0)
        more = self.layout.shift(self.robot, self.begins)
        middle = (at[0] + more[0] - foot[0], at[1] + more[1] - foot[1])
        height = self.layout.held_at(self.robot, self.begins)
        return turned(place_in(self.layout.product, self.centre, middle, height), path.heading)


def grips_of(layout: Layout, bodies: FusedBodies) -> Iterator[Grip]:
    """All grips of a layout's robots on its bodies, robot by robot, with those of deputies."""
    whole = Repertoire.of(layout)
    every, factory = whole.layout, whole.layout.factory
    if every is not layout:
        bodies = bodies_of(factory, every.product, bool(bodies.wholes))
    for robot in range(len(factory.robots)):
        found = dict[str, str]()
        for label in bodies.handled(factory, robot):
            found.setdefault(whole.names[label], label)
        for name, label in found.items():
            begins, *_ = factory.tours[robot][factory.tour_with(robot, label)]
            yield Grip(robot, name, bodies.centre[label], every, begins)


def turned(v: Point3, heading: tuple[float, float]) -> Point3:
    """A vector of the world in a frame whose x is the heading."""
    u, w = heading
    return (v[0] * u + v[1] * w, -v[0] * w + v[1] * u, v[2])
