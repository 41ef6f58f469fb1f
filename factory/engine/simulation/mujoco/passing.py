"""The robots that feeders serve: whether they are out of the way, and how soon they can return."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from factory.engine.mjcf import names
from factory.engine.mjcf.model import Model
from factory.engine.simulation.mujoco.axes import Axes
from factory.engine.simulation.mujoco.courses import Points
from factory.engine.simulation.request import RunRequest
from factory.floor.layout.coordinating import HOME
from factory.floor.layout.feeding import Outlet, outlets_of, passing
from factory.support.arrays import Array, Index, Truth
from factory.support.engine import mujoco
from factory.theory.control.mode import STILL
from factory.theory.control.profile import SpeedProfile
from factory.theory.plant.factory import Factory
from factory.theory.plant.operation import Operation
from factory.theory.problem.pag import NOPART

LEVEL = 5e-4
"""A lift is where it is to be for a part within this [m]."""


@dataclass(frozen=True, eq=False, slots=True)
class _Lifts:
    """The lifts that are set for each part: the `numbers` (k,) of those outlets, the `address` (k,)
    of each lift's position, and where it is to be (`level`) [m]."""

    numbers: Index
    address: Index
    level: Array

    @classmethod
    def of(cls, m: mujoco.MjModel, factory: Factory, outlets: Sequence[Outlet]) -> _Lifts:
        """Those of a model."""
        chosen = [(n, o) for n, o in enumerate(outlets) if o.robot in factory.adjusted]
        ups = [up for _, o in chosen if (up := factory.up(o.robot)) is not None]
        lifts = [m.joint(names.joint(factory.axes[up])).id for up in ups]
        level = [o.layout.visits[o.leaf.index, o.robot].up for _, o in chosen]
        numbers = np.array([n for n, _ in chosen], np.intp)
        return cls(numbers, m.jnt_qposadr[np.array(lifts, np.intp)], np.array(level))

    def narrow(self, home: Truth, d: mujoco.MjData) -> None:
        """Robots are at home for a part (n,) only where their lifts are at its height."""
        home[self.numbers] &= np.abs(d.qpos[self.address] - self.level) < LEVEL


class Passing:
    """The robots that take parts from feeders, by outlet (n,). `holds` (n,): whether the part taken
    last is not delivered yet."""

    def __init__(
        self,
        m: mujoco.MjModel,
        d: mujoco.MjData,
        model: Model,
        request: RunRequest,
        axes: Axes,
    ) -> None:
        factory, layout = model.factory, model.layout
        outlets = outlets_of(layout)
        carriers = [outlet.robot for outlet in outlets]
        self._d, self._carriers = d, np.array(carriers, np.intp)
        self._axes = axes
        self._home = np.array([layout.guidepaths[robot].length for robot in carriers])
        self._clear = self._home - [passing(outlet.layout, outlet.leaf) for outlet in outlets]
        hands = [layout.hand(robot) for robot in carriers]
        self._hang = [hand is not None and hand.kind.hangs for hand in hands]
        self._first = np.array([hand is not None and hand.first for hand in hands], bool)
        at = np.where(self._first, self._home, self._clear)
        self._points = Points(self._carriers, at, np.where(self._first, 1, -1))
        settings = request.settings
        fastest = settings.speed * (1 + request.jitter)
        self._fastest = SpeedProfile(fastest, settings.acceleration)
        self._lifts = _Lifts.of(m, factory, outlets)
        self._fed: dict[int, list[int]] = {}
        for number, robot in enumerate(carriers):
            self._fed.setdefault(robot, []).append(number)
        self.holds = np.zeros(len(carriers), bool)

    def end(self, operation: Operation) -> None:
        """Note that robots of an ended operation may have delivered."""
        for robot, label in zip(operation.robots, operation.after, strict=True):
            if robot in self._fed and label == NOPART:
                self.holds[self._fed[robot]] = False

    def holding(self, robot: int) -> None:
        """Note that a robot (index) has taken a part from its feeder."""
        self.holds[self._fed[robot]] = True

    def require_clear(self, robot: int) -> None:
        """A robot (index) holds nothing: the next part comes down once it is out of the way, or at
        home if its hand must be there first."""
        for number in self._fed.get(robot, ()):
            self.holds[number] = not self._first[number]

    def is_aside(self, number: int) -> bool:
        """Whether a robot is clear of its feeder's part. A robot whose hand must be there before
        the part always is."""
        at = self._at()[0][number]
        return bool(self._first[number] or at <= self._clear[number])

    def is_under(self, number: int) -> bool:
        """Whether a robot's empty hand is where the next part comes down. Hands from above come
        after the part."""
        return self._hang[number] and not self.is_aside(number)

    def clear(self) -> Truth:
        """Whether each robot (n,) is far enough away with its part for the next one to come down;
        or, if its hand must be there first, rests at home without one."""
        at, v = self._at()
        home = ~self.holds & (np.abs(v) < STILL) & (at >= self._home - HOME)
        self._lifts.narrow(home, self._d)
        return np.asarray(np.where(self._first, home, ~self.holds | (at <= self._clear)))

    def points(self, numbers: Sequence[int]) -> Points | None:
        """The points past which the robots of some outlets are out of the way; None for no such
        robot. One whose hand must be there first delivers its part before that: the end of an
        operation tells."""
        ways = [n for n in numbers if not (self._first[n] and self.holds[n])]
        return self._points.chosen(np.array(ways)) if ways else None

    def until_past(self, points: Points) -> float:
        """No robot comes past its point before so long [s], wherever it is and whatever pushes
        it."""
        ways = (points.at - self._axes.measured(self._d)[0][points.axes]) * points.direction
        return float(ways.min()) / self._fastest.speed

    def soonest(self, number: int) -> float:
        """Least time in which a robot can be at its feeder [s]; 0 for a hand from above: the part
        has to be down before."""
        if self._hang[number]:
            return 0.0
        way = float(self._home[number] - self._at()[0][number])
        return self._fastest.rest(max(way, 0.0))

    def _at(self) -> tuple[Array, Array]:
        """Positions [m] and speeds [m/s] of the robots (n,)."""
        x, v = self._axes.measured(self._d)
        return x[self._carriers], v[self._carriers]
