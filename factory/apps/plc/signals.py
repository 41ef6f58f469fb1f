"""Signals between controller and plant, and the plant's own reactions: drives that go to their
targets, grips with a sensor each."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from factory.api import NOPART, Limits, Operation, World
from factory.support.arrays import Array
from factory.theory.control.governor import towards

NOBODY = -1
"""The robot of a refusal that concerns no single one."""


@dataclass(frozen=True, slots=True)
class Sensed:
    """Controller inputs: time [s]; positions [m] and speeds [m/s] of all axes; for each robot
    whether its grip holds something; for each station, feeders in the order of their operations and
    then the outfeed, whether it is ready."""

    time: float
    position: Array
    speed: Array
    held: tuple[bool, ...]
    ready: tuple[bool, ...]


@dataclass(frozen=True, slots=True)
class Commands:
    """Controller outputs: target of each axis [m]; for each robot whether its grip is closed, and
    its job, the number of its operation from 1, 0 for none; `stop`: stop all axes."""

    target: Array
    grip: tuple[bool, ...]
    job: tuple[int, ...]
    stop: bool = False


class Controller(Protocol):
    """A controller, called once in a scan."""

    def scan(self, sensed: Sensed) -> Commands:
        """The outputs for given inputs."""


@dataclass(frozen=True, slots=True)
class Refusal:
    """A refused command, or a stop: time [s], robot (index; NOBODY: all of them) and reason."""

    time: float
    robot: int
    message: str


KEPT = 1000
"""The most refusals that are kept."""


class Refusals:
    """The refused commands of a plant, of which the last KEPT are kept: a controller that asks for
    what is refused for days fills no memory.

    Attributes:
        count: the number of all refusals.
        last: the last ones, the newest at the end.
    """

    def __init__(self) -> None:
        self.count = 0
        self.last = deque[Refusal](maxlen=KEPT)

    def add(self, refusal: Refusal) -> None:
        """Keep a refusal, in place of the oldest if there are too many."""
        self.count += 1
        self.last.append(refusal)

    def since(self, count: int) -> list[Refusal]:
        """The refusals after the first `count` ones, as far as they are kept."""
        new = min(self.count - count, len(self.last))
        return list(self.last)[len(self.last) - new :]


class AxisDrives:
    """Drives that go to their targets as fast as the axis limits allow. `x` [m] and `v` [m/s]
    (axes,): the references."""

    def __init__(self, x: Array, limits: Limits, period: float) -> None:
        self.x, self.v, self.target = np.array(x), np.zeros(len(x)), np.array(x)
        self.limits, self._period = limits, period
        self._moved = np.zeros(len(x), bool)

    @property
    def stops(self) -> Array:
        """Where axes stop that begin to brake now [m]."""
        return self.x + self.v * np.abs(self.v) / (2 * self.limits.acceleration)

    def go(self, world: World) -> None:
        """Advance all moving axes by a period [s]."""
        limits = self.limits.speed, self.limits.acceleration
        x, v, a = towards(self.target, self.x, self.v, limits, self._period)
        moves = (a != 0.0) | (self.v != 0.0)
        if moves.any():
            axes = np.flatnonzero(moves)
            world.move(axes, self.x[axes], self.v[axes], a[axes])
        rests = self._moved & ~moves
        if rests.any():
            axes, still = np.flatnonzero(rests), np.zeros(int(rests.sum()))
            world.move(axes, self.x[axes], still, still)
        self.x, self.v, self._moved = x, v, moves


class GripStates:
    """The grips of robots, as the plant sees them. `label`: each robot's payload; `taken`: empty
    grips that have closed where they may take; `freed`: grips that have opened where they may
    release; `closed`: grips from which the payload was taken over, not yet opened."""

    def __init__(self, robots: int) -> None:
        self.label = [NOPART] * robots
        self.taken, self.freed, self.closed = set[int](), set[int](), set[int]()

    def held(self, robot: int, closed: bool) -> bool:
        """Whether the sensor of a grip commanded `closed` reports a payload."""
        if self.label[robot] != NOPART:
            return robot not in self.freed
        return closed and (robot in self.taken or robot in self.closed)

    def hand_over(self, operation: Operation) -> None:
        """Take what robots bring, and give the result to the carrier."""
        for robot, before, after in zip(
            operation.robots, operation.before, operation.after, strict=True
        ):
            if before != NOPART and after == NOPART and robot not in self.freed:
                self.closed.add(robot)
            self.label[robot] = after
        self.taken.discard(operation.carrier)
        self.freed.discard(operation.carrier)
