"""The sliders of feeders: each goes up empty and comes down with a part.

The slider of a line presents several parts, one after the other, each at its height. A stroke is
planned once and written ahead as a whole when it begins, so a moving slider costs nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from factory.engine.mjcf import names
from factory.engine.mjcf.driving import GRAVITY
from factory.engine.mjcf.feeders import SLIDER_MASS
from factory.engine.mjcf.model import Model, stroke_ticks
from factory.engine.simulation.mujoco.courses import Course, Move, planned
from factory.engine.simulation.mujoco.drives import Drives
from factory.engine.simulation.mujoco.model_arrays import ModelArrays
from factory.engine.simulation.mujoco.sleep import Sleep
from factory.engine.timing.timing import CALM
from factory.floor.layout.feeding import outlets_of
from factory.support.arrays import Array, Index
from factory.support.engine import mujoco
from factory.support.settings import Settings
from factory.theory.control.governor import towards

ROUNDED = 0.01
"""What is due so much of a tick later is due."""

NEVER = np.inf
"""When a slider that rests comes to the end of its way [s]."""


@dataclass(frozen=True, slots=True, eq=False)
class Strokes:
    """The strokes of n sliders, up empty and then down with a load: from `low` to `high` (n,) [m],
    their durations `seconds` (2, n), and the `setpoints` (2, n, samples, 3) of their drives."""

    low: Array
    high: Array
    seconds: Array
    setpoints: Array = field(repr=False)

    @classmethod
    def of(
        cls, drives: Drives, loads: Array, ends: tuple[Array, Array], ticks: int, s: Settings
    ) -> Strokes:
        """The strokes of sliders between two `ends` [m] with given loads [kg], within a number of
        ticks."""
        (low, high), every = ends, np.arange(len(loads))
        limits = _limits(s, len(loads))
        ways: list[Course] = []
        for begin, goals, load in ((low, high, np.zeros(len(loads))), (high, low, loads)):

            def go(x: Array, v: Array, goals: Array = goals) -> Move:
                x1, v1, a = towards(goals, x, v, limits, s.tick)
                return x1, v1, a, bool((x1 == goals).all() and not v1.any())

            drives.load(every, load, (SLIDER_MASS + load) * GRAVITY)
            still = np.zeros(len(loads))
            ways.append(planned(drives, every, (begin, still), (ticks, s.steps), go))
        longest = max(way.setpoints.shape[1] for way in ways)
        return cls(
            low,
            high,
            np.stack([((way.x != way.x[-1]).sum(axis=0) + CALM) * s.tick for way in ways]),
            np.stack([_padded(way.setpoints, longest) for way in ways]),
        )


class Sliders:
    """The sliders of the feeders (n,), in the order of their outlets. One from which the parts of
    several outlets hang is there for each of them, and has at most one part at a time.

    Attributes:
        ends: when each that is under way comes to the end of its way (n,) [s]; NEVER for
            others.
        up: when the first of those on their way up does [s].
        trees: their kinematic trees (n,).
    """

    def __init__(self, arrays: ModelArrays, d: mujoco.MjData, model: Model, sleep: Sleep) -> None:
        m, outlets = arrays.m, outlets_of(model.layout)
        feeds = [m.equality(names.feed(outlet.label)).id for outlet in outlets]
        self._body, settings = m.eq_obj1id[feeds], model.settings
        sliders = [m.body(body).name for body in self._body.tolist()]
        joint = m.body_jntadr[self._body]
        drives = np.array([m.actuator(slider).id for slider in sliders])
        self.trees = m.body_treeid[self._body]
        self._d, self._address = d, m.jnt_qposadr[joint]
        inertia = m.body_subtreemass[self._body] + m.dof_armature[m.jnt_dofadr[joint]]
        self._drives, self._sleep = Drives(arrays, d, drives, inertia.round(9)), sleep
        self._loads = np.array([model.masses[outlet.label] for outlet in outlets])
        lengths = np.array([outlet.feeder.stroke for outlet in outlets])
        named = {names.slider(outlet.label): number for number, outlet in enumerate(outlets)}
        high = lengths[[named[slider] for slider in sliders]]
        ends = high - lengths, high
        ticks = stroke_ticks(model.layout, settings)
        self._strokes = Strokes.of(self._drives, self._loads, ends, ticks, settings)
        self._soon = ROUNDED * settings.tick
        self._begun, self.ends = np.zeros(len(outlets)), np.full(len(outlets), NEVER)
        self._down = np.zeros(len(outlets), np.intp)
        self.up = NEVER

    @property
    def now(self) -> float:
        """The current time of strokes' ends [s]."""
        return self._drives.time + self._soon

    def _load(self, chosen: Index, loaded: bool) -> None:
        """Set the loads of sliders."""
        load = self._loads[chosen] * loaded
        self._drives.load(chosen, load, (SLIDER_MASS + load) * GRAVITY)

    def begin(self, down: Index) -> None:
        """At the start all sliders stand: up and empty, or `down` with their loads."""
        up = np.setdiff1d(np.arange(len(self.ends)), down)
        for chosen, at, is_down in (
            (up, self._strokes.high, False),
            (down, self._strokes.low, True),
        ):
            self._d.qpos[self._address[chosen]] = at[chosen]
            self._stand(chosen, is_down)

    def _stand(self, chosen: Index, down: bool) -> None:
        """Let sliders stand, down with their loads or up and empty."""
        if len(chosen):
            self._load(chosen, down)
            ends = self._strokes.low if down else self._strokes.high
            self._drives.stand(chosen, ends[chosen])

    def is_up(self, number: int) -> bool:
        """Whether a resting slider is up."""
        low, high = self._strokes.low[number], self._strokes.high[number]
        at = self._d.qpos[self._address[number]]
        return bool(abs(at - high) < abs(at - low))

    def rises(self, number: int) -> bool:
        """Whether a slider is on its way up."""
        return bool(self.ends[number] < NEVER and not self._down[number])

    def send(self, chosen: Index, down: bool, loaded: bool = False) -> None:
        """Start strokes: down with loads, up empty, or up with a withdrawn part."""
        if not len(chosen):
            return
        self._load(chosen, down or loaded)
        self._drives.follow(chosen, self._strokes.setpoints[int(down), chosen])
        self._down[chosen], self._begun[chosen] = down, self._drives.time
        self.ends[chosen] = self._drives.time + self._strokes.seconds[int(down), chosen]
        self.up = self._first_up()
        self.show(0)
        self._sleep.wake(self._body[chosen])

    def show(self, steps: int) -> None:
        """Write the setpoints of moving sliders after some timesteps."""
        (moving,) = (self.ends < NEVER).nonzero()
        if len(moving):
            since = (self._drives.time - self._begun[moving]) / self._drives.timestep
            setpoints = self._strokes.setpoints
            at = np.rint(since).astype(np.intp) + steps
            at = np.clip(at, 0, setpoints.shape[2] - 1)
            self._drives.show(moving, setpoints[self._down[moving], moving, at])

    def settle(self) -> None:
        """Let sliders stand that have completed their strokes since. The engine lets them sleep by
        itself: until then they are never slow."""
        (over,) = (self.ends <= self._drives.time + self._drives.timestep / 2).nonzero()
        if len(over):
            down = self._down[over] == 1
            self._stand(over[down], True)
            self._stand(over[~down], False)
            self.ends[over] = NEVER
            self.up = self._first_up()

    def _first_up(self) -> float:
        return float(self.ends[self._down == 0].min(initial=NEVER))


def _limits(settings: Settings, count: int) -> tuple[Array, Array]:
    """Speed and acceleration limits of sliders."""
    speed, acceleration = settings.feeder_limits
    return np.full(count, speed), np.full(count, acceleration)


def _padded(setpoints: Array, samples: int) -> Array:
    """A given number of setpoints (n, samples, 3), with the last one repeated."""
    more = samples - setpoints.shape[1]
    return np.pad(setpoints, ((0, 0), (0, more), (0, 0)), mode="edge")
