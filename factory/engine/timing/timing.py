"""The delays of a factory's operations, also with changed robots."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import ceil
from types import MappingProxyType

import numpy as np

from factory.engine.mjcf.timestep import timed
from factory.floor.layout.coordinating import HOME, Coordinated, without_bodies
from factory.floor.layout.exclusions import coordinated
from factory.floor.layout.feeding import feeder_of
from factory.floor.layout.hands.limbs import rises_first
from factory.floor.layout.layout import Layout
from factory.floor.layout.outfeed import away, leaving
from factory.floor.layout.starting import start_positions
from factory.floor.modes.modes import operation_modes, operation_starts, robot_limits
from factory.floor.modes.staging import HeadStart, staged, stages_of, with_time
from factory.support.arrays import Array
from factory.support.bounds import WorldName
from factory.support.settings import Settings
from factory.theory.control.governed import GovernedAxis, Trajectory, mode_ticks, trajectories
from factory.theory.control.mode import ROUNDING, Limits, Mode
from factory.theory.control.profile import SpeedProfile
from factory.theory.nets.coordinated import Past
from factory.theory.plant.factory import Factory
from factory.theory.problem.ids import AxisId, carriage_axis, operation_of

CALM = 3
"""So many ticks after its stroke a slider is at rest."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """Changes of some robots (index): factors on their `speed` and the length of each of their ways
    (`way`); the number of robots that share the work of one (`copies`)."""

    speed: Mapping[int, float] = field(default_factory=dict)
    way: Mapping[int, float] = field(default_factory=dict)
    copies: Mapping[int, int] = field(default_factory=dict)


AS_IT_IS = Change()


@dataclass(frozen=True)
class Timing:
    """The delays of a layout in whole ticks: its modes, where each starts, and the robots' limits.

    Attributes:
        layout: the layout.
        settings: the settings of the run.
        world: ideal or mujoco.
        seed: of the run; with `jitter` it gives the robots' speeds.
        jitter: of the run.
        wip: most units inside at once; None for any number.
        shaped: the modes, where they have been made already.

    Raises InputError where a mode cannot reach its goal.
    """

    layout: Layout
    settings: Settings = Settings()  # noqa: RUF009
    world: WorldName = "mujoco"
    seed: int = 0
    jitter: float = 0.0
    wip: int | None = None
    shaped: Sequence[Mode] = field(default=(), repr=False, compare=False)

    @property
    def factory(self) -> Factory:
        """The factory that is laid out."""
        return self.layout.factory

    @cached_property
    def modes(self) -> Sequence[Mode]:
        """The mode of each operation."""
        return self.shaped or operation_modes(self.layout, self.settings.eps)

    @cached_property
    def limits(self) -> Limits:
        """The limits of each axis."""
        return robot_limits(self.layout, self.settings, self.seed, self.jitter)[0]

    @cached_property
    def stages(self) -> tuple[HeadStart, ...]:
        """The ways that robots go ahead of operations while they wait, if they are to."""
        chosen = stages_of(self.layout, self.modes, self.settings)
        return with_time(self.layout, chosen, self.world, self.wip)

    @cached_property
    def coordinated(self) -> Coordinated:
        """The coordinated net of the layout; in the ideal world, which has no bodies, the compiled
        one."""
        if self.world == "mujoco":
            return coordinated(self.layout)
        return without_bodies(self.factory.net)

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
        """The least time [s] from the end of a robot's operation to that of the one that it goes
        ahead to, by (robot, operation to come): of its way; and of all of that operation if it
        begins at once, unless the robot's lift has to be up before. The robot sets out in the tick
        in which the one before ends; others that wait for it see it a tick later."""
        ways = _one_after_the_other(
            (stage, self._way(stage, stage.start, change)) for stage in self.stages
        )
        for stage in self.stages:
            if stage.axis == stage.robot and not rises_first(self.layout, stage.robot):
                begin = self.starts[stage.operation].copy()
                begin[stage.slot] = stage.start
                key = stage.robot, stage.operation
                at_once = self._delay(stage.operation, begin, change) - self.tick
                ways[key] = max(ways[key], at_once)
        return ways

    def passes(self, change: Change = AS_IT_IS) -> dict[Past, float]:
        """How long after the transition that it follows each pass of the coordinated net comes
        [s]: robots set out at once."""
        return {past: self._past(past, change) * self.tick for past in self.coordinated.passes}

    def _past(self, past: Past, change: Change) -> int:
        """The ticks until an axis comes past a point, from rest."""
        robot, number = self.factory.robot_of(past.axis), operation_of(past.after)
        layout = self.layout
        drive = self.axis_drive(past.axis, change)
        if past.axis != carriage_axis(robot):
            low, top = self._rise(past.axis, number)
            return drive.way(top - low).passes(top - past.at)
        visit, factor = layout.visits[number, robot], change.way.get(robot, 1.0)
        if past.direction < 0:
            slot = self.factory.operations[number].robots.index(robot)
            way = self._trajectories(number, self.starts[number], change)[slot]
            return way.passes(max(0.0, past.at - visit.at) * factor)
        length, rises = layout.guidepaths[robot].length, self._rises(past, change)
        home = drive.way((length - visit.at) * factor)
        if past.at < length - HOME:
            return rises + home.passes((length - max(visit.at, past.at)) * factor)
        return rises + home.rests(HOME) + self._adjusted(robot, number)

    def _rises(self, past: Past, change: Change) -> int:
        """The ticks until a robot whose lift rises first sets out: when it is up, or past where its
        next operation may start, which moves it too."""
        robot, number = self.factory.robot_of(past.axis), operation_of(past.after)
        up = self.factory.up(robot)
        if up is None or not rises_first(self.layout, robot):
            return 0
        (low, top), passes = self._rise(up, number), self.coordinated.passes
        way = self.axis_drive(up, change).way(top - low)
        starts = [way.passes(top - p.at) for p in passes if (p.after, p.axis) == (past.after, up)]
        return min([way.rests(self.settings.eps), *starts])

    def _rise(self, axis: AxisId, number: int) -> tuple[float, float]:
        """From where an operation (index) leaves an axis that goes up to where the next one of its
        robot takes it [m]: tours differ in both."""
        after = self.factory.after(self.factory.robot_of(axis), number)
        axes, (_, stroke) = self.factory.moves, self.layout.spans[axis]
        low, top = (
            float(self.modes[n].goals[axes[n].index(axis)]) if axis in axes[n] else stroke
            for n in (number, after)
        )
        return low, top

    def _adjusted(self, robot: int, number: int) -> int:
        """The ticks in which the lift of a robot that is at home is set for its next tour."""
        axis = self.factory.up(robot)
        if axis is None or robot not in self.factory.adjusted:
            return 0
        after = self.factory.after(robot, number)
        one, other = (self.layout.visits[n, robot].up for n in (number, after))
        return self.axis_drive(axis, AS_IT_IS).way(abs(one - other)).rests(self.settings.eps)

    @cached_property
    def strokes(self) -> Mapping[int, tuple[float, float]]:
        """How long the slider of each magazine goes up and comes down [s], as `_strokes`, by the
        operation (index) that takes the part."""
        served = self.coordinated.served.items()
        return {leaf: self._strokes(one.before, leaf) for leaf, one in served}

    def _strokes(self, before: int, leaf: int) -> tuple[float, float]:
        """How long a slider goes up after the part of one operation, and comes down with that of
        the next until its robot may set out [s]: a robot comes when the part is down, one whose
        hand holds from above sets out then, and one whose hand is there first is there."""
        layout, tick = self.layout, self.tick
        slider = GovernedAxis(*self.settings.feeder_limits, tick)
        up, down = (
            slider.way(feeder_of(layout, self.factory.operations[n].label).way).passes(ROUNDING)
            + CALM
            for n in (before, leaf)
        )
        robot = self.factory.operations[leaf].carrier
        hand, sooner = layout.hand(robot), 0.0
        if hand is None or not (hand.first or hand.kind.hangs):
            speed = self.settings.speed * (1 + self.jitter)
            fastest = SpeedProfile(speed, self.settings.acceleration)
            at = float(self.starts[leaf][self.factory.operations[leaf].robots.index(robot)])
            sooner = fastest.rest(max(0.0, layout.guidepaths[robot].length - at))
        return up * tick, max(0, ceil(down - sooner / tick - ROUNDING)) * tick

    def axis_drive(self, axis: int, change: Change) -> GovernedAxis:
        """How an axis moves, with a change."""
        limits = self._limits((axis,), (self.factory.robot_of(AxisId(axis)),), change)
        return replace(
            self.drive, speed=float(limits.speed[0]), acceleration=float(limits.acceleration[0])
        )

    @cached_property
    def drive(self) -> GovernedAxis:
        """How axes move in this world."""
        settings, engine = self.settings, self.world == "mujoco"
        lag = self.stepped.lag if engine else 0.0
        return GovernedAxis(
            settings.speed, settings.acceleration, self.tick, lag, instant=not engine
        )

    @cached_property
    def stepped(self) -> Settings:
        """The settings with the timestep of a run."""
        return timed(self.settings, self.layout, self.world, self.jitter)

    @property
    def tick(self) -> float:
        """Period of the supervisor [s]."""
        return self.settings.tick

    @cached_property
    def first_ways(self) -> Mapping[tuple[int, int], float]:
        """The same from where robots stand at the beginning, for those that set out then [s]."""
        positions = start_positions(self.layout, self.factory.net.initial_marking)
        ways = (
            (stage, self._way(stage, positions[stage.axis], AS_IT_IS))
            for stage in self.stages
            if self.factory.robots[stage.robot].operations[0] == stage.operation
        )
        return MappingProxyType(_one_after_the_other(ways))

    def _way(self, stage: HeadStart, start: float, change: Change) -> float:
        way = abs(start - stage.goal) * change.way.get(stage.robot, 1.0)
        ticks = self.axis_drive(stage.axis, change).way(way).rests(stage.mode.eps)
        return ticks * self.tick + self.rest - self.tick

    def _limits(self, axes: Sequence[int], robots: Sequence[int], change: Change) -> Limits:
        """The limits of axes, which are those of robots, with a change."""
        limits = self.limits.of(axes)
        if change.speed.keys().isdisjoint(robots):
            return limits
        speed = [change.speed.get(robot, 1.0) for robot in robots]
        return Limits(limits.speed * speed, limits.acceleration)

    @cached_property
    def rest(self) -> float:
        """The delay of an operation without motion and dwell [s]: the tick until the next
        transition can fire, and in the engine the time to settle."""
        settle = self.settings.settle if self.world == "mujoco" else 0.0
        return settle + self.settings.tick

    @cached_property
    def delays(self) -> tuple[float, ...]:
        """The delay of every operation [s]."""
        return tuple(self.delay(number) for number in range(len(self.modes)))

    def delay(self, number: int, change: Change = AS_IT_IS) -> float:
        """The delay of one operation [s]."""
        return self._delay(number, self.starts[number], change)

    def changed(self, change: Change) -> tuple[float, ...]:
        """The delay of every operation with a change [s]."""
        delays = list(self.delays)
        robots = [self.factory.robots[robot] for robot in {*change.speed, *change.way}]
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
        here = (positions[list(axes)] for axes in self.factory.moves)
        starts = staged([*map(np.where, begins, here, self.left)], self.stages)
        moved = ((n, start) for n, start in enumerate(starts) if any(begins[n]))
        return MappingProxyType({n: self._delay(n, start, AS_IT_IS) for n, start in moved})

    def travel(self, number: int, slot: int) -> float:
        """How long one robot moves in an operation, without stops on its way [s]."""
        mode = self.modes[number]
        drive = self.axis_drive(self.factory.moves[number][slot], AS_IT_IS)
        profile = SpeedProfile(drive.speed, drive.acceleration)
        way = 0.0 if mode.is_still else abs(float(self.left[number][slot] - mode.goals[slot]))
        if self.world == "mujoco":
            return profile.rest(way)
        return max(0.0, profile.landing(way) - profile.landing(mode.eps))

    @cached_property
    def outfeed(self) -> float:
        """How long the outfeed's tray is away after a dropoff [s]; 0 in the ideal world."""
        return 0.0 if self.world == "ideal" else away(self.layout, self.stepped)

    @cached_property
    def leaving(self) -> float:
        """How long a product takes from its dropoff until it counts [s]; 0 in the ideal world."""
        return 0.0 if self.world == "ideal" else leaving(self.layout, self.stepped)

    def _of(self, number: int) -> tuple[int, ...]:
        """The robot of each axis of an operation."""
        return tuple(map(self.factory.robot_of, self.factory.moves[number]))

    def _delay(self, number: int, start: Array, change: Change) -> float:
        mode, ways = self.modes[number], self._trajectories(number, start, change)
        return mode_ticks(mode, ways, self.tick) * self.tick + self.rest

    def _trajectories(self, number: int, start: Array, change: Change) -> list[Trajectory]:
        """The references of the axes of an operation from `start`, with a change."""
        mode, robots = self.modes[number], self._of(number)
        limits = self._limits(self.factory.moves[number], robots, change)
        if not change.way.keys().isdisjoint(robots):
            carriages = len(self.factory.operations[number].robots)
            shares = [change.way.get(robot, 1.0) for robot in robots[:carriages]]
            factor = np.array(shares + [1.0] * (len(robots) - carriages))
            start = mode.goals + (start - mode.goals) * factor
        return trajectories(mode, start, limits, self.drive)


def _one_after_the_other(
    ways: Iterable[tuple[HeadStart, float]],
) -> dict[tuple[int, int], float]:
    """The times of ways ahead [s] by robot and operation: a robot goes back when its lift is up."""
    taken: dict[tuple[int, int], float] = {}
    for stage, seconds in ways:
        key = stage.robot, stage.operation
        taken[key] = taken.get(key, 0.0) + seconds
    return taken
