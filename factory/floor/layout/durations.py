"""Durations of operations from lengths alone: the objective of the layout search.

`timing/timed.py` predicts the run itself, from the modes, and is what users are told; tests compare
the two.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import sqrt

from factory.floor.layout.guidepath import Guidepath
from factory.floor.layout.layout import Layout
from factory.floor.layout.way import rounding_for
from factory.support.settings import Settings
from factory.theory.control.profile import SpeedProfile
from factory.theory.nets.ways import train_ratio
from factory.theory.plant.operation import Operation
from factory.theory.problem.pag import NOPART


@dataclass(frozen=True, slots=True)
class Pace(SpeedProfile):
    """The times that a layout is judged by, beside the robots' speeds.

    Attributes:
        eps: radius of a goal ball [m].
        lost: time between two operations [s].
        ahead: time lost on the way of a robot that goes ahead while it waits
            (`floor/modes/staging.py`) [s]; None where none does.
    """

    eps: float = 2e-4
    lost: float = 0.01
    ahead: float | None = None

    @classmethod
    def of(cls, settings: Settings) -> Pace:
        """The pace of a run with these settings."""
        lost, ahead = settings.tick + settings.settle, settings.settle if settings.stage else None
        return cls(settings.speed, settings.acceleration, settings.eps, lost, ahead)

    @property
    def rounding(self) -> float:
        """Rounding of corners that are passed at full speed [m]."""
        return rounding_for(self.speed, self.acceleration)

    def on(self, path: Guidepath) -> Pace:
        """The pace on a guidepath, whose corners a robot passes at its speed."""
        fastest = path.fastest(self.speed, self.acceleration)
        return self if fastest == self.speed else replace(self, speed=fastest)

    def goes_ahead(self, operation: Operation, slot: int) -> bool:
        """Whether the robot in a slot may make its move before the operation starts."""
        return self.ahead is not None and operation.awaits_empty(slot)

    def entered(self, rested: float) -> float:
        """Time at which a robot enters its goal ball that comes to rest at `rested` [s]."""
        return max(rested - sqrt(2 * self.eps / self.acceleration), 0.0)

    def gear_times(self, layout: Layout) -> list[float]:
        """For each robot the summed delays [s] of its gear in a layout, a unit: the greatest is the
        cycle time, where every robot has one tour. Where a robot goes ahead while it waits, it
        takes the longer of that and the operation."""
        ways, operations = _ways(layout), layout.factory.operations
        delays = operation_times(layout, self)

        def taken(number: int, robot: int) -> float:
            operation = operations[number]
            if self.ahead is None or not operation.awaits_empty(operation.robots.index(robot)):
                return delays[number]
            on_path = self.on(layout.guidepaths[robot])
            return max(delays[number], on_path.rest(ways[number, robot]) + self.ahead)

        units = layout.factory.period
        return [
            sum(taken(n, robot.index) for n in robot.operations) / units
            for robot in layout.factory.robots
        ]

    def cycle_of(self, layout: Layout) -> float:
        """The cycle time of a layout [s]: the greatest gear time, where every robot has one tour;
        else the maximum cycle ratio of its gear train."""
        return slowest(layout, self)[0]


def slowest(layout: Layout, pace: Pace) -> tuple[float, list[int]]:
    """The cycle time of a layout [s], and the robots that allow no less: the slowest, in a gear
    train those on the critical circuit, first those that spend most of it."""
    net = layout.factory.net
    if net.is_tree:
        times = pace.gear_times(layout)
        robot = max(range(len(times)), key=times.__getitem__)
        return times[robot], [robot]
    delays, legs = operation_times(layout, pace), _ways(layout)
    paces = [*map(pace.on, layout.guidepaths)]
    ahead = {
        (int(robot), int(o.place)): paces[robot].rest(legs[o.index, robot]) + (pace.ahead or 0.0)
        for o in layout.factory.operations
        for slot, robot in enumerate(o.robots)
        if pace.goes_ahead(o, slot)
    }
    waits = len(net.threaded.places) - len(delays)
    ratio, robots = train_ratio(net, [*delays, *[0.0] * waits], ahead)
    return ratio.seconds / layout.factory.period, robots


def operation_times(layout: Layout, pace: Pace) -> list[float]:
    """The delay [s] of each operation from rest, dwell included."""
    ways = _ways(layout)
    return [_operation_time(layout, o, ways, pace) for o in layout.factory.operations]


def _ways(layout: Layout) -> dict[tuple[int, int], float]:
    """Length of a robot's move in an operation, by both [m]."""
    axes = layout.factory.axes
    return {
        (number, robot): abs(visit.at - before.at) * axes[robot].motion.lever
        for (number, robot), (before, visit) in layout.ways.items()
    }


def _operation_time(
    layout: Layout, operation: Operation, ways: dict[tuple[int, int], float], pace: Pace
) -> float:
    carrier = operation.template.carrier - 1
    paces = [pace.on(layout.guidepaths[robot]) for robot in operation.robots]
    rested = [
        0.0 if pace.goes_ahead(operation, slot) else paces[slot].rest(ways[operation.index, robot])
        for slot, robot in enumerate(operation.robots)
    ]
    lowered = operation.lowered
    gate = carrier
    if operation.before[carrier] == NOPART:
        gate = next((s for s, x in enumerate(operation.before) if x != NOPART and s != lowered), -1)
    for slot, label in enumerate(operation.before):
        brings = operation.before[carrier] != NOPART and label != NOPART
        if slot != gate and (slot == lowered or (brings and slot != carrier)):
            way = ways[operation.index, operation.robots[slot]]
            standoff = layout.standoff(operation, slot)
            rested[slot] = paces[slot].staged(way, standoff, pace.entered(rested[gate]))
    longest = max(rested)
    if lowered >= 0:
        visit = layout.visits[operation.index, operation.robots[lowered]]
        stroke = visit.up - visit.lift
        longest = max(longest, pace.entered(rested[lowered]) + pace.rest(stroke))
    for robot in operation.robots:
        lifted = layout.factory.goes_up(robot)
        if lifted and layout.factory.begins(robot, operation.index):
            longest = max(longest, pace.rest(layout.rise(robot)))
    return longest + operation.dwell + pace.lost
