"""The cycle time against the bound W on copies of each part in the factory (`--wip`)."""

from __future__ import annotations

from dataclasses import dataclass

from factory.study.analysis.timed import SAME, timed_net
from factory.study.analysis.timing import AS_IT_IS, Timing
from factory.timing.pool import part_pool

SHOWN = 12
"""So many points of the curve at the most."""


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
    shown = sorted({round(1 + (top - 1) * i / (SHOWN - 1)) for i in range(SHOWN)} | {high})
    return WipCurve(tuple((wip, pace(wip)) for wip in shown), high, top)
