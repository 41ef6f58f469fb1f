"""Motion of robots: which leave their place, arrive at their goal, pass it, or do not follow their
setpoints."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from factory.api import Observation, Settings
from factory.apps.monitor.anatomy import Anatomy
from factory.apps.monitor.grips import MISSED
from factory.support.arrays import Array, Index

REST = 0.01
"""Speed below which robots hand over [m/s]."""

NEAREST = 1e-3
"""Upper bound on the displacement of a robot at rest within a tick [m]."""

LAG = 0.01
"""Largest lag of a robot behind its setpoint [m], in addition to its displacement in `LATENCY`."""

LATENCY = 0.02
"""Upper bound on the time constant of a drive's position loop, 1/70 s [s]."""

TINY = 1e-9
"""Times that differ by less are equal [s]."""

ASTRAY = 0.01
"""Largest distance of a robot from a way along which several joints move it [m, rad]."""

LATE = 0.2
"""Duration of a lag after which a robot is stuck [s]: that of braking from full speed."""


@dataclass(frozen=True, slots=True)
class Tolerance:
    """Tolerance of rest at a place: slower than `slow` [m/s], and within `slack` [m] of a goal
    ball; `tick` [s]: greatest age of an observation."""

    slow: float
    slack: float
    tick: float

    @classmethod
    def of(cls, settings: Settings) -> Tolerance:
        """The tolerance for observations tick by tick."""
        slow = REST + min(settings.acceleration * settings.tick, 5 * REST)
        return cls(slow, min(slow * settings.tick, NEAREST), settings.tick)


@dataclass(frozen=True, slots=True)
class _State:
    """Positions `x` [m], speeds `v` [m/s] and setpoints `s` [m] of all robots (R,) at time `t`."""

    t: float
    x: Array = field(repr=False)
    v: Array = field(repr=False)
    s: Array = field(repr=False)
    at_end: bool = False

    @classmethod
    def of(cls, anatomy: Anatomy, seen: Observation) -> _State:
        """The state in an observation."""
        x, v = seen.qpos[anatomy.slide], seen.qvel[anatomy.dof]
        s, bent = seen.ctrl[anatomy.drive], anatomy.bent
        if len(bent.robots):
            x[bent.robots], v[bent.robots] = bent.along(seen.qpos, seen.qvel)
            s[bent.robots] = bent.reached(seen.ctrl)
        return cls(seen.time, x, v, s, seen.at_end)


class _Setpoints:
    """Times [s] (R,) at which setpoints last stood at, or approached, the place of their robot
    (`still`), and first departed after that (`first`); `seen`: time of the last observation."""

    def __init__(self, count: int, t: float) -> None:
        self.still, self.first, self.seen = np.full(count, t), np.full(count, t), t

    def look(self, moved: NDArray[np.bool_], t: float) -> None:
        """Take in the setpoints that have departed since the last observation."""
        np.copyto(self.first, t, where=moved & (self.still == self.seen))
        np.copyto(self.still, t, where=~moved)
        self.seen = t


class AxisMotion:
    """The motion of all robots (R,) along their guidepaths, over the observations.

    `spot`: place or target of a robot, arc length [m]; `way`: direction to it, 0 where it stands;
    `ball`: radius around the spot [m]; `inside`: whether the robot is at rest there; `came` (2, R):
    bounds of the time [s] at which it came to rest there; `ended`: time of the observed end of its
    operation [s]; `written`: setpoints observed within a tick, with the time, not counted yet.
    `radius`: largest goal ball of each robot [m].
    """

    def __init__(
        self, anatomy: Anatomy, settings: Settings, radius: Array, first: Observation
    ) -> None:
        self.anatomy, self.rest = anatomy, Tolerance.of(settings)
        self.ball = radius + self.rest.slack
        self.now = self.before = _State.of(anatomy, first)
        self.spot, self.way = self.now.s.copy(), np.zeros(len(radius))
        self.inside = np.ones(len(radius), bool)
        self.came = np.full((2, len(radius)), first.time)
        self.ended = np.full(len(radius), -np.inf)
        self.setpoints = _Setpoints(len(radius), first.time)
        self.written: deque[tuple[float, Array]] = deque()

    def look(self, seen: Observation) -> tuple[Index, Index, Index]:
        """The robots that leave, arrive, and pass their target without stopping."""
        self.before, self.now, t = self.now, _State.of(self.anatomy, seen), seen.time
        if seen.at_end and t - self.before.t <= self.rest.tick:
            # within a tick, a robot that runs its own program has its setpoints written ahead
            self.written.append((t, self.now.s))
            self.now = replace(self.now, s=self._tick_old(t))
        else:
            self.written.clear()
            off, before = np.abs(self.now.s - self.spot), np.abs(self.before.s - self.spot)
            self.setpoints.look(off > before, t)
        now, gone = self.now, self.way != 0.0
        away = now.s - self.spot
        far = np.abs(away) > self.ball
        near = (np.abs(now.x - self.spot) <= self.ball) & (np.abs(now.v) <= self.rest.slow)
        inside = near & ~(gone & far)
        fresh = inside > self.inside
        self.came[0, fresh], self.came[1, fresh] = self.before.t, t
        self.inside = inside
        left = far > gone
        if left.any():
            creeping = left & (t - self.ended <= self.rest.tick)
            if creeping.any():  # one that runs its own program hears of the end within a tick
                np.copyto(self.spot, now.s, where=creeping)
                left &= ~creeping
        arrived = (gone & inside).nonzero()[0]
        passed = (self.way * away > self.ball).nonzero()[0]
        self.way[arrived] = 0.0
        return left.nonzero()[0], arrived, passed

    def _tick_old(self, t: float) -> Array:
        """The latest setpoints that are at least a tick old."""
        setpoints = self.before.s
        while self.written[0][0] <= t - self.rest.tick + TINY:
            setpoints = self.written.popleft()[1]
        return setpoints

    def stand(self, robot: int, goal: float) -> None:
        """A robot has ended an operation: it stands at its goal, or else at its setpoint."""
        s, ball = float(self.now.s[robot]), self.ball[robot]
        spot = goal if abs(s - goal) <= ball else s
        if self.way[robot] or abs(spot - self.spot[robot]) > ball:
            self.came[:, robot] = self.before.t, self.now.t
            self.inside[robot] = True
        self.spot[robot] = spot
        self.way[robot] = 0.0
        self.ended[robot] = self.now.t
        self.setpoints.still[robot] = -np.inf  # it has come, and has not been seen to stand since

    def leaves(self, robot: int) -> bool:
        """Whether a robot leaves its place; not if its operation has ended since."""
        away = abs(self.now.s[robot] - self.spot[robot]) > self.ball[robot]
        return bool(away and not self.way[robot])

    def begun(self, robot: int) -> float:
        """Upper bound on the time [s] at which a leaving robot departed."""
        still, seen = self.setpoints.still[robot], self.setpoints.seen
        # one that stood when setpoints were counted last has been seen to go off only now
        stood = self.came[1, robot] <= still < seen
        return float(self.setpoints.first[robot]) if stood else self.now.t

    def leave(self, robot: int, target: float) -> None:
        """A robot departs for a target, where it may be already."""
        self.way[robot] = 1.0 if target > self.spot[robot] else -1.0
        self.spot[robot] = target
        now, ball = self.now, self.ball[robot]
        there = max(abs(now.s[robot] - target), abs(now.x[robot] - target)) <= ball
        self.inside[robot] = there and abs(now.v[robot]) <= self.rest.slow
        if self.inside[robot]:
            self.way[robot] = 0.0
            self.came[:, robot] = self.before.t, now.t

    def misses(self, robot: int, goal: float, radius: float) -> float:
        """Distance [m] of a robot from a goal ball, 0 where it is at rest in it, before or after
        the present tick."""
        looked, slack = (self.before, self.now), self.rest.slack
        if self.now.at_end:
            looked, slack = (self.now, self.now), MISSED
        for state in looked:
            near = abs(state.x[robot] - goal) <= radius + slack
            if near and abs(state.v[robot]) <= self.rest.slow:
                return 0.0
        return max(abs(float(looked[0].x[robot]) - goal), 1e-9)


class Lags:
    """Time [s] since which the joint of each actuator (A,) has lagged behind its setpoint: `since`,
    inf where it does not, -inf where it has been reported."""

    def __init__(self, anatomy: Anatomy, settings: Settings) -> None:
        self.anatomy, self.limit = anatomy, LAG + LATENCY * settings.speed
        self.since = np.full(len(anatomy.joint), np.inf)

    def stuck(self, seen: Observation) -> list[tuple[int, float]]:
        """The actuators whose joints have lagged for too long, each once, with the start [s]."""
        behind = np.abs(seen.qpos[self.anatomy.joint] - seen.ctrl[self.anatomy.setpoint])
        lagging: NDArray[np.bool_] = behind > self.limit
        if not lagging.any():
            self.since.fill(np.inf)
            return []
        self.since = np.where(lagging, np.minimum(self.since, seen.time), np.inf)
        actuators = np.flatnonzero((self.since <= seen.time - LATE) & (self.since > -np.inf))
        since = self.since[actuators].tolist()
        self.since[actuators] = -np.inf
        return list(zip(actuators.tolist(), since, strict=True))


class Straying:
    """The robots that several joints move and that are away from their ways, each told of once."""

    def __init__(self, anatomy: Anatomy) -> None:
        self.bent, self.told = anatomy.bent, set[int]()

    def astray(self, seen: Observation) -> list[tuple[int, float]]:
        """The robots that are astray, and how far they are from their ways [m, rad]."""
        if not len(self.bent.robots):
            return []
        apart = self.bent.apart(seen.qpos)
        rows = [row for row in np.flatnonzero(apart > ASTRAY).tolist() if row not in self.told]
        self.told.update(rows)
        return [(int(self.bent.robots[row]), float(apart[row])) for row in rows]
