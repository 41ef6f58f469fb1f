"""The timed net of a factory: the compiled net with the delays and places of a run; and the flow of
products in it: their dates, and the shares of the robots' time."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from factory.api import MarkedNet, PetriNet, Place, Run, Timing
from factory.apps.analyze.firing import Slack, circuits
from factory.engine.timing.timed import Timed
from factory.engine.timing.timing import Change
from factory.support.arrays import Array


@dataclass(frozen=True, slots=True)
class Circuit:
    """A circuit of the timed net: its name (a robot, `outfeed`, `station part1`, `wip part1`, or
    `r3 with r5` for several robots, the one with the largest share first), its time [s], its
    tokens, and its places in order; `units`: number of products in a cycle of the net."""

    name: str
    seconds: float
    tokens: int
    places: tuple[int, ...]
    units: int = 1

    @property
    def products(self) -> int:
        """Number of products in its time."""
        return self.tokens * self.units

    @property
    def pace(self) -> float:
        """Seconds per product, a lower bound on the interval between two."""
        return self.seconds / self.products


@dataclass(frozen=True)
class TimedNet(Timed):
    """A timed net, and those of its circuits that have a name.

    In the ideal world the named circuits of a gear net without a bound `wip` are all its simple
    circuits: robots' gears, and places that lead back over one operation alone. With copies of a
    robot its gear has as many tokens; an operation that it does alone has one position on the
    floor, so a place of one token leads back over it: one at a time. If robots go ahead while they
    wait, the slowest circuit of a gear contains those of its ways that take longer than the
    operation."""

    named: tuple[Circuit, ...] = field(default=(), repr=False)

    @property
    def units(self) -> int:
        """Number of products in a cycle of the net."""
        return self.timing.factory.period

    @cached_property
    def circuits(self) -> tuple[Circuit, ...]:
        """The named circuits, the tightest through each bound, and the critical one; the slowest
        first."""
        bounds = self.bounds
        tightest = circuits(self.ratio, bounds) if bounds else ()
        others = [self._bounded(slack) for slack in tightest]
        others += self._meeting([*self.named, *others])
        return tuple(sorted((*self.named, *others), key=lambda c: -c.pace))

    @cached_property
    def critical(self) -> tuple[Circuit, ...]:
        """The circuits that set the pace."""
        return tuple(c for c in self.circuits if c.pace >= self.pace * (1 - self.SAME))

    def _bounded(self, slack: Slack) -> Circuit:
        names = [self.net.net.places[p].name for p in slack.circuit if p in self.bounds]
        name = " ".join(names).replace(":", " ")
        return _circuit(name, slack.circuit, self.seconds, self.net.tokens, self.units)

    def _meeting(self, others: Sequence[Circuit]) -> list[Circuit]:
        """The critical circuit, where none of the `others` is as slow."""
        if max(circuit.pace for circuit in others) >= self.pace * (1 - self.SAME):
            return []
        places, robots = self.ratio.circuit, self.timing.factory.robots
        first = self.busiest[0]
        names = ", ".join(robots[robot].name for robot in self.waited_for if robot != first)
        name = f"{robots[first].name} with {names}" if names else robots[first].name
        return [_circuit(name, places, self.seconds, self.net.tokens, self.units)]

    def slack(self, circuit: Circuit) -> float:
        """Increase of a circuit's time from which it sets the pace [s]; for the gear of a robot,
        its waiting time in a cycle."""
        slack = self.pace * circuit.products - circuit.seconds
        return slack if slack > self.SAME * self.pace else 0.0


def timed_net(timing: Timing, change: Change | None = None, wip: int | None = None) -> TimedNet:
    """The timed net of a factory with a change of its robots and a bound on copies of each part.

    Raises InputError (BadValue) where `wip` is below 1.
    """
    change = change or Change()
    made, factory = Timed.of(timing, change, wip), timing.factory
    places, tokens, seconds = [*made.net.net.places], [*made.net.tokens], [*made.seconds]
    named = _gears(timing, seconds, tokens, made.ways)
    for number in _alone(timing, change):
        operation = factory.operations[number]
        name, ends = f"station {operation.label}", ((operation.end,), (operation.start,))
        circuit = operation.place, len(places)
        places.append(Place(name, *ends, "wait", operation.label))
        tokens.append(1)
        seconds.append(0.0)
        named.append(Circuit(name, seconds[operation.place], 1, circuit, factory.period))
    named += _machines(timing, made)
    whole = PetriNet(made.net.net.transitions, tuple(places))
    return TimedNet(
        timing,
        MarkedNet(whole, tuple(tokens)),
        tuple(seconds),
        made.ways,
        made.bounds,
        made.wip,
        made.owners,
        tuple(named),
    )


def _machines(timing: Timing, made: Timed) -> Iterator[Circuit]:
    """The circuits of the tray, and of the magazines of robots with one tour."""
    factory, seconds, coordinated = timing.factory, made.seconds, timing.coordinated
    if not coordinated.away:
        return
    trays = [p for o in factory.dropoffs for p in (o.place, coordinated.away[o.index])]
    cycles = [(made.OUTFEED, trays)]
    for number, served in coordinated.served.items():
        if number == served.before:
            leaf = factory.operations[number]
            cycles.append(
                (f"{made.FEEDER} {leaf.label}", [leaf.place, served.up, served.top, served.down])
            )
    for name, places in cycles:
        spent = sum(seconds[p] for p in places)
        yield Circuit(name, spent, 1, tuple(places), factory.period)


def _gears(
    timing: Timing,
    seconds: Sequence[float],
    tokens: Sequence[int],
    ways: Mapping[tuple[int, int], int],
) -> list[Circuit]:
    """The slowest circuit in each gear."""
    gears = []
    for robot, gear in zip(timing.factory.robots, timing.factory.net.gears, strict=True):
        slowest: list[int] = list(gear.places)
        for step, number in enumerate(robot.operations):
            way = ways.get((robot.index, number), number)
            if way != number and seconds[way] > seconds[gear.waiting(step)] + seconds[number]:
                slowest[2 * step], slowest[2 * step + 1] = way, MarkedNet.NONE
        places = tuple(p for p in slowest if p != MarkedNet.NONE)
        gears.append(_circuit(gear.robot, places, seconds, tokens, timing.factory.period))
    return gears


def _circuit(
    name: str,
    places: tuple[int, ...],
    seconds: Sequence[float],
    tokens: Sequence[int],
    units: int,
) -> Circuit:
    """The circuit of these places, with the sums of their `seconds` and `tokens`."""
    spent, there = sum(seconds[p] for p in places), sum(tokens[p] for p in places)
    return Circuit(name, spent, there, places, units)


def _alone(timing: Timing, change: Change) -> list[int]:
    """The operations that only robots with copies do, except the dropoff in the engine."""
    factory = timing.factory
    numbers = dict.fromkeys(n for robot in change.copies for n in factory.robots[robot].operations)
    outfed = timing.outfeed > 0
    return [
        n
        for n in numbers
        if all(r in change.copies for r in factory.operations[n].robots)
        and not (outfed and factory.drops(n))
    ]


APART = 1e-3
"""Relative deviation of the mean interval up to which the pace counts as reached."""

MOST = 100


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
    durations: Array = field(repr=False)
    busy: tuple[float, ...] = field(repr=False)

    @property
    def lasting(self) -> Array:
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


def leaving_dates(timing: Timing, dates: Array) -> Array:
    """Date of the dropoff of each product [s], by those of all firings (cycles, T)."""
    ends = dates[:, [o.end for o in timing.factory.dropoffs]] - timing.tick
    return np.asarray(ends.ravel())


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


def steady_units(timing: Timing) -> int:
    """Least number of products, 4 to 100, from which on the predicted mean interval between
    dropoffs over their last half (the `cycle_time_s` of a run) is that of the long run.

    Robots before the bottleneck fill first; until then products come at the pace of other robots.
    """
    net = Timed.of(timing)
    return reached(np.array(net.departures(MOST)), net.pace, timing.factory.period)


def reached(dates: Array, pace: float, period: int = 1) -> int:
    """The same number, for the `dates` [s] of at least 4 dropoffs, with `period` of them in a
    cycle; the number of all if the pace is not reached."""
    least = Run.steady_from(period)
    units = np.arange(least, len(dates) + 1)
    count = units - units // 2
    count -= count % period
    mean = (dates[units - 1] - dates[units - 1 - count]) / count
    late = np.flatnonzero(np.abs(mean / pace - 1) > APART)
    return min(least + int(late[-1]) + 1 if len(late) else least, len(dates))
