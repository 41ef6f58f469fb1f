"""Robots that stand: stopped by a fault, or kept away from things that lie about."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from factory.api import Limits, Mode, Operation, Simulation
from factory.engine.simulation.supervisor import Supervisor
from factory.theory.control.navigation import Bundle

SLOWEST = 1e-9
"""The speed limit of a robot that stands [m/s]."""

SLUGGISH, GRACE = 3.0, 5.0
"""An operation is late when it takes so many times what it should, and so long [s] more."""

MOVES = 5e-3
"""A robot is asked to move when its mode asks for this speed [m/s]."""


def patience(seconds: float) -> float:
    """The time [s] after which something is late that should take so many `seconds`."""
    return SLUGGISH * seconds + GRACE


Stood = tuple[float, tuple[str, ...]]
"""A time [s], and the names of the robots that stand from then on."""


class MotionHold:
    """Stops robots (index) of a simulation by their speed limits.

    Attributes:
        stood: for each change of the robots that stand, the time [s] and their names.
    """

    def __init__(self, simulation: Simulation, supervisor: Supervisor) -> None:
        self._simulation, self._limits = simulation, simulation.limits
        self._supervisor = supervisor
        self._now: frozenset[int] = frozenset()
        self.stood: list[Stood] = []
        factory = simulation.layout.factory
        self._axes = [factory.axes_of(robot.index) for robot in factory.robots]
        self._begun: dict[int, float] = {}
        self._went: dict[int, float] = {}

    def let_stand(self, robots: Iterable[int]) -> None:
        """Stop these robots, and release all others. They brake within their usual limits."""
        chosen = frozenset(robots)
        if chosen == self._now:
            return
        self._now = chosen
        self._apply()
        every = self._simulation.layout.factory.robots
        names = tuple(every[robot].name for robot in sorted(chosen))
        self.stood.append((self._simulation.world.time, names))

    def limit(self, limits: Limits) -> None:
        """Set the limits of robots that do not stand."""
        self._limits = limits
        self._apply()

    def _apply(self) -> None:
        speed = np.array(self._limits.speed)
        for robot in self._now:
            speed[self._axes[robot]] = SLOWEST
        self._simulation.limit(Limits(speed, self._limits.acceleration))

    def axes(self, robots: Iterable[int]) -> frozenset[int]:
        """The axes of robots."""
        return frozenset(axis for robot in robots for axis in self._axes[robot])

    def begun(self, operation: Operation, now: float) -> None:
        """Restart the clock of an operation at time now [s]: it begins, or resumes after a wait
        that its robots did not cause."""
        self._begun[operation.index] = now

    def jammed(self, now: float, excused: frozenset[int]) -> list[int]:
        """Robots that do not move although a late operation or stage asks them to. Operations of
        `excused` robots are not late."""
        supervisor, factory = self._supervisor, self._supervisor.factory
        jammed, modes = list[int](), supervisor.bundles
        for number in supervisor.active.operations:
            operation = factory.operations[number]
            if not excused.isdisjoint(operation.robots):
                self.begun(operation, now)
            elif now > self._late(number, now):
                jammed += self._at_fault(modes.modes[number], [*factory.moves[number]])
        going = supervisor.ahead.going(supervisor.active.ahead)
        went = {n: self._went.get(n, now) for n in going}
        self._went = {n: now if going[n].robot in excused else t for n, t in went.items()}
        for number, since in self._went.items():
            if now > since + self._longest:
                jammed += self._at_fault(modes.modes[number], [going[number].axis])
        return jammed

    def latest(self, now: float) -> float:
        """The time at which the last operation or stage under way becomes late [s]."""
        active = self._supervisor.active.operations
        ends = [self._late(number, now) for number in active]
        return max([*ends, *(since + self._longest for since in self._went.values())], default=0.0)

    @property
    def _longest(self) -> float:
        return patience(max(self._simulation.delays))

    def _late(self, number: int, now: float) -> float:
        begun = self._begun.setdefault(number, now)
        return begun + patience(self._simulation.delays[number])

    def _at_fault(self, mode: Mode, axes: list[int]) -> list[int]:
        """Robots that a mode asks to move and that do not."""
        simulation = self._simulation
        x, v = simulation.world.sense()
        bundle = Bundle.of([mode], [self._limits.of(axes)])
        asked = np.abs(bundle.field(x[axes], simulation.request.settings.tick)) > MOVES
        stuck = asked & (np.abs(v[axes]) < Mode.STILL)
        of_axis = dict[int, int]()
        for robot, axes_of in enumerate(self._axes):
            of_axis |= dict.fromkeys(axes_of, robot)
        return [
            *dict.fromkeys(of_axis[axis] for axis, is_so in zip(axes, stuck, strict=True) if is_so)
        ]
