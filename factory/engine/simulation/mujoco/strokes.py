"""Axes that go from end to end: sliders of feeders, jaws of grippers.

A stroke is planned once and written ahead as a whole when it begins, so what moves by it costs
nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from factory.engine.simulation.mujoco.courses import Course, Move, planned
from factory.engine.simulation.mujoco.drives import Drives
from factory.engine.simulation.mujoco.sleep import Sleep
from factory.engine.timing.timing import CALM
from factory.support.arrays import Array, Index
from factory.support.engine import mujoco
from factory.support.settings import Settings
from factory.theory.control.governor import towards

NEVER = np.inf
"""When what rests comes to the end of its way [s]."""

Load = Callable[[Index, bool], None]
"""Sets the loads of axes, on their way up or down."""


@dataclass(frozen=True, slots=True, eq=False)
class Strokes:
    """The strokes of n axes, up and then down: from `low` to `high` (n,) [m], their durations
    `seconds` (2, n), and the `setpoints` (2, n, samples, 3) of their drives."""

    low: Array
    high: Array
    seconds: Array
    setpoints: Array = field(repr=False)

    @classmethod
    def of(
        cls,
        drives: Drives,
        load: Load,
        ends: tuple[Array, Array],
        limits: tuple[float, float],
        ticks: int,
        s: Settings,
    ) -> Strokes:
        """The strokes of axes between two `ends` [m], with a speed [m/s] and an acceleration
        [m/s²], within a number of ticks."""
        (low, high), every = ends, np.arange(len(ends[0]))
        speed, acceleration = (np.full(len(low), limit) for limit in limits)
        ways: list[Course] = []
        for begin, goals, down in ((low, high, False), (high, low, True)):

            def go(x: Array, v: Array, goals: Array = goals) -> Move:
                x1, v1, a = towards(goals, x, v, (speed, acceleration), s.tick)
                return x1, v1, a, bool((x1 == goals).all() and not v1.any())

            load(every, down)
            still = np.zeros(len(low))
            ways.append(planned(drives, every, (begin, still), (ticks, s.steps), go))
        longest = max(way.setpoints.shape[1] for way in ways)
        return cls(
            low,
            high,
            np.stack([((way.x != way.x[-1]).sum(axis=0) + CALM) * s.tick for way in ways]),
            np.stack([_padded(way.setpoints, longest) for way in ways]),
        )


class Stroking:
    """Axes (n,) that rest at an end of their way or are on a stroke to the other.

    Args:
        d: the engine's data.
        drives: their drives.
        sleep: what wakes them.
        body: the bodies that they move (n,).
        address: where their positions are in the engine's data (n,).
        load: sets their loads.
        strokes: their strokes.

    Attributes:
        ends: when each that is under way comes to the end of its way (n,) [s]; NEVER for others.
    """

    def __init__(
        self,
        d: mujoco.MjData,
        drives: Drives,
        sleep: Sleep,
        body: Index,
        address: Index,
        load: Load,
        strokes: Strokes,
    ) -> None:
        self._d, self._drives, self._sleep, self._body = d, drives, sleep, body
        self._address, self._load, self._strokes = address, load, strokes
        self._begun, self.ends = np.zeros(len(body)), np.full(len(body), NEVER)
        self._down = np.zeros(len(body), np.intp)

    def place(self, chosen: Index, down: bool) -> None:
        """Let axes stand at an end from now on, wherever they were."""
        ends = self._strokes.low if down else self._strokes.high
        self._d.qpos[self._address[chosen]] = ends[chosen]
        self._stand(chosen, down)

    def _stand(self, chosen: Index, down: bool) -> None:
        """Let axes stand, down or up."""
        if len(chosen):
            self._load(chosen, down)
            ends = self._strokes.low if down else self._strokes.high
            self._drives.stand(chosen, ends[chosen])

    def send(self, chosen: Index, down: bool, loaded: bool = False) -> None:
        """Start strokes down or up; `loaded`: with a load on the way up, too."""
        if not len(chosen):
            return
        self._load(chosen, down or loaded)
        self._drives.follow(chosen, self._strokes.setpoints[int(down), chosen])
        self._down[chosen], self._begun[chosen] = down, self._drives.time
        self.ends[chosen] = self._drives.time + self._strokes.seconds[int(down), chosen]
        self._sleep.wake(self._body[chosen])

    def show(self) -> None:
        """Write the present setpoints of what moves."""
        (moving,) = (self.ends < NEVER).nonzero()
        if len(moving):
            since = (self._drives.time - self._begun[moving]) / self._drives.timestep
            setpoints = self._strokes.setpoints
            at = np.clip(np.rint(since).astype(np.intp), 0, setpoints.shape[2] - 1)
            self._drives.show(moving, setpoints[self._down[moving], moving, at])

    def settle(self) -> bool:
        """Let those stand that have completed their strokes since. The engine lets them sleep by
        itself: until then they are never slow. Returns whether there are any."""
        (over,) = (self.ends <= self._drives.time + self._drives.timestep / 2).nonzero()
        if len(over):
            down = self._down[over] == 1
            self._stand(over[down], True)
            self._stand(over[~down], False)
            self.ends[over] = NEVER
        return bool(len(over))


def _padded(setpoints: Array, samples: int) -> Array:
    """A number of setpoints (n, samples, 3), with the last one repeated."""
    more = samples - setpoints.shape[1]
    return np.pad(setpoints, ((0, 0), (0, more), (0, 0)), mode="edge")
