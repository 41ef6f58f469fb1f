"""The payloads of robots, the places at which they can be held, and what surrounds them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import product as pairs
from types import MappingProxyType

import numpy as np

from factory.floor.geometry.solids import Product
from factory.floor.geometry.turning import fed_of
from factory.floor.layout.branches import carriers
from factory.floor.layout.hands.hand import Hand, Point3
from factory.floor.layout.hands.kinds import HandKind
from factory.floor.layout.hands.places import ASKED, PUSH, Loads, Places, centre_of, places, resized
from factory.floor.layout.hands.surfaces import Surfaces, Way
from factory.support.arrays import Array
from factory.theory.plant.factory import Factory
from factory.theory.plant.operation import Operation


class Holding:
    """The robots of a factory and the surfaces of what they hold.

    Attributes:
        factory: the factory.
        product: its solids.
        push: acceleration that holding must bear [m/s²].
        turning: robots (index) that go on either way after what is delivered to them.
        surfaces: the surfaces of sub-assemblies.
        wanted: by label, points at which it is to be held if it can be [m].
        on: the carrier that each robot delivers to, -1 for none (robots,).
        axis: the axis along which each robot lies, 0 for x (robots,).
    """

    def __init__(
        self,
        factory: Factory,
        product: Product,
        push: float = PUSH,
        turning: frozenset[int] = frozenset(),
        wanted: Mapping[str, Sequence[Point3]] = MappingProxyType({}),
    ) -> None:
        self.factory, self.product, self.push, self.turning = factory, product, push, turning
        self.surfaces, self.wanted = product.kept(Surfaces), wanted
        self.on = carriers(factory)
        self.axis = [0] * len(factory.robots)
        for robot, carrier in enumerate(self.on):
            if carrier >= 0:
                self.axis[robot] = 1 - self.axis[carrier]
        self._made: list[list[Operation]] = []
        for each in factory.robots:
            gear = (factory.operations[number] for number in each.operations)
            self._made.append([o for o in gear if o.carrier == each.index])
        self._places: dict[tuple[str, HandKind, tuple[int, int], float], Places] = {}
        self._boxes: dict[str, Array] = {}
        self._box: dict[str, Array] = {}
        self._loads: dict[str, Loads] = {}

    def frames(self, robot: int) -> Iterator[tuple[Way, Way]]:
        """The frames of a robot on the floor."""
        if self.on[robot] < 0:
            yield (1.0, 0.0), (0.0, 1.0)
            return
        for one, other in pairs((-1.0, 1.0), (-1.0, 1.0)):
            along, across = (one, 0.0), (0.0, other)
            yield (along, across) if self.axis[robot] == 0 else (along[::-1], across[::-1])

    def is_carrier(self, robot: int) -> bool:
        """Whether other robots come to a robot, with an input or to work on its payload."""
        return any(len(operation.robots) > 1 for operation in self.made(robot))

    def is_fed(self, robot: int) -> bool:
        """Whether a robot takes parts from a feeder."""
        first = self.factory.first(robot)
        return len(first.robots) == 1

    def serves_fixed(self, robot: int) -> bool:
        """Whether a fixed robot takes what a robot brings, while no carrier is there."""
        return not self.factory.robots[self.last(robot).carrier].travels

    def made(self, robot: int) -> Sequence[Operation]:
        """The operations of which a robot is the carrier."""
        return self._made[robot]

    def last(self, robot: int) -> Operation:
        """The operation that a robot delivers to."""
        return self.factory.last(robot)

    def places(self, label: str, kind: HandKind, heading: Way, radius: float = 0.0) -> Places:
        """The places of a sub-assembly for a kind of hand of a robot with a heading, cached: with
        the best pad at each, or with one of a `radius` [m]."""
        side = kind.side(heading)
        key = label, kind, side, radius
        if key not in self._places:
            of, loads = (tuple(self.factory.contents[label]), side), self.loads(label)
            if radius:
                of_any_size = self.places(label, kind, heading)
                candidates = self.product.kept(resized, *of, loads, of_any_size, radius)
            else:
                asked, mix = tuple(self.wanted.get(label, ())), self.factory.pag.mix is not None
                asked += tuple(self._axis(of[0]))
                candidates = self.product.kept(places, *of, kind, loads, mix, asked)
                candidates = self._about_axis(of[0], candidates)
            self._places[key] = candidates
        return self._places[key]

    def _axis(self, parts: Sequence[str]) -> Iterator[Point3]:
        """The axis of a part that is presented turned: hands hold it there, so that it turns about
        their pads."""
        if fed_of(self.product, parts):
            x, y, _ = self.product.solids[parts[0]].axis.tolist()
            yield x, y, 0.0

    def _about_axis(self, parts: Sequence[str], places: Places) -> Places:
        """The places from which a part can be turned: on its axis."""
        for x, y, _ in self._axis(parts):
            places = places.chosen(np.abs(places.at[:, :2] - (x, y)).max(axis=1) < ASKED)
        return places

    def loads(self, label: str) -> Loads:
        """The loads of the robot that takes a sub-assembly: that, and everything that it becomes
        while others bring the rest."""
        if label not in self._loads:
            made = self.made(self.factory.by_label[label].carrier)
            labels = [label, *(o.label for o in made if not self.factory.drops(o.index))]
            held = tuple(dict.fromkeys(tuple(self.factory.contents[held]) for held in labels))
            self._loads[label] = self.product.kept(Loads.of, held, self.push)
        return self._loads[label]

    def boxes(self, label: str) -> Array:
        """The boxes (n, 2, 3) of a sub-assembly's bodies."""
        if label not in self._boxes:
            self._boxes[label] = self.surfaces.boxes(self.factory.contents[label])
        return self._boxes[label]

    def box(self, label: str) -> Array:
        """The box (2, 3) of a sub-assembly."""
        if label not in self._box:
            boxes = self.boxes(label)
            self._box[label] = np.array([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])
        return self._box[label]

    def centre(self, label: str) -> Array:
        """Centre of mass (3,) of a sub-assembly [m]."""
        return centre_of(self.product, self.factory.contents[label])[1]

    def held(self, robot: int, at_last: bool = False) -> str:
        """The label that a robot takes first, or its last one; "" for a tool."""
        return held(self.factory, robot, at_last)

    def top(self, operation: Operation) -> float:
        """Height of the result of an operation [m]."""
        parts = self.factory.contents[self.factory.result(operation)]
        return float(max(self.product.solids[part].high[2] for part in parts))


def held(factory: Factory, robot: int, at_last: bool = False) -> str:
    """The label that a robot takes first and holds by one place ever after, or its last one
    (`at_last`); "" for a tool."""
    for number in factory.robots[robot].operations[:: -1 if at_last else 1]:
        operation = factory.operations[number]
        if operation.carrier == robot and not factory.drops(number):
            return operation.label
    return ""


def bare(factory: Factory, robot: int, hand: Hand | None) -> int:
    """Number of labels that a robot brings without a hand."""
    return len(factory.tours[robot]) if hand is not None and not hand.kind.holds else 0
