"""The number of products of a run that come at the pace of its net."""

from __future__ import annotations

import numpy as np

from factory.study.analysis.firing import Floats
from factory.study.analysis.timed import timed_net
from factory.study.analysis.timing import Timing

APART = 1e-3
"""The pace counts as reached where the mean interval is within this share of it."""

LEAST, MOST = 4, 100


def steady_units(timing: Timing, wip: int | None = None) -> int:
    """The least number of products, 4 to 100, over whose last half the timed net predicts the mean
    interval between dropoffs (the `cycle_time_s` of a run) to be that of the long run, and over any
    larger number too.

    Robots before the bottleneck fill first, and until then products come at the pace of others.
    """
    net = timed_net(timing, wip=wip)
    dates = net.firings(MOST).dates[:MOST, timing.factory.dropoff.end]
    return reached(dates, net.pace)


def reached(dates: Floats, pace: float) -> int:
    """The same number, by the `dates` [s] of at least 4 dropoffs; all of them where the pace is not
    reached."""
    units = np.arange(LEAST, len(dates) + 1)
    before = units // 2 - 1
    mean = (dates[units - 1] - dates[before]) / (units - 1 - before)
    late = np.flatnonzero(np.abs(mean / pace - 1) > APART)
    return min(LEAST + int(late[-1]) + 1, len(dates)) if len(late) else LEAST
