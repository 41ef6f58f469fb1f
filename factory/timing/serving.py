"""What feeders and the outfeed allow: machines beside the net, which robots may have to wait for.

A feeder's slider goes up when its part has been taken, and comes down with the next when the robot
is out of the way.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from factory.control.profile import SpeedProfile
from factory.layout.feeding import feeder_of, passing
from factory.layout.layout import Layout
from factory.layout.outfeed import away
from factory.plant.factory import Operation
from factory.support.settings import Settings
from factory.timing.cycle_time import CycleTime

CALM = 3
"""So many ticks after its stroke a slider is at rest."""


def serving(layout: Layout, delays: Sequence[float], settings: Settings) -> Iterator[CycleTime]:
    """The least cycle times that the outfeed, and feeders for which robots wait, allow, with the
    operations' delays [s]."""
    yield CycleTime(delays[layout.factory.dropoff.index] + away(layout, settings), "outfeed")
    for leaf in layout.factory.leaves:
        robot = layout.factory.robots[leaf.carrier]
        fed = _fed(layout, leaf, delays, settings)
        if fed > sum(delays[number] for number in robot.operations):
            yield CycleTime(fed, f"feeder {leaf.label}")


def _fed(layout: Layout, leaf: Operation, delays: Sequence[float], settings: Settings) -> float:
    """The cycle time of a feeder, and of its robot where that waits for it [s]."""
    down = SpeedProfile(*settings.feeder_limits).rest(feeder_of(layout, leaf.label).stroke)
    gear = layout.factory.robots[leaf.carrier].operations
    busy = sum(delays[number] for number in gear) - delays[leaf.index]
    path, way = layout.guidepaths[leaf.carrier], passing(layout, leaf)
    beyond = path.length - layout.legs[gear[-1], leaf.carrier][1] - way
    early = SpeedProfile(settings.speed, settings.acceleration).landing(max(beyond, 0.0))
    rest = (CALM + 1) * settings.tick
    return max(busy + max(down - early, 0.0) + rest, 2 * (down + rest))
