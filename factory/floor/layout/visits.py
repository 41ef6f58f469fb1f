"""Visits: the configuration of each robot, over all its axes, in each of its operations.

A robot goes from one visit to the next in the order of its gear, and from the last to the first.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from factory.floor.layout.guidepath import Guidepath
from factory.floor.layout.hands.hand import Point3
from factory.support.boxes import Point2
from factory.theory.plant.factory import Factory
from factory.theory.plant.operation import Operation

LEAST = 0.001
"""The least stroke of a lift [m]."""

Visits = Mapping[tuple[int, int], "Visit"]
"""The visit of each robot (index) in each of its operations (index), by (operation, robot)."""

EXACT = {"A": 0.0, "B": 0.0, "S": 2.0}
"""The multiple of r at which the goal of a carrier is its station, by the end it is counted
from."""


@dataclass(frozen=True, slots=True)
class Visit:
    """The configuration of a robot at the end of an operation, and how it holds its payload on this
    tour.

    Attributes:
        at: arc length of its carriage [m].
        lift: height of its lift, 0 without one [m].
        up: height of its lift until it delivers [m].
        elevation: height of the payload until then above its place in the product [m].
        shift: the product's middle relative to where the guidepath has it, in the world (x, y)
            [m].
    """

    at: float
    lift: float
    up: float
    elevation: float
    shift: Point2 = (0.0, 0.0)

    @property
    def height(self) -> float:
        """Height of the payload above its place in the product with the lift at 0 [m]."""
        return self.elevation - self.up


def visits_of(
    factory: Factory,
    guidepaths: Sequence[Guidepath],
    stations: Sequence[float],
    shifts: Sequence[Sequence[Point3]] = (),
) -> dict[tuple[int, int], Visit]:
    """The visits of a factory whose operations are at `stations`, distances from the B ends of
    their carriers [m]. `shifts`: for each robot and each of its tours the product's middle in the
    robot's frame (u, t) and upwards, relative to that on its first tour [m]; none where it is
    always the same. A non-carrier delivers at A + 2r, or short of that (`stop_offset`). A lift is
    up but for the operation it delivers in."""
    held = dict.fromkeys(factory.turns, (0.0, 0.0))
    if shifts:
        held = {
            (number, robot): _in_world(guidepaths[robot], shifts[robot][turn])
            for (number, robot), turn in factory.turns.items()
        }
    visits: dict[tuple[int, int], Visit] = {}
    for robot, levels in enumerate(_levels(factory, shifts)):
        path = guidepaths[robot]
        for tour, (down, up, elevation) in zip(factory.tours[robot], levels, strict=True):
            for number in tour:
                operation, shift = factory.operations[number], held[number, robot]
                if robot == operation.carrier:
                    at = _stand(path, operation, stations[number])
                else:
                    slot, carried = operation.robots.index(robot), held[number, operation.carrier]
                    short, _ = stop_offset(path, shift, carried)
                    at = operation.template.law.goals[slot].multiple * path.r + short
                lift = down if number == tour[-1] else up
                visits[number, robot] = Visit(at, lift, up, elevation, shift)
    return visits


def stop_offset(path: Guidepath, shift: Point2, carried: Point2) -> Point2:
    """Offset (along, across) [m] of the stop of a robot that delivers from its nominal one, for the
    shifts of what it brings and of what its carrier has: how much earlier than at the end of its
    guidepath it delivers, and how much further than where that ends the carrier stands."""
    (u, v), (s, t) = path.heading, path.side
    x, y = shift[0] - carried[0], shift[1] - carried[1]
    return round(x * u + y * v, 6) + 0.0, round(x * s + y * t, 6) + 0.0


def beyond_station(operation: Operation) -> float:
    """How far the goal of the carrier of an operation is beyond its station, as a multiple of r;
    of one that has it at A, beyond that."""
    point = operation.template.law.goals[operation.template.carrier - 1]
    return point.multiple - EXACT[point.end]


def _stand(path: Guidepath, operation: Operation, station: float) -> float:
    """Arc length of the goal of a carrier [m]."""
    more = beyond_station(operation) * path.r
    is_at_a = operation.template.law.goals[operation.template.carrier - 1].end == "A"
    return more if is_at_a else path.length - station + more


def _in_world(path: Guidepath, shift: Point3) -> Point2:
    """A shift in a robot's frame, in the directions of the world."""
    (u, v), (s, t) = path.heading, path.side
    return u * shift[0] + s * shift[1], v * shift[0] + t * shift[1]


def _levels(
    factory: Factory, shifts: Sequence[Sequence[Point3]]
) -> Iterator[list[tuple[float, float, float]]]:
    """For each robot and each of its tours: the height of its lift where it delivers, and before
    that, and the elevation of its payload above its place in the product [m]. The elevation is that
    of the robot that it delivers to, and its own stroke, the same on all tours, so that all that
    deliver to it come at one height."""
    elevations: list[list[float]] = []
    for robot, tours in enumerate(factory.tours):
        ends = [factory.operations[tour[-1]] for tour in tours]
        below = [0.0] * len(ends)
        if robot:
            below = [  # carriers come first but for those that move several joints: these have none
                elevations[o.carrier][factory.turns[o.index, o.carrier]]
                if o.carrier < robot
                else 0.0
                for o in ends
            ]
        stroke, downs = factory.lowering(robot), [0.0] * len(ends)
        if factory.goes_up(robot) and len(ends) > 1 and shifts:
            over = [d - z for d, (_, _, z) in zip(below, shifts[robot], strict=True)]
            downs = [round(at - min(over), 6) for at in over]
            needed = (o.approach.stroke if o.approach else 0.0 for o in ends)
            stroke = max(needed)
        ups = downs if robot in factory.adjusted else [at + stroke for at in downs]
        elevations.append([d + (up - down) for d, up, down in zip(below, ups, downs, strict=True)])
        yield [*zip(downs, ups, elevations[-1], strict=True)]
