"""The firings of a timed net: filling, work in progress, how robots spend their time."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from factory.plant.factory import Operation
from factory.study.analysis.firing import Firings, Floats
from factory.study.analysis.timed import TimedNet, timed_net
from factory.timing.timing import Timing

APART = 1e-3
"""The pace counts as reached where the mean interval is within this share of it."""

LEAST, MOST = 4, 100


@dataclass(frozen=True, slots=True)
class WorkInProgress:
    """The number of copies of a label at once in the long run, and how long each stays [s].

    A part stays from the start of the operation that takes it until it is dropped off, whatever it
    has become a part of; any other sub-assembly from the end of the operation that makes it to that
    of the one that takes it.
    """

    label: str
    is_part: bool
    mean: float
    most: int
    stay: float


@dataclass(frozen=True, slots=True)
class Share:
    """How a robot spends a cycle [s]: `moving`; `working`, a dwell; `standing` at its place in an
    operation while other robots or the outfeed's tray move; `waiting` for the next operation. Going
    ahead while it waits counts as moving. Of several copies of a robot, one of them."""

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
        """The share of its time that it is in an operation."""
        return 1.0 - self.waiting / self.cycle if self.cycle else 0.0


@dataclass(frozen=True)
class Flow:
    """When products come: `first` and `last` of `units`, dropped off (in the engine: out of the
    outfeed) [s]; `full_pace`: the number of the product from which on they come at the pace;
    `settled`: whether the firings become periodic within those that were computed, else `stocks`
    are those at their end. `durations` (cycles, operations): how long each operation lasts each
    time, from its start to its end [s]; `busy`: the share of the time until `last` for which each
    robot is in operations.
    """

    units: int
    first: float
    last: float
    full_pace: int | None
    settled: bool
    stocks: tuple[WorkInProgress, ...] = field(repr=False)
    shares: tuple[Share, ...] = field(repr=False)
    firings: Firings = field(repr=False)
    durations: Floats = field(repr=False)
    busy: tuple[float, ...] = field(repr=False)

    @property
    def inside(self) -> float:
        """The mean number of parts in the factory at once."""
        return sum(stock.mean for stock in self.stocks if stock.is_part)

    @property
    def lasting(self) -> Floats:
        """(operations,): the mean duration of each [s]. The first is left out where there are
        others: robots start it from other places."""
        later = self.durations[min(1, len(self.durations) - 1) :]
        return np.asarray(later.mean(axis=0))


def flow(timing: Timing, net: TimedNet, units: int) -> Flow:
    """The flow of at least `units` products from the initial marking, all firing as soon as they
    can."""
    firings, factory = net.firings(units), timing.factory
    products = leaving_dates(timing, firings)
    last = float(products[units - 1]) + timing.leaving
    dates = firings.dates[: -(-units // factory.period)]
    starts, ends = [o.start for o in factory.operations], [o.end for o in factory.operations]
    durations = dates[:, ends] - dates[:, starts] - timing.settings.tick
    spent = durations.sum(axis=0)
    return Flow(
        units,
        float(products[0]) + timing.leaving,
        last,
        _full_pace(products, firings, net.units),
        firings.settled is not None,
        _stocks(timing, firings),
        tuple(_share(timing, net, robot) for robot in range(len(factory.robots))),
        firings,
        durations,
        tuple(float(spent[list(robot.operations)].sum()) / last for robot in factory.robots),
    )


def leaving_dates(timing: Timing, firings: Firings) -> Floats:
    """When each product is dropped off [s]."""
    return np.asarray(firings.dates[:, [o.end for o in timing.factory.dropoffs]].ravel())


def _full_pace(products: Floats, firings: Firings, units: int) -> int | None:
    """The product, counted from 1, after which the mean interval never leaves the pace."""
    if firings.settled is None:
        return None
    period = firings.period * units
    apart = products[period:] - products[:-period] - firings.advance
    late = np.flatnonzero(np.abs(apart) > 1e-9 * (1.0 + products[-1]))
    return int(late[-1]) + 2 if len(late) else 1


def _stocks(timing: Timing, firings: Firings) -> tuple[WorkInProgress, ...]:
    """Over as many whole periods as lie before the last firing of every transition."""
    factory, dates, advance = timing.factory, firings.dates, firings.advance
    end = float(dates[-1].min())
    settled = 0 if firings.settled is None else firings.settled
    periods = int((end - float(dates[settled].max())) / advance) if advance else 0
    begin = end - max(1, periods) * advance
    stocks = []
    for operation in factory.making:
        part = not operation.inputs
        above = factory.operations[factory.parents[operation.index]]
        parent = factory.dropoffs[operation.turn] if part else above
        enters = dates[:, operation.start if part else operation.end]
        leaves = dates[:, parent.end]
        stocks.append(_stock(operation, enters, leaves, begin, end))
    return tuple(stocks)


def _stock(
    operation: Operation, enters: Floats, leaves: Floats, begin: float, end: float
) -> WorkInProgress:
    """Time averages between `begin` and `end`. A copy that leaves at the moment at which another
    comes is not counted with it."""
    stays = np.clip(leaves, begin, end) - np.clip(enters, begin, end)
    instants = [(float(t), -1) for t in leaves if begin < t <= end]
    instants += [(float(t), +1) for t in enters if begin < t <= end]
    count = most = int(np.sum((enters <= begin) & (leaves > begin)))
    for _, step in sorted((round(t, 9), step) for t, step in instants):
        count += step
        most = max(most, count)
    counted = (enters > begin) & (enters <= end)
    whole = (leaves - enters)[counted]
    stay = float(whole.mean()) if len(whole) else 0.0
    length = end - begin
    mean = float(stays.sum()) / length if length > 0 else 0.0
    return WorkInProgress(operation.label, not operation.inputs, mean, most, stay)


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
    """The least number of products, 4 to 100, over whose last half the timed net predicts the mean
    interval between dropoffs (the `cycle_time_s` of a run) to be that of the long run, and over any
    larger number too.

    Robots before the bottleneck fill first, and until then products come at the pace of others.
    """
    net = timed_net(timing, wip=wip)
    dates = leaving_dates(timing, net.firings(MOST))[:MOST]
    return reached(dates, net.pace, net.units)


def reached(dates: Floats, pace: float, period: int = 1) -> int:
    """The same number, by the `dates` [s] of at least 4 dropoffs, of which so many come in a
    `period`; all of them where the pace is not reached."""
    units = np.arange(LEAST, len(dates) + 1)
    count = units - units // 2
    count -= np.where(count >= period, count % period, 0)
    mean = (dates[units - 1] - dates[units - 1 - count]) / count
    late = np.flatnonzero(np.abs(mean / pace - 1) > APART)
    return min(LEAST + int(late[-1]) + 1, len(dates)) if len(late) else LEAST
