"""What the cycle time would be: further robots, faster robots, shorter ways, fewer parts let in."""

from __future__ import annotations

from dataclasses import dataclass

from factory.study.analysis.sensitivity import STEP
from factory.study.analysis.timed import SAME, TimedNet, timed_net
from factory.study.analysis.timing import AS_IT_IS, Change, Timing
from factory.timing.pool import part_pool

POINTS = 12
"""Upper bound on the points of the curve."""


@dataclass(frozen=True, slots=True)
class Scenario:
    """A change, in words, the cycle time with it [s], and what sets the pace then."""

    change: Change
    words: str
    pace: float
    then: tuple[str, ...]


def scenario(timing: Timing, words: str, change: Change, wip: int | None) -> Scenario:
    """The scenario of a change."""
    net = timed_net(timing, change, wip)
    return Scenario(change, words, net.pace, tuple(c.name for c in net.critical))


def scenarios(timing: Timing, net: TimedNet, wip: int | None) -> tuple[Scenario, ...]:
    """The robots that set the pace, all robots, and all ways, changed by a tenth; then further
    copies of the robots that set the pace."""
    robots = {robot.name: robot.index for robot in timing.factory.robots}
    critical = [c.name for c in net.critical if c.name in robots]
    percent = round(100 * STEP)
    made = []
    if len(critical) > 1:
        both = {robots[name]: 1 + STEP for name in critical}
        made.append((f"{listed(critical)} {percent} % faster", Change(speed=both)))
    every = range(len(robots))
    made += [
        (f"every robot {percent} % faster", Change(speed=dict.fromkeys(every, 1 + STEP))),
        (f"every way {percent} % shorter", Change(way=dict.fromkeys(every, 1 - STEP))),
    ]
    found = [scenario(timing, words, change, wip) for words, change in made]
    return (*found, *in_turn(timing, net, wip))


def in_turn(timing: Timing, net: TimedNet, wip: int | None, most: int = 4) -> list[Scenario]:
    """Another copy of all the robots that set the pace, repeatedly, until something else than
    robots sets it, or the pace does not improve."""
    robots = {robot.name: robot.index for robot in timing.factory.robots}
    copies: dict[int, int] = {}
    found: list[Scenario] = []
    pace, critical = net.pace, tuple(c.name for c in net.critical)
    while len(found) < most and all(name in robots for name in critical):
        for name in critical:
            copies[robots[name]] = copies.get(robots[name], 1) + 1
        words = listed([f"{n} × {timing.factory.robots[r].name}" for r, n in copies.items()])
        last = scenario(timing, words, Change(copies=dict(copies)), wip)
        if last.pace >= pace * (1 - 1e-9):
            break
        found.append(last)
        pace, critical = last.pace, last.then
    return found


def listed(names: list[str], most: int = 6) -> str:
    """Names as an enumeration: `a, b and c`."""
    shown = names[:most] + ([f"{len(names) - most} more"] if len(names) > most else [])
    return " and ".join([", ".join(shown[:-1]), shown[-1]] if len(shown) > 1 else shown)


@dataclass(frozen=True, slots=True)
class WipCurve:
    """Points (W, cycle time [s]) for growing W; `least`: the least W at which the pace is the full
    one; `all`: that at which W is no bound any more."""

    points: tuple[tuple[int, float], ...]
    least: int
    all: int


def wip_curve(timing: Timing) -> WipCurve:
    """The cycle time for some W from 1 up to the least at which the pace is the full one, and on
    to where W bounds nothing. Found by bisection: the cycle time never grows with W."""
    full = timed_net(timing).pace
    paces: dict[int, float] = {}

    def pace(wip: int) -> float:
        if wip not in paces:
            paces[wip] = timed_net(timing, AS_IT_IS, wip).pace
        return paces[wip]

    top = max(part_pool(timing.factory).values())
    low, high = 0, top
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if pace(middle) <= full * (1 + SAME) else (middle, high)
    shown = sorted({round(1 + (top - 1) * i / (POINTS - 1)) for i in range(POINTS)} | {high})
    return WipCurve(tuple((wip, pace(wip)) for wip in shown), high, top)
