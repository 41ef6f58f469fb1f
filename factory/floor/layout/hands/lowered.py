"""Parts that are lowered where a robot stands: what of its hand is in their way."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from factory.floor.layout.dimensions import BEAM, FINGER
from factory.floor.layout.hands.apart import HandsApart, Swept
from factory.floor.layout.hands.holding import Holding, held
from factory.floor.layout.hands.kinds import HandKind
from factory.floor.layout.hands.places import Places
from factory.floor.layout.hands.reach import back
from factory.floor.layout.hands.surfaces import Way, swept
from factory.support.arrays import Array
from factory.theory.plant.operation import Operation
from factory.theory.problem.robot_bodies import MAST

ASIDE = 2 * MAST
"""The beam over a part from a feeder begins so far beside the part: where its mast passes, with the
usual clearance [m]."""


class Lowered:
    """What is lowered to the robots of a factory, as an obstacle of their hands."""

    def __init__(self, holding: Holding, apart: HandsApart) -> None:
        self.holding, self.apart = holding, apart

    def onto(self, robot: int, kind: HandKind, places: Places, u: Way) -> Iterator[Swept]:
        """The sweep of a hand relative to each input that is lowered to a carrier."""
        ends = kind.boxes(self.holding.product, places.at, places.radius, u)
        low, high = kind.over_all(*ends, places.radius)
        if kind.tall:
            low, high = swept(low, high, back(u))
        for operation in self.holding.made(robot):
            for boxes in self.boxes(operation, robot, [(u[1], u[0]), (-u[1], -u[0])]):
                yield low, high, boxes

    def beams(self, robot: int, kind: HandKind, places: Places, u: Way, t: Way) -> Iterator[Swept]:
        """The sweep of the beam over what a robot holds from above and has from a feeder, relative
        to an input that is lowered where it delivers. Its mast stands against t, beside that."""
        if not kind.hangs or not self.holding.is_fed(robot):
            return
        across, side = (0, t[0]) if t[0] else (1, t[1])
        box = self.holding.box(held(self.holding.factory, robot))
        line = side * ((box * side).min(axis=0)[across] - ASIDE)
        low, high = places.at - FINGER / 2, places.at + FINGER / 2
        low[:, across] = np.minimum(low[:, across], line)
        high[:, across] = np.maximum(high[:, across], line)
        low[:, 2] = self.apart.beam(robot, places, ((u, t),))
        high[:, 2] = low[:, 2] + BEAM
        for boxes in self.boxes(self.holding.last(robot), robot, (u,)):
            yield (*swept(low, high, back(u)), boxes)

    def boxes(self, operation: Operation, robot: int, sides: Sequence[Way]) -> Iterator[Array]:
        """The boxes (n, 2, 3) of what is lowered to a robot in an operation: on the way down, and
        before that as it comes from some sides over everything that stands there."""
        slot = operation.lowered
        if slot < 0 or operation.robots[slot] == robot:
            return
        boxes = self.holding.boxes(operation.before[slot]).copy()
        boxes[:, 1, 2] = np.inf
        yield boxes.copy()
        boxes[:, 0, 2] += self.holding.factory.lowering(operation.robots[slot])
        for side in sides:
            yield np.stack(swept(boxes[:, 0], boxes[:, 1], side), axis=1)
