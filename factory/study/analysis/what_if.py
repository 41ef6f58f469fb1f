"""Cycle times under changes: faster robots, shorter ways, more robots, bounds on copies of
parts."""

from __future__ import annotations

from dataclasses import dataclass

from factory.study.analysis.timed import Circuit, TimedNet, timed_net
from factory.timing.pool import part_pool
from factory.timing.timed import SAME
from factory.timing.timing import AS_IT_IS, Change, Timing

STEP = 0.1
"""Relative change of a speed or a way."""


@dataclass(frozen=True, slots=True)
class Sensitivity:
    """Reduction of the cycle time [s] by changes of one robot alone.

    `faster`: its speed (and its lift's) a tenth higher; `shorter`: each of its ways a tenth
    shorter; `copy`: a second robot alternates with it. `slack`: waiting time of the robot in a
    cycle."""

    robot: str
    slack: float
    faster: float
    shorter: float
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
        saved = net.pace - timed_net(timing, change, wip).pace
        return saved if abs(saved) > 1e-9 * net.pace else 0.0

    if not any(set(gear.places) & set(circuit.places) for circuit in net.critical):
        return Sensitivity(gear.name, net.slack(gear), 0.0, 0.0, 0.0)
    return Sensitivity(
        gear.name,
        net.slack(gear),
        gain(Change(speed={number: 1 + STEP})),
        gain(Change(way={number: 1 - STEP})),
        gain(Change(copies={number: 2})),
    )


@dataclass(frozen=True, slots=True)
class Scenario:
    """A change in words, the cycle time with it [s], and its bottlenecks."""

    words: str
    pace: float
    then: tuple[str, ...]


def scenario(timing: Timing, words: str, change: Change, wip: int | None) -> Scenario:
    """The scenario of a change."""
    net = timed_net(timing, change, wip)
    return Scenario(words, net.pace, tuple(c.name for c in net.critical))


def least_wip(timing: Timing) -> int:
    """The least bound on copies of each part with the full pace, by bisection: the cycle time never
    grows with the bound."""
    full = timed_net(timing).pace
    low, high = 0, max(part_pool(timing.factory).values()) * timing.factory.period
    while high - low > 1:
        middle = (low + high) // 2
        enough = timed_net(timing, AS_IT_IS, middle).pace <= full * (1 + SAME)
        low, high = (low, middle) if enough else (middle, high)
    return high


def listed(names: list[str], most: int = 6) -> str:
    """Names as an enumeration: `a, b and c`."""
    shown = names[:most] + ([f"{len(names) - most} more"] if len(names) > most else [])
    return " and ".join([", ".join(shown[:-1]), shown[-1]] if len(shown) > 1 else shown)
