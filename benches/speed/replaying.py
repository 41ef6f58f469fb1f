"""The floor: the bare engine stepping the same model through the same motion.

While a factory runs, everything that is written into the engine between two calls of it is
recorded: setpoints, welds, contact masks, friction under loads, bodies put somewhere, sleepers
woken. The replay writes the same and steps as often, with nothing else in the loop; it ends in the
same state to the last bit, which is asserted, so both did the same physics.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass, field
from time import process_time
from typing import Any

import numpy as np

from benches.speed.factories import Case, Steady, judge, produce, run_in, run_until
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.layout import Layout
from factory.support.engine import mujoco

DATA = ("ctrl", "history", "qpos", "qvel", "eq_active", "tree_asleep", "xpos", "xmat", "xquat")
MODEL = (
    "actuator_delay",
    "actuator_history",
    "tree_sleep_policy",
    "dof_frictionloss",
    "eq_obj2id",
    "geom_contype",
    "geom_conaffinity",
    "body_contype",
    "body_conaffinity",
    "exclude_signature",
)
Write = tuple[int, Any, Any]
"""Which array, where in it (flat), and what."""


@dataclass
class Recorder:
    """What was written before the engine's steps, and how many there were, from a state on."""

    m: mujoco.MjModel
    d: mujoco.MjData
    begin: tuple[mujoco.MjModel, mujoco.MjData] = field(init=False)
    writes: list[tuple[list[Write], int]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.begin = copy.copy(self.m), copy.copy(self.d)
        self.seen = self.before = self.now()
        self.time = self.d.time

    def now(self) -> list[Any]:
        """Copies of all that a world ever writes to."""
        return [array.copy() for array in arrays(self.m, self.d)]

    def step(self, steps: int) -> None:
        """Takes the place of the engine's step. A world that has gone back to where its last step
        began takes that step again, so it is forgotten."""
        if self.d.time < self.time:
            self.writes.pop()
            self.seen = self.before
        written: list[Write] = []
        for number, (now, then) in enumerate(zip(arrays(self.m, self.d), self.seen, strict=True)):
            at = np.flatnonzero(bits(now) != bits(then))
            if len(at):
                written.append((number, at, now.reshape(-1)[at]))
        self.writes.append((written, steps))
        mujoco.mj_step(self.m, self.d, steps)
        self.before, self.seen, self.time = self.seen, self.now(), self.d.time


def arrays(m: mujoco.MjModel, d: mujoco.MjData) -> list[Any]:
    """All that a world ever writes to."""
    return [getattr(d, name) for name in DATA] + [getattr(m, name) for name in MODEL]


def bits(array: Any) -> Any:
    """Flat, as integers: 0.0 and -0.0 differ."""
    flat = array.reshape(-1)
    return flat.view(f"i{flat.itemsize}")


def same(one: Any, other: Any) -> bool:
    """Whether two arrays are the same to the last bit."""
    return bool(np.array_equal(bits(one), bits(other)))


@dataclass(frozen=True)
class Floor:
    """Processor seconds for the same window, the factory's run loop and the bare replay; since when
    and until when [s], and the engine's timestep [s]."""

    since: float
    until: float
    timestep: float
    run: float
    bare: float


def measure_floor(case: Case, layout: Layout, window: float) -> Floor:
    """Both from the empty factory, or over a window [s] since production repeats itself: of two
    runs that are one to the last bit."""
    steady = Steady.of(layout, case.wip) if case.units is None else None
    timed, recorded = case.simulation(layout), case.simulation(layout)
    if steady is not None:
        run_in(timed, steady)
        run_in(recorded, steady)
    world, since = recorded.physical, recorded.world.time
    recorder = Recorder(world.m, world.d)
    world.motion.stepping.step = recorder.step  # type: ignore[attr-defined]
    _go(recorded, case.units, since + window)
    begin = process_time()
    _go(timed, case.units, since + window)
    run = process_time() - begin
    judge(timed)
    m, d = recorder.begin
    bare = replay(m, d, recorder.writes)
    assert all(map(same, arrays(m, d), recorder.seen)), "the replay ends in another state"
    pair = [arrays(own.m, own.d) for own in (world, timed.physical)]
    assert all(map(same, *pair)), "two runs of one factory differ"
    return Floor(since, timed.world.time, float(m.opt.timestep), run, bare)


def _go(simulation: Simulation, units: int | None, until: float) -> None:
    if units is None:
        run_until(simulation, until)
    else:
        produce(simulation, units)


def replay(m: mujoco.MjModel, d: mujoco.MjData, writes: list[tuple[list[Write], int]]) -> float:
    """Processor seconds to write and step."""
    flat = [array.reshape(-1) for array in arrays(m, d)]
    step = mujoco.mj_step
    begin = process_time()
    for written, steps in writes:
        for number, at, values in written:
            flat[number][at] = values
        step(m, d, steps)
    return process_time() - begin
