"""Grips: which robot holds which body, and where in its hand."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from factory.engine.mjcf.parts import place_in
from factory.engine.mjcf.robots import heading_quaternion
from factory.floor.geometry.fused_bodies import FusedBodies
from factory.floor.geometry.turning import fed_of
from factory.floor.layout.guidepath import Guidepath
from factory.floor.layout.layout import Layout
from factory.floor.layout.visits import Visit
from factory.support.arrays import Array
from factory.support.rotations import upright

Point3 = tuple[float, float, float]


@dataclass(frozen=True, eq=False, slots=True)
class Grip:
    """A robot (index) holds a body, by its `label` in the factory, with its `centre` (3,) of mass
    [m], on a tour that begins with an operation (index) of a `layout` that has it; by what angle
    about the vertical it is turned then, `fed` [rad]."""

    robot: int
    label: str
    centre: Array
    layout: Layout
    begins: int
    fed: float = 0.0

    @property
    def visit(self) -> Visit:
        """The first visit of the tour."""
        return self.layout.visits[self.begins, self.robot]

    @property
    def position(self) -> Point3:
        """Where the body's centre of mass is, in the frame of the robot's carriage, or of its head
        or tool [m]."""
        path = self.layout.guidepaths[self.robot]
        at, foot = path.middle(0.0), path.carriage(0.0)
        (x, y), height = self.visit.shift, self.visit.height
        middle = (at[0] + x - foot[0], at[1] + y - foot[1])
        place = place_in(self.layout.product, self.centre, middle, height)
        ahead, aside, up = turned(place, path.heading)
        hand = self.layout.hand(self.robot)
        if path.travels or hand is None:
            return ahead, aside, up
        x, y, _ = self.layout.mount(self.robot).reached(hand)[0]
        return ahead - x, aside - y, up

    @property
    def pose(self) -> tuple[float, ...]:
        """Where the body is in the body that holds it, and a quaternion of how it is turned there
        (7,)."""
        chains = self.layout.chains
        if chains and self.robot in chains.robots:
            return chains.grip(self.robot, self.label, self.centre)
        return *self.position, *seen_from(self.layout.guidepaths[self.robot], self.fed)


def grips_of(layout: Layout, bodies: FusedBodies) -> Iterator[Grip]:
    """All grips of a layout's robots on its bodies, robot by robot."""
    factory, product = layout.factory, layout.product
    chains = layout.chains.robots if layout.chains else ()  # these turn, and hold a part as it is
    for robot in range(len(factory.robots)):
        for label in dict.fromkeys(bodies.handled(factory, robot)):
            turn = factory.tour_with(robot, label)
            begins, *_ = factory.tours[robot][turn]
            brought = factory.deliveries(robot)[turn : turn + 1] if robot not in chains else ()
            fed = next((fed_of(product, factory.contents[x]) for x in brought), 0.0)
            centre = product.solids[label].presented().centre if fed else bodies.centre[label]
            yield Grip(robot, label, centre, layout, begins, fed)


def seen_from(path: Guidepath, turn: float) -> tuple[float, float, float, float]:
    """The quaternion of what is turned about the vertical by an angle [rad], in the frame of a
    robot that lies along its guidepath."""
    w, _, _, z = heading_quaternion(path)
    if not turn:
        return w, 0, 0, -z
    c, _, _, s = upright(turn)
    return w * c + z * s, 0, 0, w * s - z * c


def turned(v: Point3, heading: tuple[float, float]) -> Point3:
    """A vector of the world in a frame whose x is the heading."""
    u, w = heading
    return (v[0] * u + v[1] * w, -v[0] * w + v[1] * u, v[2])
