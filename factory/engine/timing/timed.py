"""The timed net of a layout: its coordinated net with the time that a token stays in each place.
What follows from it for a run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import ClassVar

from factory.engine.timing.cycle_time import CycleTime
from factory.engine.timing.earliest import earliest_firings
from factory.engine.timing.pool import part_pool, with_wip
from factory.engine.timing.timing import AS_IT_IS, Change, Timing
from factory.floor.layout.layout import Layout
from factory.support.arrays import Array
from factory.support.settings import Settings
from factory.theory.nets.cycle_ratio import CycleRatio, max_cycle_ratio
from factory.theory.nets.marked import MarkedNet
from factory.theory.nets.ways import Way, busiest, ways_apart, with_ways
from factory.theory.problem.ids import is_end


@dataclass(frozen=True)
class Timed:
    """The timed net: a marked graph with the time that a token stays in each place.

    Attributes:
        OUTFEED: what the outfeed is called, as a bottleneck.
        FEEDER: what a feeder is called, before the label of its part.
        SAME: relative difference up to which times are equal.
        timing: the delays of the factory's operations.
        net: the net with its tokens.
        seconds: time in each place [s].
        ways: by robot and operation, the place of a robot that goes ahead while it waits.
        bounds: the places of the bound `wip`.
        wip: the most units inside at once; None for no bound.
        owners: by place, the robots (index) that are in it.
    """

    OUTFEED: ClassVar[str] = "outfeed"
    FEEDER: ClassVar[str] = "feeder"
    SAME: ClassVar[float] = 1e-9

    timing: Timing
    net: MarkedNet
    seconds: tuple[float, ...]
    ways: Mapping[Way, int] = field(default_factory=dict, repr=False)
    bounds: tuple[int, ...] = ()
    wip: int | None = None
    owners: Mapping[int, tuple[int, ...]] = field(default_factory=dict, repr=False)

    @cached_property
    def ratio(self) -> CycleRatio:
        """The maximum cycle ratio with its proof."""
        return max_cycle_ratio(self.net, self.seconds)

    @property
    def pace(self) -> float:
        """The cycle time in the long run [s]."""
        return self.ratio.seconds / self.timing.factory.period

    @cached_property
    def busiest(self) -> list[int]:
        """The robots on the critical circuit, those first that spend most seconds on it."""
        return busiest(self.owners, self.ratio.circuit, self.seconds)

    @property
    def waited_for(self) -> list[int]:
        """The robots in places of their own on the critical circuit: for their hands, ways or turns
        another waits."""
        alone = (self.owners.get(place, ()) for place in self.ratio.circuit)
        return [*dict.fromkeys(robots[0] for robots in alone if len(robots) == 1)]

    @cached_property
    def bottleneck(self) -> str:
        """What allows no less: a bound on what is inside, a feeder, the outfeed, or a robot."""
        if not set(self.bounds).isdisjoint(self.ratio.circuit):
            return f"wip {self.wip}"
        places = map(self.net.net.places.__getitem__, self.ratio.circuit)
        modes = {place.mode: place.label for place in places}
        if "tray" in modes:
            return self.OUTFEED
        if "magazine" in modes:
            return f"{self.FEEDER} {modes['magazine']}"
        return self.timing.factory.robots[self.busiest[0]].name

    @property
    def pool(self) -> Mapping[str, int]:
        """For each part the greatest number of copies inside at once, under the bound `wip`."""
        return part_pool(self.timing.factory, self.wip)

    @cached_property
    def ready(self) -> Mapping[int, float]:
        """By place of a way ahead, when the token is there that it has at the beginning [s]."""
        first = self.timing.first_ways.items()
        return {self.ways[key]: seconds for key, seconds in first if key in self.ways}

    def departures(self, units: int) -> list[float]:
        """When each of so many units is dropped off at the earliest, from the initial marking with
        robots at their B ends [s]."""
        ends = [o.end for o in self.timing.factory.dropoffs]
        return [float(date) for date in self.firings(units)[:, ends].ravel()[:units]]

    def firings(self, units: int) -> Array:
        """(cycles, T): the earliest dates [s] of the firings of each transition, from the initial
        marking, for at least `units` products."""
        cycles, first = -(-units // self.timing.factory.period), self.timing.first
        return earliest_firings(self.net, self.seconds, cycles, first, self.ready)

    @property
    def cycle(self) -> CycleTime:
        """The cycle time and its bottleneck: a robot where its gear alone allows no less."""
        compiled = len(self.timing.factory.net.threaded.places)
        taken = {way: self.seconds[place] for way, place in self.ways.items()}
        gears = CycleTime.of(self.timing.factory, self.seconds[:compiled], taken)
        if gears.seconds >= self.pace * (1 - self.SAME):
            return gears
        return CycleTime(self.pace, self.bottleneck)

    @classmethod
    def of(cls, timing: Timing, change: Change = AS_IT_IS, wip: int | None = None) -> Timed:
        """The timed net of a layout with a change of its robots and a bound on copies of each part.

        In a run a transition fires a tick after those that it waits for. The net has this tick in
        each operation, so its ends come a tick late: what else follows an end takes a tick less.

        Raises InputError (BadValue) where `wip` is below 1.
        """
        factory, coordinated = timing.factory, timing.coordinated
        net, count = _copied(timing, change), len(factory.net.threaded.places)
        delays = timing.changed(change)
        seconds = [*delays, *[0.0] * (len(net.tokens) - len(delays))]
        owners: dict[int, tuple[int, ...]] = dict(enumerate(factory.net.slots))
        dates = timing.passes(change)
        dates |= {
            past: max(0.0, date - timing.tick) for past, date in dates.items() if is_end(past.after)
        }
        for past, (place, before) in coordinated.passes.items():
            seconds[place] = max(0.0, dates[past] - (dates[before] if before else 0.0))
            owners[place] = (factory.robot_of(past.axis),)
        for number, served in coordinated.served.items():
            up, seconds[served.down] = timing.strokes[number]
            seconds[served.up] = up - timing.tick
        for away in coordinated.away.values():
            seconds[away] = timing.outfeed - timing.tick
        bounds: tuple[int, ...] = ()
        if wip is not None:
            bounded = with_wip(factory, min(wip, len(factory.robots)))
            more, tokens = bounded.net.places[count:], bounded.tokens[count:]
            bounds = tuple(range(len(seconds), len(seconds) + len(more)))
            places = replace(net.net, places=(*net.net.places, *more))
            net = MarkedNet(places, (*net.tokens, *tokens))
            seconds += [0.0] * len(more)
        went = ways_apart(factory.net, seconds, timing.ways(change))
        ways = dict(zip(went, range(len(seconds), len(seconds) + len(went)), strict=True))
        owners |= {way: (robot,) for (robot, _), way in ways.items()}
        net = with_ways(net, factory.net, went)
        return cls(timing, net, (*seconds, *went.values()), ways, bounds, wip, owners)


def _copied(timing: Timing, change: Change) -> MarkedNet:
    """The coordinated net, in which the gear of a robot with copies has so many tokens."""
    coordinated, factory = timing.coordinated, timing.factory
    tokens = list(coordinated.net.tokens)
    for robot, copies in change.copies.items():
        tokens[factory.net.initial[robot]] += copies - 1
    for place, beside in coordinated.beside.items():
        tokens[place] = tokens[beside]
    return replace(coordinated.net, tokens=tuple(tokens))


def pace(layout: Layout, settings: Settings) -> tuple[CycleTime, tuple[float, ...]]:
    """The predicted cycle time of a layout in MuJoCo, and the time that each operation takes [s].

    Args:
        layout: the layout.
        settings: the settings of the run.
    """
    timing = Timing(layout, settings)
    return Timed.of(timing).cycle, timing.delays


def duration(timing: Timing, cycle: float, units: int) -> float:
    """At most how long it takes to make so many `units` from the empty factory [s]: the first by
    the slowest chain of operations from a part to dropoff, a `cycle` for each that follows, and for
    each further one of a period."""
    factory, delays = timing.factory, timing.delays
    ready = [0.0] * len(factory.robots)
    for number in factory.order:
        operation = factory.operations[number]
        if factory.drops(number) or operation.turn:
            continue
        done = max(ready[robot] for robot in operation.robots) + delays[operation.index]
        for robot in operation.robots:
            ready[robot] = done
    return max(ready) + delays[-1] + (units + factory.period - 2) * cycle
