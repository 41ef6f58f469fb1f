"""Predict a run before it: the delay of each operation, and the cycle time they give.

A robot starts an operation where the one before has left it. In either world a transition costs a
tick, since those enabled in one tick fire as one set; in MuJoCo the drives settle within eps
besides.
"""

from __future__ import annotations

from collections.abc import Sequence

from factory.control.mode import Limits, Mode
from factory.control.plan import operation_starts
from factory.control.profile import World, mode_time, trapezoid_time
from factory.layout.plan import Layout
from factory.nets.pool import with_wip
from factory.nets.timing import CycleTime, cycle_time, marked_graph_cycle_time
from factory.settings import Settings


def operation_delays(
    layout: Layout, modes: Sequence[Mode], limits: Limits, settings: Settings, world: World
) -> list[float]:
    """The time [s] from X_s to X_e of every operation, and the tick until what follows can fire."""
    factory = layout.factory
    settle = settings.settle if world == "mujoco" else 0.0
    delays = []
    starts = operation_starts(layout)
    for operation, mode, start in zip(factory.operations, modes, starts, strict=True):
        time = mode_time(mode, start, limits.of(factory.axes[operation.index]), world)
        delays.append(time + settle + settings.tick)
    return delays


def predict(
    layout: Layout,
    delays: Sequence[float],
    settings: Settings,
    world: World,
    wip: int | None = None,
) -> CycleTime:
    """The cycle time of the compiled net (the greatest sum of the operations' `delays` along a
    gear) and its bottleneck. Two things may allow no less and be it: in MuJoCo the outfeed, whose
    tray must be back before the next dropoff, and the bound `wip` on what is inside."""
    found = [cycle_time(layout.factory, delays)]
    if world == "mujoco":
        way = trapezoid_time(layout.outfeed_way, settings.outfeed, settings.outfeed_acceleration)
        found.append(CycleTime(delays[-1] + 2 * (float(way) + settings.tick), "outfeed"))
    if wip is not None:
        most = min(wip, len(layout.factory.robots))  # no more are inside without a bound
        bound = marked_graph_cycle_time(with_wip(layout.factory, most), delays).seconds
        found.append(CycleTime(bound * (1 - 1e-9), f"wip {wip}"))
    return max(found, key=lambda time: time.seconds)
