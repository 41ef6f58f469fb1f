"""The delays of a factory's operations, also with changed robots."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType

import numpy as np

from factory.control.mode import Array, Limits, Mode
from factory.control.profile import SpeedProfile, World, mode_time
from factory.layout.layout import Layout
from factory.layout.outfeed import away, leaving
from factory.modes.modes import operation_modes, operation_starts, robot_limits
from factory.modes.staging import HeadStart, staged, stages_of, with_time
from factory.plant.factory import Factory
from factory.simulation.starting import start_positions
from factory.support.settings import Settings
from factory.timing.prediction import gating, one_after_the_other, waits_for_hands, way_time

AT_ONCE = 1e6
"""A factor on a speed that leaves only the acceleration as a bound."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """Changes of some robots (index): factors on their `speed`, their `acceleration` and the length
    of each of their ways (`way`); the number of robots that share the work of one (`copies`)."""

    speed: Mapping[int, float] = field(default_factory=dict)
    acceleration: Mapping[int, float] = field(default_factory=dict)
    way: Mapping[int, float] = field(default_factory=dict)
    copies: Mapping[int, int] = field(default_factory=dict)


AS_IT_IS = Change()


@dataclass(frozen=True)
class Timing:
    """The delays of a layout, by its modes, where each starts, and the robots' limits.

    Speeds are those of `seed` and `jitter`, as in a run. Raises InputError where a mode cannot
    reach its goal.
    """

    layout: Layout
    settings: Settings = Settings()  # noqa: RUF009
    world: World = "mujoco"
    seed: int = 0
    jitter: float = 0.0

    @property
    def factory(self) -> Factory:
        """The factory that is laid out."""
        return self.layout.factory

    @cached_property
    def modes(self) -> Sequence[Mode]:
        """The mode of each operation."""
        return operation_modes(self.layout, self.settings.eps)

    @cached_property
    def limits(self) -> Limits:
        """The limits of each axis."""
        return robot_limits(self.layout, self.settings, self.seed, self.jitter)[0]

    @cached_property
    def stages(self) -> tuple[HeadStart, ...]:
        """The ways that robots go ahead of operations while they wait, if they are to."""
        found = stages_of(self.layout, self.modes, self.settings)
        return with_time(self.layout, found, self.world)

    @cached_property
    def left(self) -> list[Array]:
        """Where the operations before leave the axes of each operation, in the long run."""
        return operation_starts(self.layout)

    @cached_property
    def starts(self) -> list[Array]:
        """Where the axes of each operation are when it starts, in the long run, if those that go
        ahead are there by then."""
        return staged(self.left, self.stages)

    def ways(self, change: Change = AS_IT_IS) -> dict[tuple[int, int], float]:
        """The time [s] of a robot to go ahead to an operation, by (robot, operation)."""
        found = one_after_the_other(
            (stage, self._way(stage, stage.start, change)) for stage in self.stages
        )
        for stage, begin in self._gating:
            key = stage.robot, stage.operation
            found[key] = max(found[key], self._delay(stage.operation, begin, change))
        return found

    @cached_property
    def _gating(self) -> tuple[tuple[HeadStart, Array], ...]:
        """The ways ahead of robots for which others wait, and where all are before them."""
        return tuple(gating(self.layout, self.modes, self.stages))

    def waits(self, change: Change = AS_IT_IS) -> dict[tuple[int, int], float]:
        """How long a carrier waits at least, for hands that have delivered to it to be gone [s], by
        (robot, operation to come); nowhere in the ideal world, which has no hands."""
        if self.world == "ideal":
            return {}
        robots = [*range(len(self.factory.robots)), *self.layout.lifts]
        limits = self._limits(range(len(robots)), robots, change)
        return waits_for_hands(self.layout, limits)

    @cached_property
    def first_ways(self) -> Mapping[tuple[int, int], float]:
        """The same from where robots stand at the beginning, for those that set out then [s]."""
        positions = start_positions(self.layout, self.factory.net.initial_marking)
        ways = (
            (stage, self._way(stage, positions[stage.axis], AS_IT_IS))
            for stage in self.stages
            if self.factory.robots[stage.robot].operations[0] == stage.operation
        )
        return MappingProxyType(one_after_the_other(ways))

    def _way(self, stage: HeadStart, start: float, change: Change) -> float:
        start = stage.goal + (start - stage.goal) * change.way.get(stage.robot, 1.0)
        limits = self._limits((stage.axis,), (stage.robot,), change)
        return way_time(stage, start, limits, self.settings, self.world)

    def _limits(self, axes: Sequence[int], robots: Sequence[int], change: Change) -> Limits:
        """The limits of axes, which are those of robots, with a change."""
        limits = self.limits.of(axes)
        if (change.speed.keys() | change.acceleration.keys()).isdisjoint(robots):
            return limits
        speed = [change.speed.get(robot, 1.0) for robot in robots]
        gain = [change.acceleration.get(robot, 1.0) for robot in robots]
        return Limits(limits.speed * speed, limits.acceleration * gain)

    @cached_property
    def rest(self) -> float:
        """The delay of an operation without motion and dwell [s]: the tick until the next
        transition can fire, and in the engine the time to settle."""
        settle = self.settings.settle if self.world == "mujoco" else 0.0
        return settle + self.settings.tick

    @cached_property
    def delays(self) -> tuple[float, ...]:
        """The delay of every operation [s], as `factory.timing.prediction` has it."""
        return tuple(self.delay(number) for number in range(len(self.modes)))

    def delay(self, number: int, change: Change = AS_IT_IS) -> float:
        """The delay of one operation [s]."""
        return self._delay(number, self.starts[number], change)

    def changed(self, change: Change) -> tuple[float, ...]:
        """The delay of every operation with a change [s]."""
        delays = list(self.delays)
        robots = [
            self.factory.robots[robot]
            for robot in {*change.speed, *change.acceleration, *change.way}
        ]
        for number in {number for robot in robots for number in robot.operations}:
            delays[number] = self.delay(number, change)
        return tuple(delays)

    @cached_property
    def first(self) -> Mapping[int, float]:
        """The delays of operations that take another time when first done [s]: the robots stand at
        their B ends then."""
        positions = start_positions(self.layout, self.factory.net.initial_marking)
        begins = [
            [self.factory.robots[r].operations[0] == o.index for r in self._of(o.index)]
            for o in self.factory.operations
        ]
        here = (positions[list(axes)] for axes in self.factory.axes)
        starts = staged([*map(np.where, begins, here, self.left)], self.stages)
        return MappingProxyType(
            {n: self._delay(n, start, AS_IT_IS) for n, start in enumerate(starts) if any(begins[n])}
        )

    def travel(self, number: int, slot: int) -> float:
        """How long one robot moves in an operation, without stops on its way [s]."""
        mode = self.modes[number]
        axis = self.factory.axes[number][slot]
        limits = self.limits
        profile = SpeedProfile(float(limits.speed[axis]), float(limits.acceleration[axis]))
        way = 0.0 if mode.is_still else abs(float(self.left[number][slot] - mode.goals[slot]))
        if self.world == "mujoco":
            return profile.rest(way)
        return max(0.0, profile.landing(way) - profile.landing(mode.eps))

    @cached_property
    def outfeed(self) -> float:
        """How long the outfeed's tray is away after a dropoff [s]; 0 in the ideal world."""
        if self.world == "ideal":
            return 0.0
        return away(self.layout, self.settings)

    @cached_property
    def leaving(self) -> float:
        """How long a product takes from its dropoff until it counts [s]; 0 in the ideal world."""
        if self.world == "ideal":
            return 0.0
        return leaving(self.layout, self.settings)

    def _of(self, number: int) -> tuple[int, ...]:
        """The robot of each axis of an operation."""
        count, lifts = len(self.factory.robots), self.layout.lifts
        return tuple(a if a < count else lifts[a - count] for a in self.factory.axes[number])

    def _delay(self, number: int, start: Array, change: Change) -> float:
        mode, robots = self.modes[number], self._of(number)
        limits = self._limits(self.factory.axes[number], robots, change)
        if not change.way.keys().isdisjoint(robots):
            carriages = len(self.factory.operations[number].robots)
            shares = [change.way.get(robot, 1.0) for robot in robots[:carriages]]
            factor = np.array(shares + [1.0] * (len(robots) - carriages))
            start = mode.goals + (start - mode.goals) * factor
        return mode_time(mode, start, limits, self.world) + self.rest
