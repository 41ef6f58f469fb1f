"""Cycle times under changes: faster robots, shorter ways, more robots, bounds on copies of
parts."""

from __future__ import annotations

from dataclasses import dataclass

from factory.study.analysis.timed import Circuit, TimedNet, timed_net
from factory.timing.pool import part_pool
from factory.timing.timed import SAME
from factory.timing.timing import AS_IT_IS, AT_ONCE, Change, Timing

STEP = 0.1
"""Relative change of a speed, an acceleration or a way."""

POINTS = 12
"""Upper bound on the points of the curve."""


@dataclass(frozen=True, slots=True)
class Sensitivity:
    """Reduction of the cycle time [s] by changes of one robot alone.

    `faster`: its speed (and its lift's) a tenth higher, `slower` (negative): a tenth lower;
    `quicker`: its acceleration a tenth higher; `shorter`: each of its ways a tenth shorter; `most`:
    unlimited speed, limited acceleration; `then`: the bottleneck after that; `enough`: the least
    factor on its speed with nearly all of `most`, None if `most` is 0 or the factor is above 64.
    `copy`: a second robot alternates with it. `slack`: waiting time of the robot in a cycle."""

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
        saved = net.pace - timed_net(timing, change, wip).pace
        return saved if abs(saved) > 1e-9 * net.pace else 0.0

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
    """Least factor on a robot's speed, within 1 %, with a pace at most 0.1 % above `least`; None if
    above 64."""
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


@dataclass(frozen=True, slots=True)
class Scenario:
    """A change with its description, the cycle time with it [s], and its bottlenecks."""

    change: Change
    words: str
    pace: float
    then: tuple[str, ...]


def scenario(timing: Timing, words: str, change: Change, wip: int | None) -> Scenario:
    """The scenario of a change."""
    net = timed_net(timing, change, wip)
    return Scenario(change, words, net.pace, tuple(c.name for c in net.critical))


def scenarios(timing: Timing, net: TimedNet, wip: int | None) -> tuple[Scenario, ...]:
    """The scenarios of critical robots, all robots and all ways changed by a tenth; then of copies
    of the critical robots."""
    robots = {robot.name: robot.index for robot in timing.factory.robots}
    critical = [c.name for c in net.critical if c.name in robots]
    percent = round(100 * STEP)
    changes = []
    if len(critical) > 1:
        together = {robots[name]: 1 + STEP for name in critical}
        changes.append((f"{listed(critical)} {percent} % faster", Change(speed=together)))
    every = range(len(robots))
    changes += [
        (f"every robot {percent} % faster", Change(speed=dict.fromkeys(every, 1 + STEP))),
        (f"every way {percent} % shorter", Change(way=dict.fromkeys(every, 1 - STEP))),
    ]
    examined = [scenario(timing, words, change, wip) for words, change in changes]
    return (*examined, *in_turn(timing, net, wip))


def in_turn(timing: Timing, net: TimedNet, wip: int | None, most: int = 4) -> list[Scenario]:
    """Scenarios with one more copy of all critical robots each time, until something other than
    robots is critical or the pace does not improve."""
    robots = {robot.name: robot.index for robot in timing.factory.robots}
    copies: dict[int, int] = {}
    better: list[Scenario] = []
    pace, critical = net.pace, tuple(c.name for c in net.critical)
    while len(better) < most and all(name in robots for name in critical):
        for name in critical:
            copies[robots[name]] = copies.get(robots[name], 1) + 1
        words = listed([f"{n} × {timing.factory.robots[r].name}" for r, n in copies.items()])
        last = scenario(timing, words, Change(copies=dict(copies)), wip)
        if last.pace >= pace * (1 - 1e-9):
            break
        better.append(last)
        pace, critical = last.pace, last.then
    return better


def listed(names: list[str], most: int = 6) -> str:
    """Names as an enumeration: `a, b and c`."""
    shown = names[:most] + ([f"{len(names) - most} more"] if len(names) > most else [])
    return " and ".join([", ".join(shown[:-1]), shown[-1]] if len(shown) > 1 else shown)


@dataclass(frozen=True, slots=True)
class WipCurve:
    """Points (W, cycle time [s]) for growing W; `least`: the least W with the full pace."""

    points: tuple[tuple[int, float], ...]
    least: int


def wip_curve(timing: Timing) -> WipCurve:
    """The curve of the cycle time from W = 1 to a W that bounds nothing; the least W with the full
    pace by bisection, since the cycle time never grows with W."""
    full = timed_net(timing).pace
    paces: dict[int, float] = {}

    def pace(wip: int) -> float:
        if wip not in paces:
            paces[wip] = timed_net(timing, AS_IT_IS, wip).pace
        return paces[wip]

    top = max(part_pool(timing.factory).values()) * timing.factory.period
    low, high = 0, top
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if pace(middle) <= full * (1 + SAME) else (middle, high)
    shown = sorted({round(1 + (top - 1) * i / (POINTS - 1)) for i in range(POINTS)} | {high})
    return WipCurve(tuple((wip, pace(wip)) for wip in shown), high)
