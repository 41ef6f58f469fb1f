"""How robots move: which leave the place where they stood, come to their goal, pass it, or do not
follow their setpoints."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from factory.record.monitor.anatomy import Anatomy
from factory.record.monitor.observation import Array, Index, Observation
from factory.support.settings import Settings

REST = 0.01
"""Speed below which robots hand over [m/s]."""

NEAREST = 1e-3
"""Upper bound on the way that a robot at rest may go within a tick [m]."""

LAG = 0.01
"""A robot follows its setpoint within this [m], plus its way in `LATENCY`."""

LATENCY = 0.02
"""More than the time constant of a drive's position loop, 1/70 s [s]."""

LATE = 0.2
"""A robot that lags for so long is stuck [s]: to brake from full speed takes as long."""


@dataclass(frozen=True, slots=True)
class Tolerance:
    """What counts as at rest at a place: slower than `slow` [m/s], and within `slack` [m] of a goal
    ball."""

    slow: float
    slack: float

    @classmethod
    def of(cls, settings: Settings) -> Tolerance:
        """That of a run that is seen tick by tick."""
        slow = REST + min(settings.acceleration * settings.tick, 5 * REST)
        return cls(slow, min(slow * settings.tick, NEAREST))


@dataclass(frozen=True, slots=True)
class _State:
    """Positions `x` [m], speeds `v` [m/s] and setpoints `s` [m] of all robots (R,) at time `t`."""

    t: float
    x: Array = field(repr=False)
    v: Array = field(repr=False)
    s: Array = field(repr=False)

    @classmethod
    def of(cls, anatomy: Anatomy, seen: Observation) -> _State:
        """That in an observation."""
        x, v = seen.qpos[anatomy.slide], seen.qvel[anatomy.dof]
        return cls(seen.time, x, v, seen.ctrl[anatomy.drive])


class AxisMotion:
    """The motion of all robots (R,) along their guidepaths, from tick to tick.

    `gone`: whether a robot has left `anchor`, where it stood, for `target`, both arc lengths [m];
    `ball`: how near to either it is there; `came`: since when it has been at rest there [s], as of
    its last stay; `still`: when its setpoint stood last; `first`: when it moved first after that.
    `radius`: each robot's largest goal ball [m].
    """

    def __init__(
        self, anatomy: Anatomy, settings: Settings, radius: Array, first: Observation
    ) -> None:
        self.anatomy, self.rest = anatomy, Tolerance.of(settings)
        self.ball = radius + self.rest.slack
        self.now = self.before = _State.of(anatomy, first)
        self.anchor, self.target = self.now.s.copy(), self.now.s.copy()
        self.gone, self.inside = np.zeros(len(radius), bool), np.ones(len(radius), bool)
        self.came, self.still, self.first = (np.full(len(radius), first.time) for _ in range(3))

    def look(self, seen: Observation) -> tuple[Index, Index, Index]:
        """The robots that now leave, that arrive, and that pass their target without stopping."""
        self.before, self.now = self.now, _State.of(self.anatomy, seen)
        now, t = self.now, seen.time
        moved = now.s != self.before.s
        np.copyto(self.first, t, where=moved & (self.still == self.before.t))
        np.copyto(self.still, t, where=~moved)
        spot = np.where(self.gone, self.target, self.anchor)
        away = now.s - spot
        near = (np.abs(now.x - spot) <= self.ball) & (np.abs(now.v) <= self.rest.slow)
        inside = near & (~self.gone | (np.abs(away) <= self.ball))
        np.copyto(self.came, t, where=inside & ~self.inside)
        self.inside = inside
        left = ~self.gone & (np.abs(away) > self.ball)
        arrived = self.gone & inside
        passed = self.gone & (np.sign(spot - self.anchor) * away > self.ball)
        self.anchor[arrived] = self.target[arrived]
        self.gone[arrived] = False
        return np.flatnonzero(left), np.flatnonzero(arrived), np.flatnonzero(passed)

    def stand(self, robot: int, goal: float) -> None:
        """A robot has ended an operation: it stands at its goal, or where its setpoint is now."""
        s = float(self.now.s[robot])
        there = abs(s - goal) <= self.ball[robot]
        if self.gone[robot]:
            self.came[robot] = self.now.t
            self.inside[robot] = True
        self.anchor[robot] = goal if there else s
        self.gone[robot] = False

    def leave(self, robot: int, target: float) -> float:
        """A robot makes for a target; gives the time [s] by which it has begun to."""
        stood = self.still[robot] >= self.came[robot]
        self.target[robot] = target
        self.gone[robot] = True
        self.inside[robot] = False
        return float(self.first[robot]) if stood else self.now.t

    def misses(self, robot: int, goal: float, radius: float) -> float:
        """How far [m] a robot was off a goal ball as of this tick and the one before, 0 where it
        was at rest in it in either."""
        for state in (self.before, self.now):
            near = abs(state.x[robot] - goal) <= radius + self.rest.slack
            if near and abs(state.v[robot]) <= self.rest.slow:
                return 0.0
        return max(abs(float(self.before.x[robot]) - goal), 1e-9)


class Lags:
    """Since when [s] the joint of each actuator (A,) has lagged behind its setpoint: `since`, inf
    where it does not, -inf where that was told."""

    def __init__(self, anatomy: Anatomy, settings: Settings) -> None:
        self.anatomy, self.limit = anatomy, LAG + LATENCY * settings.speed
        self.since = np.full(len(anatomy.joint), np.inf)

    def stuck(self, seen: Observation) -> list[tuple[int, float]]:
        """The actuators whose joints have lagged for too long, each once, and since when [s]."""
        behind = np.abs(seen.qpos[self.anatomy.joint] - seen.ctrl[self.anatomy.setpoint])
        lagging: NDArray[np.bool_] = behind > self.limit
        if not lagging.any():
            self.since.fill(np.inf)
            return []
        self.since = np.where(lagging, np.minimum(self.since, seen.time), np.inf)
        found = np.flatnonzero((self.since <= seen.time - LATE) & (self.since > -np.inf))
        since = self.since[found].tolist()
        self.since[found] = -np.inf
        return list(zip(found.tolist(), since, strict=True))
