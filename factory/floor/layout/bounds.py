"""A lower bound on the cycle time of every layout of a factory, from each robot's own extents.

Proof. (1) *Legs.* Where a robot has its part before it delivers it, the certificate keeps the part
a clearance apart from the pile that its carrier then holds at their meeting point. Both overlap
across the robot's path, for the part is in the pile; so the robot comes at least as far as the part
reaches ahead of the meeting point, the pile behind it, and a clearance. The output robot, likewise,
brings its product out of the way of the next, clear of the outfeed. (2) *Spans.* Robots that
deliver to one carrier from one side run in lanes, and all lanes of a side have their near ends at
one distance, so no two are nearer than a carriage and a clearance. Of n robots half come from one
side, so their stations span as many lanes, less one, less what their parts are apart. The way back
is a span and a leg. (3) *Times.* From rest to rest takes a concave time T of the way, so the moves
along the span take at least T of it; an input that waits for its carrier to stand comes afterwards,
from its standoff. The cycle time is the greatest sum along a gear, and every sum is bounded.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

from factory.floor.geometry.solids import Product
from factory.floor.layout.branches import carriers
from factory.floor.layout.durations import Pace
from factory.floor.layout.footprint import ahead_of
from factory.floor.layout.layout import BESIDE
from factory.floor.layout.meeting import TOLERANCE
from factory.floor.layout.shapes import payload_boxes
from factory.floor.layout.stops import carried
from factory.theory.plant.factory import Factory
from factory.theory.plant.operation import Operation
from factory.theory.problem.pag import NOPART

ROUNDED = 1e-3
"""Lanes are in whole millimetres: two are off by so much at most [m]."""


def cycle_time_bound(factory: Factory, product: Product, clearance: float, pace: Pace) -> float:
    """No certified layout with this clearance [m] has a shorter cycle time [s]. Linear."""
    bound = _Bound(factory, product, clearance - TOLERANCE, pace)
    return max(bound.gear(robot.index) for robot in factory.robots) / factory.period


def least_times(factory: Factory, product: Product, clearance: float, pace: Pace) -> list[float]:
    """The least time of each operation in a layout with this clearance [m], with the way back of
    its robots [s]."""
    bound = _Bound(factory, product, clearance - TOLERANCE, pace)
    moving = zip(factory.operations, bound.moving, strict=True)
    return [o.dwell + pace.lost + time for o, time in moving]


@dataclass(frozen=True, slots=True)
class _Interval:
    """The interval that something takes on one axis of the product [m]."""

    low: float
    high: float

    @property
    def middle(self) -> float:
        return (self.low + self.high) / 2

    def past(self, other: _Interval) -> float:
        """Least displacement that brings this interval past another, to the nearer side."""
        return min(self.high - other.low, other.high - self.low)


class _Bound:
    """Bounds of single robots and operations, each used by several gears."""

    def __init__(self, factory: Factory, product: Product, c: float, pace: Pace) -> None:
        self.factory, self.c, self.pace = factory, c, pace
        self.payloads = payload_boxes(factory, product)
        self.on = carriers(factory)
        self.axis = [0] * len(factory.robots)
        for robot, carrier in list(enumerate(self.on))[1:]:
            self.axis[robot] = 1 - self.axis[carrier]
        self.tail = sqrt(2 * pace.eps / pace.acceleration)
        self.legs = [self._legs(robot.index) for robot in factory.robots]
        self.spans = [self._span(robot.index) for robot in factory.robots]
        self.moving = [self._moving(operation) for operation in factory.operations]
        self.waiting = [self._waiting(operation) for operation in factory.operations]

    def gear(self, robot: int) -> float:
        """The least sum of delays [s] along the gear of a robot."""
        gear = self.factory.robots[robot].operations
        fixed = sum(self.factory.operations[number].dwell + self.pace.lost for number in gear)
        if len(self.factory.tours[robot]) > 1:
            return fixed + sum(self.moving[number] for number in gear)
        first = self.moving[gear[0]]
        if len(gear) == 1:
            return fixed + first
        if self.pace.ahead is not None:
            lost = self.factory.operations[gear[0]].dwell + self.pace.lost
            first = max(first, self._back(robot) + self.pace.ahead - lost)
        between = gear[1:-1]
        moves = sum(self.moving[number] for number in between)
        waits = sum(self.waiting[number] for number in between)
        along = max(moves, self.pace.rest(self.spans[robot]) + waits)
        return fixed + first + along + self.moving[gear[-1]]

    def _box(self, label: str, axis: int) -> _Interval:
        box = self.payloads[label]
        return _Interval(box[2 * axis], box[2 * axis + 1])

    def _legs(self, robot: int) -> dict[int, float]:
        """The least way to where a robot delivers, by the operation in which it does; 0 for a
        tool."""
        if robot == 0:
            boxes = [self._box(product, 0) for product in self.factory.products]
            way = max(box.high for box in boxes) - min(box.low for box in boxes) + 1.5 * self.c
            return {dropoff.index: way for dropoff in self.factory.dropoffs}
        axis, legs = self.axis[robot], dict[int, float]()
        for tour in self.factory.tours[robot]:
            last = self.factory.operations[tour[-1]]
            label, legs[last.index] = last.before[last.robots.index(robot)], 0.0
            if label != NOPART:
                past = self._box(label, axis).past(self._box(last.label, axis))
                legs[last.index] = past + self.c
        return legs

    def _span(self, robot: int) -> float:
        """The least way from a robot's first station to its last."""
        operations = [self.factory.operations[number] for number in carried(self.factory, robot)]
        guests = [g for o in operations for g in o.robots if g != robot]
        several = len(self.factory.tours[robot]) > 1 or len(set(guests)) < len(guests)
        if not guests or several or any(ahead_of(o, 1.0) for o in operations):
            return 0.0
        lanes = [self._lane(guest, self.axis[robot]) for guest in guests]
        apart = max(lanes) - min(lanes) + ROUNDED
        return max(0.0, ((len(guests) + 1) // 2 - 1) * (self.factory.carriage + self.c) - apart)

    def _lane(self, robot: int, axis: int) -> float:
        """Where a robot's lane is, along its carrier's path, about the meeting point."""
        gear = self.factory.robots[robot].operations
        number = gear[max(len(gear) - 2, 0)]
        return self._box(self.factory.operations[number].label, axis).middle

    def _back(self, robot: int) -> float:
        """The least time of the way back of a robot."""
        return self.pace.rest(self.spans[robot] + min(self.legs[robot].values()))

    def _moving(self, operation: Operation) -> float:
        """The least time of an operation by the legs that end in it, and by the way back of a robot
        that begins its gear with it, unless it goes ahead."""
        pace, times = self.pace, [0.0]
        for slot, robot in enumerate(operation.robots):
            tour = self.factory.tour_of(robot, operation.index)
            begins = len(tour) > 1 and tour[0] == operation.index
            if begins and not pace.goes_ahead(operation, slot):
                times.append(self._back(robot))
            if len(tour) > 1 and tour[-1] == operation.index:
                leg = self.legs[robot][operation.index]
                times.append(pace.rest(leg) + self._lowering(operation, slot))
        return max(*times, self._waiting(operation))

    def _waiting(self, operation: Operation) -> float:
        """The least time of an operation once its carrier stands."""
        carrier = operation.template.carrier - 1
        pile, longest = operation.before[carrier], 0.0
        if pile == NOPART:
            return 0.0
        for slot, label in enumerate(operation.before):
            if slot == carrier or label == NOPART:
                continue
            standoff = BESIDE
            if slot != operation.lowered:
                axis = self.axis[operation.robots[slot]]
                standoff = max(0.0, self._box(label, axis).past(self._box(pile, axis)) + self.c)
            comes = self.pace.landing(standoff) - self.tail
            longest = max(longest, comes + self._lowering(operation, slot))
        return longest

    def _lowering(self, operation: Operation, slot: int) -> float:
        if slot != operation.lowered:
            return 0.0
        stroke = operation.approach.stroke if operation.approach else 0.0
        return self.pace.rest(stroke) - self.tail
