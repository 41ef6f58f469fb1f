"""How much the cycle time falls with the speed of each robot, its ways, or a second copy of it."""

from __future__ import annotations

from dataclasses import dataclass

from factory.study.analysis.timed import Circuit, TimedNet, timed_net
from factory.study.analysis.timing import AT_ONCE, Change, Timing

STEP = 0.1
"""Relative change of a speed, an acceleration or a way."""


@dataclass(frozen=True, slots=True)
class Sensitivity:
    """The reduction of the cycle time [s] by a change of one robot alone.

    `faster`: its speed (and its lift's) a tenth higher, `slower` (negative): a tenth lower;
    `quicker`: its acceleration a tenth higher; `shorter`: each of its ways a tenth shorter; `most`:
    its speed not limited at all, its acceleration still; `then`: what sets the pace after that;
    `enough`: the least factor on its speed with nearly all of `most`, None where `most` is 0 or the
    factor is above 64. `copy`: a second robot takes turns with it. `slack`: how long the robot
    waits in a cycle."""

    robot: str
    slack: float
    slower: float
    faster: float
    quicker: float
    shorter: float
    most: float
    then: str
    enough: float | None
    copy: float


def sensitivities(timing: Timing, net: TimedNet, wip: int | None) -> tuple[Sensitivity, ...]:
    """The sensitivity to each robot, in the order of the robots."""
    gears = {circuit.name: circuit for circuit in net.named}
    return tuple(
        _sensitivity(timing, net, wip, number, gears[robot.name])
        for number, robot in enumerate(timing.factory.robots)
    )


def _sensitivity(
    timing: Timing, net: TimedNet, wip: int | None, number: int, gear: Circuit
) -> Sensitivity:
    def gain(change: Change) -> float:
        found = net.pace - timed_net(timing, change, wip).pace
        return found if abs(found) > 1e-9 * net.pace else 0.0

    slower = gain(Change(speed={number: 1 - STEP}))
    if not any(set(gear.places) & set(circuit.places) for circuit in net.critical):
        return Sensitivity(gear.name, net.slack(gear), slower, 0.0, 0.0, 0.0, 0.0, "", None, 0.0)
    at_once = timed_net(timing, Change(speed={number: AT_ONCE}), wip)
    most = gain(Change(speed={number: AT_ONCE}))
    return Sensitivity(
        gear.name,
        net.slack(gear),
        slower,
        gain(Change(speed={number: 1 + STEP})),
        gain(Change(acceleration={number: 1 + STEP})),
        gain(Change(way={number: 1 - STEP})),
        most,
        at_once.critical[0].name,
        _enough(timing, wip, number, at_once.pace) if most else None,
        gain(Change(copies={number: 2})),
    )


def _enough(timing: Timing, wip: int | None, number: int, least: float) -> float | None:
    """The least factor on a robot's speed, within 1 %, with which the pace is at most 0.1 % above
    `least`."""
    low, high = 1.0, 64.0

    def reached(factor: float) -> bool:
        pace = timed_net(timing, Change(speed={number: factor}), wip).pace
        return pace <= least * 1.001

    if not reached(high):
        return None
    while high > low * 1.01:
        middle = (low * high) ** 0.5
        low, high = (low, middle) if reached(middle) else (middle, high)
    return high
