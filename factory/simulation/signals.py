"""Signals between a controller and a plant: what each reads and writes, and what the plant does of
itself, drives that go to their targets and grips with a sensor each.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from factory.control.governor import towards
from factory.control.mode import Array, Limits
from factory.plant.factory import Operation
from factory.problem.pag import NOPART
from factory.simulation.world import World


@dataclass(frozen=True, slots=True)
class Sensed:
    """What a controller reads: the time [s]; positions [m] and speeds [m/s] of all axes; of each
    robot whether its grip is closed on something; of each station, the feeders in the order of
    their operations and then the outfeed, whether it is ready."""

    time: float
    position: Array
    speed: Array
    held: tuple[bool, ...]
    ready: tuple[bool, ...]


@dataclass(frozen=True, slots=True)
class Commands:
    """What a controller writes: where each axis is to go and stay [m]; of each robot whether its
    grip is to be closed, and its job, the number of the operation that it is in, from 1, 0 for
    none; whether to `stop`, so that all axes stand."""

    target: Array
    grip: tuple[bool, ...]
    job: tuple[int, ...]
    stop: bool = False


class Controller(Protocol):
    """A controller, which is asked once in a scan."""

    def scan(self, sensed: Sensed) -> Commands:
        """From what it reads to what it writes."""


@dataclass(frozen=True, slots=True)
class Refusal:
    """A command that the plant does not carry out: the time [s], the robot (index), and why."""

    time: float
    robot: int
    message: str


class AxisDrives:
    """Drives that go to a target as fast as the limits of their axes allow, and rest there. `x` [m]
    and `v` [m/s] (axes,): the references."""

    def __init__(self, x: Array, limits: Limits, period: float) -> None:
        self.x, self.v, self.target = np.array(x), np.zeros(len(x)), np.array(x)
        self.limits, self._period = limits, period
        self._moved = np.zeros(len(x), bool)

    @property
    def stops(self) -> Array:
        """Where axes come to stand that begin to brake now [m]."""
        return self.x + self.v * np.abs(self.v) / (2 * self.limits.acceleration)

    def go(self, world: World) -> None:
        """The next period [s] of all axes that have a way to go."""
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
    """The grips of robots, as the plant sees them. `label`: what each robot holds; `taken`: the
    empty ones that have closed where they may take; `freed`: those that have let go of what they
    hold where they may; `closed`: those from which something has been taken, and that have not
    opened since."""

    def __init__(self, robots: int) -> None:
        self.label = [NOPART] * robots
        self.taken, self.freed, self.closed = set[int](), set[int](), set[int]()

    def held(self, robot: int, closed: bool) -> bool:
        """The sensor of a grip that is told to be `closed`, or open."""
        if self.label[robot] != NOPART:
            return robot not in self.freed
        return closed and (robot in self.taken or robot in self.closed)

    def hand_over(self, operation: Operation) -> None:
        """What robots bring is taken from them, and what comes out is held by the carrier."""
        for robot, before, after in zip(
            operation.robots, operation.before, operation.after, strict=True
        ):
            if before != NOPART and after == NOPART and robot not in self.freed:
                self.closed.add(robot)
            self.label[robot] = after
        self.taken.discard(operation.carrier)
        self.freed.discard(operation.carrier)
