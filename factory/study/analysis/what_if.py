"""What the cycle time would be: further robots, faster robots, shorter ways."""

from __future__ import annotations

from dataclasses import dataclass

from factory.study.analysis.sensitivity import STEP
from factory.study.analysis.timed import TimedNet, timed_net
from factory.study.analysis.timing import Change, Timing


@dataclass(frozen=True, slots=True)
class Scenario:
    """A change, in words, the cycle time with it [s], and what sets the pace then."""

    change: Change
    words: str
    pace: float
    then: tuple[str, ...]


def scenario(timing: Timing, words: str, change: Change, wip: int | None) -> Scenario:
    """What becomes of the cycle time with a change."""
    net = timed_net(timing, change, wip)
    return Scenario(change, words, net.pace, tuple(c.name for c in net.critical))


def scenarios(timing: Timing, net: TimedNet, wip: int | None) -> tuple[Scenario, ...]:
    """The robots that set the pace, all robots, and all ways by a tenth; then again and again a
    further copy of all the robots that set the pace."""
    robots = {robot.name: robot.index for robot in timing.factory.robots}
    critical = [c.name for c in net.critical if c.name in robots]
    percent = round(100 * STEP)
    made = []
    if len(critical) > 1:
        both = {robots[name]: 1 + STEP for name in critical}
        made.append((f"{listed(critical)} {percent} % faster", Change(speed=both)))
    everyone = range(len(robots))
    made += [
        (f"every robot {percent} % faster", Change(speed=dict.fromkeys(everyone, 1 + STEP))),
        (f"every way {percent} % shorter", Change(way=dict.fromkeys(everyone, 1 - STEP))),
    ]
    found = [scenario(timing, words, change, wip) for words, change in made]
    return (*found, *in_turn(timing, net, wip))


def in_turn(timing: Timing, net: TimedNet, wip: int | None, most: int = 4) -> list[Scenario]:
    """Another copy of all the robots that set the pace, again and again, until something else than
    robots sets it, or the pace gets no better."""
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
    """Names in a row of words."""
    shown = names[:most] + ([f"{len(names) - most} more"] if len(names) > most else [])
    return " and ".join([", ".join(shown[:-1]), shown[-1]] if len(shown) > 1 else shown)
