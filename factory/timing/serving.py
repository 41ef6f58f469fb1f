"""What feeders and the outfeed allow: machines beside the net, which robots may have to wait for.

A feeder's slider goes up when its part has been taken, and comes down with the next when the robot
is out of the way. The feeders of a robot with several tours take turns: the next part comes down
when the robot is out of the way of that.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from factory.control.profile import SpeedProfile
from factory.layout.feeding import feeder_of, passing
from factory.layout.hands.leaving import raised
from factory.layout.hands.limbs import rises_first
from factory.layout.layout import Layout
from factory.layout.outfeed import away
from factory.nets.ways import Way
from factory.plant.factory import Operation
from factory.support.settings import Settings
from factory.timing.cycle_time import CycleTime

CALM = 3
"""So many ticks after its stroke a slider is at rest."""


def serving(
    layout: Layout, delays: Sequence[float], settings: Settings, ways: Mapping[Way, float]
) -> Iterator[CycleTime]:
    """The least cycle times that the outfeed, and feeders for which robots wait, allow, with the
    operations' delays [s], and the `ways` of robots that take longer; `turn_ways` has those of
    robots with several tours."""
    dropped = [delays[dropoff.index] for dropoff in layout.factory.dropoffs]
    yield CycleTime(sum(dropped) / len(dropped) + away(layout, settings), "outfeed")
    for leaf in layout.factory.leaves:
        robot = layout.factory.robots[leaf.carrier]
        if len(layout.factory.tours[leaf.carrier]) > 1:
            continue
        taken = {n: max(delays[n], ways.get((robot.index, n), 0.0)) for n in robot.operations}
        busy, down = sum(taken.values()), _down(layout, leaf, settings)
        late = _turn(layout, leaf, robot.operations[-1], delays, settings)
        strokes = 2 * (down + (CALM + 1) * settings.tick)
        fed = max(busy - taken[leaf.index] + late, strokes)
        if fed > busy:
            yield CycleTime(fed / layout.factory.period, f"feeder {leaf.label}")


def turn_ways(layout: Layout, delays: Sequence[float], settings: Settings) -> dict[Way, float]:
    """How long after the end of a tour the next part can be taken at the earliest [s], by the robot
    and the operation that takes the part, with the operations' delays [s]."""
    factory = layout.factory
    return {
        (robot, leaf.index): _turn(layout, leaf, tours[step - 1][-1], delays, settings)
        for robot, tours in enumerate(factory.tours)
        for step, tour in enumerate(tours)
        for leaf in (factory.operations[tour[0]],)
        if not leaf.inputs
    }


def _turn(
    layout: Layout, leaf: Operation, before: int, delays: Sequence[float], settings: Settings
) -> float:
    """How long after the operation before a part can be taken at the earliest [s]."""
    robot, hand = leaf.carrier, layout.hand(leaf.carrier)
    late = _served(layout, leaf, before, settings) + (CALM + 1) * settings.tick
    if robot in layout.factory.adjusted:
        late += _set(layout, robot, (before, leaf.index), settings)
    if rises_first(layout, robot):
        late = max(late, _raised(layout, robot, settings))
    if hand is not None and (hand.first or hand.kind == "above"):
        late += delays[leaf.index]  # it sets out when the part is down
    return late


def _raised(layout: Layout, robot: int, settings: Settings) -> float:
    """How long after it has delivered a robot's hand is above that [s]."""
    profile = SpeedProfile(settings.speed, settings.acceleration)
    return profile.passes(layout.strokes[robot], raised(layout, robot).least)


def _set(layout: Layout, robot: int, between: tuple[int, int], settings: Settings) -> float:
    """How long the lift of a robot that is at home takes to be set for the next operation [s]."""
    before, after = (layout.level(robot, number).up for number in between)
    profile = SpeedProfile(settings.speed, settings.acceleration)
    return profile.rest(abs(after - before)) + settings.settle


def _down(layout: Layout, leaf: Operation, settings: Settings) -> float:
    """How long a slider takes for its stroke [s]."""
    return SpeedProfile(*settings.feeder_limits).rest(feeder_of(layout, leaf.label).stroke)


def _served(layout: Layout, leaf: Operation, before: int, settings: Settings) -> float:
    """How long after the operation before a part is there [s], or how long after its robot could be
    home where that takes longer. A robot whose hand is there first goes home, and then the part
    comes down."""
    hand = layout.hand(leaf.carrier)
    if hand is None or not hand.first:
        return _late(layout, leaf, before, settings)
    way = layout.guidepaths[leaf.carrier].length - layout.legs[before, leaf.carrier][1]
    home = SpeedProfile(settings.speed, settings.acceleration).rest(max(way, 0.0))
    return home + _down(layout, leaf, settings)


def _late(layout: Layout, leaf: Operation, before: int, settings: Settings) -> float:
    """How long a part comes down after its robot could be home from the operation before [s]."""
    path, way = layout.guidepaths[leaf.carrier], passing(layout, leaf)
    beyond = path.length - layout.legs[before, leaf.carrier][1] - way
    early = SpeedProfile(settings.speed, settings.acceleration).landing(max(beyond, 0.0))
    return max(_down(layout, leaf, settings) - early, 0.0)


def longer(one: Mapping[Way, float], other: Mapping[Way, float]) -> dict[Way, float]:
    """The longer of two times of each way [s]."""
    keys = dict.fromkeys([*one, *other])
    return {key: max(one.get(key, 0.0), other.get(key, 0.0)) for key in keys}
