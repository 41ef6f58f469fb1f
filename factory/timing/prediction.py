"""Predict a run before it: how long it takes, and the cycle time of a layout."""

from __future__ import annotations

from factory.layout.layout import Layout
from factory.support.settings import Settings
from factory.timing.cycle_time import CycleTime
from factory.timing.timed import timed
from factory.timing.timing import Timing


def duration(timing: Timing, cycle: float, units: int) -> float:
    """At most how long it takes to make so many `units` from the empty factory [s]: the first by
    the slowest chain of operations from a part to dropoff, a `cycle` for each that follows, and for
    each further one of a period."""
    factory, delays = timing.factory, timing.delays
    ready = [0.0] * len(factory.robots)
    for number in factory.order:
        operation = factory.operations[number]
        if factory.drops(number) or operation.turn:
            continue
        done = max(ready[robot] for robot in operation.robots) + delays[operation.index]
        for robot in operation.robots:
            ready[robot] = done
    return max(ready) + delays[-1] + (units + factory.period - 2) * cycle


def pace(layout: Layout, settings: Settings) -> tuple[CycleTime, tuple[float, ...]]:
    """The cycle time of a layout in MuJoCo, and how long each operation takes [s]."""
    timing = Timing(layout, settings)
    return timed(timing).cycle, timing.delays
