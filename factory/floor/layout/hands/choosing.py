"""Choose a hand for every robot that carries something.

Two things make hands clear of each other whatever the robots do. A robot's guidepath runs under
the line of its hand, so that its finger is straight; and a robot that delivers holds its payload on
its own side of its carrier's line, so that it never reaches into that. What else could be met are
parts (`in_the_way.py`).

What robots hold is judged tour by tour, as if each tour had a robot of its own: one with several
holds different things in different operations, and its hand has to suit all of them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TypeAlias

import numpy as np

from factory.floor.geometry.solids import Product
from factory.floor.layout.hands.apart import HandsApart
from factory.floor.layout.hands.hand import Hand, Point3
from factory.floor.layout.hands.holding import Holding, held
from factory.floor.layout.hands.in_the_way import InTheWay, Passed
from factory.floor.layout.hands.kinds import HandKind
from factory.floor.layout.hands.one_hand import OneHand
from factory.floor.layout.hands.places import PUSH, Places
from factory.floor.layout.hands.surfaces import Way
from factory.floor.layout.stops import stops_of
from factory.theory.plant.factory import Factory
from factory.theory.plant.robot import Robot
from factory.theory.problem.ids import RobotId


@dataclass(frozen=True, slots=True)
class Tours:
    """A factory in which each tour has a robot of its own.

    Attributes:
        factory: that factory.
        of: for each robot of the original one the robots of its tours.
        turning: the tours of robots that go back to where they have been before, since one that
            delivers there comes again.
    """

    factory: Factory
    of: tuple[tuple[int, ...], ...]
    turning: frozenset[int] = frozenset()

    @classmethod
    def apart(cls, factory: Factory) -> Tours:
        """The tours of a factory; the factory itself if no robot has several."""
        if not factory.folded:
            return cls(factory, tuple((robot.index,) for robot in factory.robots))
        of, robots = list[tuple[int, ...]](), list[Robot]()
        for robot, tours in zip(factory.robots, factory.tours, strict=True):
            of.append(tuple(range(len(robots), len(robots) + len(tours))))
            robots += [
                replace(robot, index=RobotId(n), operations=tour)
                for n, tour in zip(of[-1], tours, strict=True)
            ]
        operations = tuple(
            replace(o, robots=tuple(RobotId(of[r][factory.turns[o.index, r]]) for r in o.robots))
            for o in factory.operations
        )
        made = replace(factory, robots=tuple(robots), operations=operations, adjusted=frozenset())
        turning = (
            tour
            for robot in factory.robots
            if stops_of(factory, robot.index)[1]
            for tour in of[robot.index]
        )
        return cls(made, tuple(of), frozenset(turning))

    def alike(self, tours: Sequence[int]) -> tuple[int, ...]:
        """For each tour the first that equals it except for the unit of a period: one hand has the
        same place on both."""
        first = dict[object, int]()
        return tuple(first.setdefault(self._done(tour), tour) for tour in tours)

    def _done(self, tour: int) -> object:
        numbers = self.factory.robots[tour].operations
        done = (self.factory.operations[number] for number in numbers)
        return tuple((operation.written, operation.robots.index(tour)) for operation in done)


class Hands:
    """Chooses the hands of a factory's robots, each when it is asked for. A carrier's hand depends
    on its heading only, since those that deliver to it depend on its line; any other's depends on
    its frame.

    Choices for robots that lie in other ways refine the classes of its steps.

    Args:
        factory: the factory.
        product: its solids.
        push: largest acceleration that hands must bear [m/s²].
        wanted: hands that robots (index) with one tour keep if these fit.

    Attributes:
        Held: what robots hold, a step.
        Apart: hands that could meet, a step.
        Obstacles: all obstacles of hands, a step.
        Choice: the choice of one robot's hand, a step.
        Kind: kinds of hands.
        Sites: places of a payload's surface.
        Contacts: those of a hand with parts that it comes past.
        tours: the factory with a robot for each tour, for which hands are chosen.
        travels: least travels of robots (index), as layouts have shown [m].
    """

    Held: TypeAlias = Holding
    Apart: TypeAlias = HandsApart
    Obstacles: TypeAlias = InTheWay
    Choice: TypeAlias = OneHand
    Kind: TypeAlias = HandKind
    Contacts: TypeAlias = Passed
    Sites: TypeAlias = Places

    def __init__(
        self,
        factory: Factory,
        product: Product,
        push: float = PUSH,
        wanted: Mapping[int, Hand] = MappingProxyType({}),
    ) -> None:
        self.factory, self.tours = factory, Tours.apart(factory)
        self._wanted = {self.tours.of[robot]: hand for robot, hand in wanted.items()}
        apart = self.tours.factory
        points = {held(apart, tours[0]): hand.places for tours, hand in self._wanted.items()}
        self.holding = Holding(apart, product, push, self.tours.turning, points)
        self.in_the_way = InTheWay(self.holding, self._carrier)
        adjusted = frozenset(tour for r in factory.adjusted for tour in self.tours.of[r])
        self.one_hand = OneHand(self.in_the_way, adjusted)
        self._chosen: dict[tuple[tuple[int, ...], object], tuple[Hand, ...]] = {}
        self._settled = set[tuple[int, ...]]()
        self.travels: dict[int, float] = {}
        self._on = {tour: of for of in self.tours.of for tour in of}

    @property
    def chosen_by(self) -> tuple[object, ...]:
        """Everything that choices depend on, but for the solids."""
        return self.factory, self._wanted, self.travels, self.holding.push

    def hand(self, robot: int, u: Way, t: Way) -> Hand | None:
        """The hand of a robot that heads along u, to a carrier that heads along t; None for a tool.
        For several tours: in its place on the label of the first."""
        tours = self.tours.of[robot]
        return self._of(tours, u, t)[0] if held(self.holding.factory, tours[0]) else None

    def shifts(self, robot: int, u: Way, t: Way | None = None) -> tuple[Point3, ...]:
        """For each tour of a robot the product's displacement from its place on the first tour, in
        the robot's frame [m], such that the hand stays where it is; empty for one tour. `t` does
        not matter for a carrier."""
        tours = self.tours.of[robot]
        if len(tours) == 1 or not held(self.holding.factory, tours[0]):
            return ()
        places = [hand.places[0] for hand in self._of(tours, u, t)]
        offsets = np.round(np.array(places[:1]) - places, 6) + 0.0
        return tuple((x, y, z) for x, y, z in offsets.tolist())

    def carries(self, robot: int) -> bool:
        """Whether other robots come to a robot, with an input or to work on its payload."""
        return any(self.holding.is_carrier(tour) for tour in self.tours.of[robot])

    def is_fed(self, robot: int) -> bool:
        """Whether a robot takes parts from a feeder."""
        return self.holding.is_fed(self.tours.of[robot][0])

    def line(self, robot: int, u: Way) -> float:
        """Position across the heading u of the line of a robot's hand, in the product's frame
        [m]."""
        across = 1 if u[0] else 0
        if self.carries(robot):
            return self._carrier(self.tours.of[robot][0], u).places[0][across]
        return float(self.holding.product.middle[across])

    def _of(self, tours: tuple[int, ...], u: Way, t: Way | None) -> tuple[Hand, ...]:
        """The hand of a robot in its place on the label of each tour; equal tours share one."""
        carries = any(map(self.holding.is_carrier, tours))
        frames = self._sides(tours[0], u) if carries or t is None else ((u, t),)
        if (tours, frames) not in self._chosen:
            self._settle(tours)
            alike = self.tours.alike(tours)
            unlike = [*dict.fromkeys(alike)]
            which = [unlike.index(tour) for tour in alike]
            wanted = self._wanted.get(tours)
            hands = (wanted and self.one_hand.like(wanted, tours[0], frames)) or (
                self.one_hand.chosen(unlike, frames)
            )
            covered = tuple(hands[0].covered[n] for n in which) if hands else ()
            clamp = hands[0].clamp if hands else None
            if clamp is not None:
                clamp = replace(clamp, closed=tuple(clamp.closed[n] for n in which))
            self._chosen[tours, frames] = tuple(
                replace(hands[n], covered=covered, clamp=clamp) for n in which if hands
            ) or (self._nowhere(held(self.holding.factory, tours[0])),) * len(tours)
        return self._chosen[tours, frames]

    def _settle(self, tours: tuple[int, ...]) -> None:
        """Choose the hands of all carriers above the carriers of some tours, the uppermost first,
        so that the choice recurses once, however deep the product; those carriers' own depend on
        where their guests come from, and are chosen when they are asked for."""
        carriers = dict.fromkeys(self.holding.on[tour] for tour in tours)
        above, todo = list[int](), [t for c in carriers if c >= 0 for t in self._on[c]]
        while todo:
            carrier = self.holding.on[todo.pop()]
            if carrier >= 0 and self._on[carrier] not in self._settled:
                self._settled.add(self._on[carrier])
                above.append(carrier)
                todo += self._on[carrier]
        for carrier in reversed(above):
            for u in dict.fromkeys(u for u, _ in self.holding.frames(carrier)):
                self._of(self._on[carrier], u, None)

    def _carrier(self, tour: int, u: Way) -> Hand:
        tours = self._on[tour]
        return self._of(tours, u, None)[tours.index(tour)]

    def _sides(self, robot: int, u: Way) -> tuple[tuple[Way, Way], ...]:
        """The frames of a carrier that heads along u."""
        delivers = self.holding.on[robot] >= 0
        sides = ((u[1], u[0]), (-u[1], -u[0])) if delivers else ((0.0, 1.0),)
        return tuple((u, (x + 0.0, y + 0.0)) for x, y in sides)

    def all_frames(self, robot: int) -> list[tuple[tuple[Way, Way], ...]]:
        """The frames of a robot on the floor, grouped: one hand has to be clear in all frames of a
        group."""
        frames = list(self.holding.frames(robot))
        if self.holding.is_carrier(robot):
            return [self._sides(robot, u) for u in dict.fromkeys(u for u, _ in frames)]
        return [(frame,) for frame in frames]

    def _nowhere(self, label: str) -> Hand:
        """No hand, at the centre of mass of the payload."""
        x, y, z = self.holding.centre(label).tolist()
        return Hand.nothing((float(x), float(y), float(z)))
