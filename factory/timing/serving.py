"""What feeders and the outfeed allow: machines beside the net, which robots may have to wait for.

A feeder's slider goes up when its part has been taken, and comes down with the next when the robot
is out of the way. The outfeed's tray takes a product into the shed, waits until that is shut, and
comes back.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from factory.control.profile import SpeedProfile
from factory.layout.dimensions import BEHIND, PLAY
from factory.layout.layout import Layout
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


def leaving(layout: Layout, settings: Settings) -> float:
    """How long a product takes from its dropoff until it is out of sight [s]."""
    profile = SpeedProfile(settings.outfeed, settings.outfeed_acceleration)
    tray = profile.rest(layout.outfeed_way)
    shut = tray - profile.landing(BEHIND - PLAY) + _shutter(layout, settings)
    return max(tray, shut) + settings.tick


def away(layout: Layout, settings: Settings) -> float:
    """How long the outfeed takes from a product to the next [s]."""
    tray = SpeedProfile(settings.outfeed, settings.outfeed_acceleration).rest(layout.outfeed_way)
    back = max(tray, _shutter(layout, settings)) + settings.tick
    return leaving(layout, settings) + back


def _shutter(layout: Layout, settings: Settings) -> float:
    return SpeedProfile(*settings.shutter_limits).rest(layout.shutter_stroke)


def _fed(layout: Layout, leaf: Operation, delays: Sequence[float], settings: Settings) -> float:
    """The cycle time of a feeder, and of its robot where that waits for it [s]."""
    down = SpeedProfile(*settings.feeder_limits).rest(layout.feeder(leaf.label).stroke)
    gear = layout.factory.robots[leaf.carrier].operations
    busy = sum(delays[number] for number in gear) - delays[leaf.index]
    path, way = layout.guidepaths[leaf.carrier], layout.passing(leaf)
    beyond = path.length - layout.legs[gear[-1], leaf.carrier][1] - way
    early = SpeedProfile(settings.speed, settings.acceleration).landing(max(beyond, 0.0))
    rest = (CALM + 1) * settings.tick
    return max(busy + max(down - early, 0.0) + rest, 2 * (down + rest))
