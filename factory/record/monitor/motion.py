"""How robots move: which of them leave the place where they stood, come to their goal, pass it, or
do not follow their setpoints. Nothing here loops over robots."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from factory.record.monitor.anatomy import Anatomy
from factory.record.monitor.observation import Array, Index, Sight
from factory.support.settings import Settings

REST = 0.01
"""Robots hand over only when slower than this [m/s]."""

NEAREST = 1e-3
"""What a robot at rest may do within a tick counts at most so far [m]."""

LAG = 0.01
"""A robot follows its setpoint within this [m], and what it does in `LATENCY`."""

LATENCY = 0.02
"""[s]: more than the time constant of a drive's position loop, 1/70 s."""

LATE = 0.2
"""A robot that lags for so long is stuck [s]: to brake from full speed takes as long."""


@dataclass(slots=True)
class Motion:
    """The state of all robots (R,), from tick to tick.

    `gone`: whether a robot has left `anchor`, where it stood, for `target`, both arc lengths [m];
    `ball`: how near to either it is there; `came`: since when it has been at rest there [s], as of
    its last stay; `still`: when its setpoint stood last; `first`: when it moved first after that.
    """

    anatomy: Anatomy
    settings: Settings
    radius: Array
    slack: float = field(init=False)
    slow: float = field(init=False)
    ball: Array = field(init=False, repr=False)
    anchor: Array = field(init=False, repr=False)
    target: Array = field(init=False, repr=False)
    gone: NDArray[np.bool_] = field(init=False, repr=False)
    inside: NDArray[np.bool_] = field(init=False, repr=False)
    came: Array = field(init=False, repr=False)
    still: Array = field(init=False, repr=False)
    first: Array = field(init=False, repr=False)
    x: Array = field(init=False, repr=False)
    v: Array = field(init=False, repr=False)
    s: Array = field(init=False, repr=False)
    before: tuple[Array, Array] = field(init=False, repr=False)
    late: Array = field(init=False, repr=False)
    time: float = field(init=False)
    lag: float = field(init=False)

    def __post_init__(self) -> None:
        settings = self.settings
        gain = settings.acceleration * settings.tick
        self.slow = REST + min(gain, 5 * REST)
        self.slack = min(self.slow * settings.tick, NEAREST)
        self.ball = self.radius + self.slack
        self.lag = LAG + LATENCY * settings.speed

    def begin(self, sight: Sight) -> None:
        """Robots stand where they are at first."""
        count = len(self.anatomy.slide)
        self.x, self.v, self.s = self._state(sight)
        self.before = self.x, self.v
        self.anchor, self.target = self.s.copy(), self.s.copy()
        self.gone, self.inside = np.zeros(count, bool), np.ones(count, bool)
        self.came, self.still, self.first = (np.full(count, sight.time) for _ in range(3))
        self.late = np.full(len(self.anatomy.joint), np.inf)
        self.time = sight.time

    def _state(self, sight: Sight) -> tuple[Array, Array, Array]:
        anatomy = self.anatomy
        return sight.qpos[anatomy.slide], sight.qvel[anatomy.dof], sight.ctrl[anatomy.drive]

    def look(self, sight: Sight) -> tuple[Index, Index, Index]:
        """The robots that now leave, that arrive, and that pass their target without stopping."""
        x, v, s = self._state(sight)
        t = sight.time
        moved = s != self.s
        np.copyto(self.first, t, where=moved & (self.still == self.time))
        np.copyto(self.still, t, where=~moved)
        spot = np.where(self.gone, self.target, self.anchor)
        away = s - spot
        near = (np.abs(x - spot) <= self.ball) & (np.abs(v) <= self.slow)
        inside = near & (~self.gone | (np.abs(away) <= self.ball))
        np.copyto(self.came, t, where=inside & ~self.inside)
        self.before = self.x, self.v
        self.x, self.v, self.s, self.inside, self.time = x, v, s, inside, t
        left = ~self.gone & (np.abs(away) > self.ball)
        arrived = self.gone & inside
        passed = self.gone & (np.sign(spot - self.anchor) * away > self.ball)
        if not (left | arrived | passed).any():
            nobody = np.empty(0, np.intp)
            return nobody, nobody, nobody
        self.anchor[arrived] = self.target[arrived]
        self.gone[arrived] = False
        return np.flatnonzero(left), np.flatnonzero(arrived), np.flatnonzero(passed)

    def stuck(self, sight: Sight) -> list[tuple[int, float]]:
        """The actuators whose joints have lagged behind their setpoints for too long, each once,
        and since when [s]."""
        behind = np.abs(sight.qpos[self.anatomy.joint] - sight.ctrl[self.anatomy.setpoint])
        lagging = behind > self.lag
        if not lagging.any():
            self.late.fill(np.inf)
            return []
        self.late = np.where(lagging, np.minimum(self.late, sight.time), np.inf)
        found = np.flatnonzero((self.late <= sight.time - LATE) & (self.late > -np.inf))
        since = self.late[found].tolist()
        self.late[found] = -np.inf
        return list(zip(found.tolist(), since, strict=True))

    def stand(self, robot: int, goal: float) -> None:
        """A robot has ended an operation: it stands at its goal, or where its setpoint is now."""
        s = float(self.s[robot])
        there = abs(s - goal) <= self.ball[robot]
        if self.gone[robot]:
            self.came[robot] = self.time
            self.inside[robot] = True
        self.anchor[robot] = goal if there else s
        self.gone[robot] = False

    def leave(self, robot: int, target: float) -> float:
        """A robot makes for a target; gives the time [s] by which it has begun to."""
        stood = self.still[robot] >= self.came[robot]
        self.target[robot] = target
        self.gone[robot] = True
        self.inside[robot] = False
        return float(self.first[robot]) if stood else self.time

    def misses(self, robot: int, goal: float, radius: float) -> float:
        """How far [m] a robot was off a goal ball as of this tick and the one before, 0 where it
        was at rest in it in either."""
        reach = radius + self.slack
        for x, v in (self.before, (self.x, self.v)):
            if abs(x[robot] - goal) <= reach and abs(v[robot]) <= self.slow:
                return 0.0
        return max(abs(float(self.before[0][robot]) - goal), 1e-9)
