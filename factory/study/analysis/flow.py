"""The flow of products in a timed net: their dates, and the shares of the robots' time."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from factory.study.analysis.firing import Floats
from factory.study.analysis.timed import TimedNet, timed_net
from factory.timing.timing import Timing

APART = 1e-3
"""Relative deviation of the mean interval up to which the pace counts as reached."""

LEAST, MOST = 4, 100


@dataclass(frozen=True, slots=True)
class Share:
    """Times of a robot in a cycle [s]: `moving`; `working`, in dwells; `standing` in an operation
    while other robots or the outfeed's tray move; `waiting` for the next operation. Going ahead
    while it waits counts as moving. For copies of a robot, the times of one of them."""

    robot: str
    moving: float
    working: float
    standing: float
    waiting: float

    @property
    def cycle(self) -> float:
        """The cycle [s]."""
        return self.moving + self.working + self.standing + self.waiting

    @property
    def busy(self) -> float:
        """Share of its time in operations."""
        return 1.0 - self.waiting / self.cycle if self.cycle else 0.0


@dataclass(frozen=True)
class Flow:
    """Flow of `units` products: the dates of the `first` and the `last` dropoff (in the engine:
    exit from the outfeed) [s]. `durations` (cycles, operations): time from start to end of each
    operation each time [s]; `busy`: share of the time until `last` for which each robot is in
    operations."""

    units: int
    first: float
    last: float
    shares: tuple[Share, ...] = field(repr=False)
    durations: Floats = field(repr=False)
    busy: tuple[float, ...] = field(repr=False)

    @property
    def lasting(self) -> Floats:
        """(operations,): mean duration of each [s], without its first occurrence if there are
        others: robots start that one from other positions."""
        later = self.durations[min(1, len(self.durations) - 1) :]
        return np.asarray(later.mean(axis=0))


def flow(timing: Timing, net: TimedNet, units: int) -> Flow:
    """The flow of `units` products from the initial marking, with earliest firings."""
    dates, factory = net.firings(units), timing.factory
    products = leaving_dates(timing, dates)
    last = float(products[units - 1]) + timing.leaving
    starts, ends = [o.start for o in factory.operations], [o.end for o in factory.operations]
    durations = dates[:, ends] - dates[:, starts] - timing.settings.tick
    spent = durations.sum(axis=0)
    return Flow(
        units,
        float(products[0]) + timing.leaving,
        last,
        tuple(_share(timing, net, robot) for robot in range(len(factory.robots))),
        durations,
        tuple(float(spent[list(robot.operations)].sum()) / last for robot in factory.robots),
    )


def leaving_dates(timing: Timing, dates: Floats) -> Floats:
    """Date of the dropoff of each product [s], by those of all firings (cycles, T)."""
    return np.asarray(dates[:, [o.end for o in timing.factory.dropoffs]].ravel())


def _share(timing: Timing, net: TimedNet, number: int) -> Share:
    robot = timing.factory.robots[number]
    circuit = next(c for c in net.named if c.name == robot.name)
    moving = working = spent = 0.0
    for index in robot.operations:
        operation = timing.factory.operations[index]
        moving += timing.travel(index, operation.robots.index(number))
        working += timing.modes[index].dwell
        way = net.ways.get((number, index), index)
        spent += max(net.seconds[index], net.seconds[way]) - timing.settings.tick
    cycle = net.pace * circuit.products
    moving = min(moving, spent - working)
    return Share(robot.name, moving, working, max(0.0, spent - moving - working), cycle - spent)


def steady_units(timing: Timing, wip: int | None = None) -> int:
    """Least number of products, 4 to 100, from which on the predicted mean interval between
    dropoffs over their last half (the `cycle_time_s` of a run) is that of the long run.

    Robots before the bottleneck fill first; until then products come at the pace of other robots.
    """
    net = timed_net(timing, wip=wip)
    dates = leaving_dates(timing, net.firings(MOST))[:MOST]
    return reached(dates, net.pace, net.units)


def reached(dates: Floats, pace: float, period: int = 1) -> int:
    """The same number, for the `dates` [s] of at least 4 dropoffs, with `period` of them in a
    cycle; the number of all if the pace is not reached."""
    units = np.arange(LEAST, len(dates) + 1)
    count = units - units // 2
    count -= np.where(count >= period, count % period, 0)
    mean = (dates[units - 1] - dates[units - 1 - count]) / count
    late = np.flatnonzero(np.abs(mean / pace - 1) > APART)
    return min(LEAST + int(late[-1]) + 1, len(dates)) if len(late) else LEAST
