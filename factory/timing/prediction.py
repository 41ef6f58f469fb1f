"""Predict a run before it: the delay of each operation, and the cycle time they give.

A robot starts an operation where the one before has left it, or where it has gone ahead to. In
either world a transition costs a tick, since those enabled in one tick fire as one set; in MuJoCo
the drives settle within eps besides.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from types import MappingProxyType

import numpy as np

from factory.control.mode import Limits, Mode
from factory.control.profile import SpeedProfile, World, mode_time
from factory.geometry.meshes import Array
from factory.layout.hands.leaving import Leaving, going_on, raised
from factory.layout.hands.limbs import rises_first
from factory.layout.hands.meeting import delivered_at
from factory.layout.layout import Layout
from factory.modes.modes import operation_modes, operation_starts, robot_limits
from factory.modes.staging import HeadStart, staged, stages_of
from factory.nets.ways import with_ways
from factory.support.settings import Settings
from factory.timing.cycle_time import (
    CycleTime,
    cycle_time,
    marked_graph_cycle_time,
)
from factory.timing.pool import with_wip
from factory.timing.serving import longer, serving, turn_ways


def operation_delays(
    layout: Layout,
    modes: Sequence[Mode],
    limits: Limits,
    settings: Settings,
    world: World,
    ahead: Sequence[HeadStart] = (),
) -> list[float]:
    """The time [s] from X_s to X_e of every operation, and the tick until what follows can fire.
    `ahead`: the ways that robots go while they wait, those that they have the time for."""
    factory = layout.factory
    settle = settings.settle if world == "mujoco" else 0.0
    starts = staged(operation_starts(layout), ahead)
    return [
        mode_time(mode, start, limits.of(axes), world) + settle + settings.tick
        for axes, mode, start in zip(factory.axes, modes, starts, strict=True)
    ]


def ways_ahead(
    ahead: Sequence[HeadStart], limits: Limits, settings: Settings, world: World
) -> dict[tuple[int, int], float]:
    """The time [s] from the end of a robot's operation until it is where it has gone ahead to, by
    the robot and the operation to come. It sets out at once."""
    return one_after_the_other(
        (stage, way_time(stage, stage.start, limits.of((stage.axis,)), settings, world))
        for stage in ahead
    )


def held_up(
    layout: Layout,
    modes: Sequence[Mode],
    limits: Limits,
    settings: Settings,
    world: World,
    ahead: Sequence[HeadStart],
) -> dict[tuple[int, int], float]:
    """The time [s] from the end of a robot's operation to that of the one it goes ahead to, if that
    begins at once, where others wait for it (`Mode.gate`): they go on when it stands. By the robot
    and the operation to come."""
    settle = settings.settle if world == "mujoco" else 0.0
    return {
        (stage.robot, stage.operation): settle
        + settings.tick
        + mode_time(modes[stage.operation], begin, limits.of(axes), world)
        for stage, begin in gating(layout, modes, ahead)
        for axes in [layout.factory.axes[stage.operation]]
    }


def gating(
    layout: Layout, modes: Sequence[Mode], ahead: Sequence[HeadStart]
) -> Iterator[tuple[HeadStart, Array]]:
    """The ways ahead of robots for which others wait, each with where the axes of its operation are
    if it has not gone ahead."""
    starts = staged(operation_starts(layout), ahead)
    for stage in ahead:
        if stage.axis == stage.robot and stage.slot in modes[stage.operation].gate:
            begin = starts[stage.operation].copy()
            begin[stage.slot] = stage.start
            yield stage, begin


def one_after_the_other(
    ways: Iterable[tuple[HeadStart, float]],
) -> dict[tuple[int, int], float]:
    """The times of ways ahead [s] by robot and operation: a robot goes back when its lift is up."""
    found: dict[tuple[int, int], float] = {}
    for stage, seconds in ways:
        key = stage.robot, stage.operation
        found[key] = found.get(key, 0.0) + seconds
    return found


def waits_for_hands(layout: Layout, limits: Limits) -> dict[tuple[int, int], float]:
    """The time [s] from the end of a carrier's operation to the start of its next one, where that
    waits for hands to be clear of what they have delivered, by the carrier and the operation to
    come. They set out at once; the tick after the end is that of the delay before. A carrier whose
    own hand is above what it has let go waits for that, too (where it then takes a part:
    `serving`)."""
    factory = layout.factory
    found = {
        (robot.index, number): max(_gone(layout, one, limits) for one in leaving)
        for robot in factory.robots
        for number, leaving in going_on(layout, robot.index, later=False).items()
    }
    for robot, tours in enumerate(factory.tours):
        firsts = (tour[0] for tour in tours if factory.operations[tour[0]].inputs)
        for number in firsts if rises_first(layout, robot) else ():
            up = _gone(layout, raised(layout, robot), limits)
            found[robot, number] = max(up, found.get((robot, number), 0.0))
    return found


def _gone(layout: Layout, leaving: Leaving, limits: Limits) -> float:
    """How long an axis takes to be clear, from rest [s]: a robot on its way home, a lift up."""
    own, axis = limits.of((leaving.axis,)), leaving.axis
    profile = SpeedProfile(float(own.speed[0]), float(own.acceleration[0]))
    lift = axis - len(layout.factory.robots)
    if lift >= 0:
        return profile.passes(layout.strokes[layout.lifts[lift]], leaving.least)
    path, rises = layout.guidepaths[axis], 0.0
    if rises_first(layout, axis):
        rises = _gone(layout, raised(layout, axis), limits)
    begin = min(delivered_at(layout, axis))
    return rises + profile.passes(path.length - begin, leaving.least - begin)


def all_ways(
    layout: Layout,
    modes: Sequence[Mode],
    stages: Sequence[HeadStart],
    delays: Sequence[float],
    limits: Limits,
    settings: Settings,
    world: World,
) -> dict[tuple[int, int], float]:
    """The ways ahead, with what waits for these robots, and in MuJoCo the waits for hands, which
    the ideal world has not."""
    found = longer(
        ways_ahead(stages, limits, settings, world),
        held_up(layout, modes, limits, settings, world, stages),
    )
    if world == "mujoco":
        for key, seconds in waits_for_hands(layout, limits).items():
            found[key] = max(seconds + delays[key[1]], found.get(key, 0.0))
    return found


def way_time(
    stage: HeadStart, start: float, limits: Limits, settings: Settings, world: World
) -> float:
    """How long a robot with these limits goes ahead from `start` [m], and settles [s]."""
    settle = settings.settle if world == "mujoco" else 0.0
    return mode_time(stage.mode, np.array([start]), limits, world) + settle


def duration(layout: Layout, delays: Sequence[float], cycle: float, units: int) -> float:
    """At most how long it takes to make so many `units` from the empty factory [s]: the first by
    the slowest chain of operations from a part to dropoff, a `cycle` for each that follows, and for
    each further one of a period."""
    factory = layout.factory
    ready = [0.0] * len(factory.robots)
    for number in factory.order:
        operation = factory.operations[number]
        if factory.drops(number) or operation.turn:
            continue
        done = max(ready[robot] for robot in operation.robots) + delays[operation.index]
        for robot in operation.robots:
            ready[robot] = done
    return max(ready) + delays[-1] + (units + factory.period - 2) * cycle


def predict(
    layout: Layout,
    delays: Sequence[float],
    settings: Settings,
    world: World,
    wip: int | None = None,
    ways: Mapping[tuple[int, int], float] = MappingProxyType({}),
) -> CycleTime:
    """The cycle time of the compiled net and its bottleneck: the greatest sum along a gear of the
    operations' `delays`, or of the `ways` that robots go ahead of them where those are longer; of a
    gear train the critical circuit's. Others may allow no less and be it: in MuJoCo the outfeed,
    whose tray must be back before the next dropoff, and a feeder whose part comes later than its
    robot; the bound `wip` on what is inside."""
    factory = layout.factory
    if world == "mujoco" and factory.folded:
        ways = longer(ways, turn_ways(layout, delays, settings))
    found = [cycle_time(factory, delays, ways)]
    if world == "mujoco":
        found += serving(layout, delays, settings, ways)
    if wip is not None:
        most = min(wip, len(factory.robots))  # no more are inside without a bound
        bounded = with_wip(factory, most)
        seconds = [*delays, *[0.0] * (len(bounded.tokens) - len(delays)), *ways.values()]
        bound = marked_graph_cycle_time(with_ways(bounded, factory.net, ways), seconds).seconds
        found.append(CycleTime(bound / factory.period * (1 - 1e-9), f"wip {wip}"))
    return max(found, key=lambda time: time.seconds)


def pace(layout: Layout, settings: Settings) -> tuple[CycleTime, list[float]]:
    """The cycle time of a layout in MuJoCo, and how long each operation takes [s]."""
    modes, (limits, _) = operation_modes(layout, settings.eps), robot_limits(layout, settings)
    stages = stages_of(layout, modes, settings)
    delays = operation_delays(layout, modes, limits, settings, "mujoco", stages)
    ways = all_ways(layout, modes, stages, delays, limits, settings, "mujoco")
    return predict(layout, delays, settings, "mujoco", None, ways), delays
