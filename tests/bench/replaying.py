"""The floor: the bare engine stepping the same model through the same motion.

While a factory runs, everything that is written into the engine between two calls of it is
recorded: setpoints, welds, contact masks, bodies put somewhere, sleepers woken. The replay writes
the same and steps as often, with nothing else in the loop; it ends in the same state to the last
bit, which is asserted, so both did the same physics.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from time import perf_counter
from typing import Any

import numpy as np

from factory.simulation.mujoco import world as physics
from factory.support.engine import mujoco
from tests.bench.factories import Steady, run_in, run_until

DATA = ("ctrl", "history", "qpos", "qvel", "eq_active", "tree_asleep", "xpos", "xmat", "xquat")
MODEL = (
    "tree_sleep_policy",
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
        self.seen = [array.copy() for array in arrays(self.m, self.d)]

    def step(self, m: mujoco.MjModel, d: mujoco.MjData, steps: int = 1) -> None:
        """Takes the place of the engine's step."""
        written: list[Write] = []
        for number, (now, before) in enumerate(zip(arrays(m, d), self.seen, strict=True)):
            at = np.flatnonzero(bits(now) != bits(before))
            if len(at):
                written.append((number, at, now.reshape(-1)[at]))
        self.writes.append((written, steps))
        mujoco.mj_step(m, d, steps)
        for now, before in zip(arrays(m, d), self.seen, strict=True):
            before[...] = now


def arrays(m: mujoco.MjModel, d: mujoco.MjData) -> list[Any]:
    """All that a world ever writes to."""
    return [getattr(d, name) for name in DATA] + [getattr(m, name) for name in MODEL]


def bits(array: Any) -> Any:
    """Flat, as integers: 0.0 and -0.0 differ."""
    flat = array.reshape(-1)
    return flat.view(f"i{flat.itemsize}")


class _Engine:
    """The engine's module for a world, with another step."""

    def __init__(self, step: Any) -> None:
        self.mj_step = step

    def __getattr__(self, name: str) -> Any:
        return getattr(mujoco, name)


@contextmanager
def stepping(step: Any) -> Iterator[None]:
    """The world steps by this function meanwhile."""
    own = physics.mujoco
    physics.mujoco = _Engine(step)
    try:
        yield
    finally:
        physics.mujoco = own


@dataclass(frozen=True)
class Floor:
    """Seconds for the same window: the factory's run loop, the engine's steps in it, and the bare
    replay; since when, and how many seconds were simulated."""

    since: float
    simulated: float
    run: float
    physics: float
    bare: float


def measure_floor(make: Any, steady: Steady, window: float) -> Floor:
    """Both over a window [s] since production repeats itself, of two runs that are one to the last
    bit: `make()` gives a simulation ready to go."""
    timed, recorded = make(), make()
    warm = run_in(timed, steady)
    run_in(recorded, steady)
    world = recorded.world
    recorder = Recorder(world.m, world.d)
    with stepping(recorder.step):
        run_until(recorded, warm + window)
    before, begin = timed.world.physics_time, perf_counter()
    run_until(timed, warm + window)
    run = perf_counter() - begin
    m, d = recorder.begin
    bare = replay(m, d, recorder.writes)
    for own in (world.d, timed.world.d):
        assert np.array_equal(d.qpos, own.qpos) and np.array_equal(d.qvel, own.qvel)
    return Floor(warm, window, run, timed.world.physics_time - before, bare)


def replay(m: mujoco.MjModel, d: mujoco.MjData, writes: list[tuple[list[Write], int]]) -> float:
    """Seconds to write and step."""
    flat = [array.reshape(-1) for array in arrays(m, d)]
    step = mujoco.mj_step
    begin = perf_counter()
    for written, steps in writes:
        for number, at, values in written:
            flat[number][at] = values
        step(m, d, steps)
    return perf_counter() - begin
