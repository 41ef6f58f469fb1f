"""The timed net of a factory: the compiled net, with the times and places that a run adds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import lcm

from factory.nets.cycle_ratio import CycleRatio, max_cycle_ratio
from factory.nets.gears import GearNet
from factory.nets.marked import NONE, MarkedNet, marked
from factory.nets.petri import PetriNet, Place
from factory.nets.ways import busiest, with_ways
from factory.study.analysis.firing import Firings, settled_firings
from factory.study.analysis.slack import Slack, circuits
from factory.study.analysis.timing import AS_IT_IS, Change, Timing
from factory.timing.pool import with_wip
from factory.timing.serving import longer, serving, turn_ways

SAME = 1e-9
"""Relative difference up to which times are equal."""

LONGEST_PERIOD = 60


@dataclass(frozen=True, slots=True)
class Circuit:
    """A circuit of the timed net: its name (a robot, `outfeed`, `station part1`, `wip part1`, of
    several robots `r3 with r5`, that first which spends most of it), its time [s], its tokens, and
    its places in order; `units`: how many are made in a cycle of the net."""

    name: str
    seconds: float
    tokens: int
    places: tuple[int, ...]
    units: int = 1

    @property
    def products(self) -> int:
        """How many products come in its time."""
        return self.tokens * self.units

    @property
    def pace(self) -> float:
        """Seconds per product, a lower bound on the interval between two."""
        return self.seconds / self.products


@dataclass(frozen=True)
class TimedNet:
    """A net with the time of each place, and those of its circuits that have a name.

    Of a gear net without a bound `wip` these are all its simple circuits: robots' gears, and places
    that go back over one operation alone. With copies of a robot its gear has so many tokens, and
    an operation that it does alone, which has one place on the floor, a place of one token back
    over it: one at a time. The outfeed's place goes back over dropoff. Where robots go ahead while
    they wait, a gear's slowest circuit goes by those of its `ways` (places by robot and operation)
    that take longer than the operation. `train`: the gears of a gear train, whose critical circuit
    may lie in several of them; None for a gear net. `first`: what a place takes for the first time
    [s], and `ready`: when robots have gone ahead that set out at the beginning, where those are
    other times. `units`: how many products come in a cycle of the net.
    """

    net: MarkedNet
    seconds: tuple[float, ...]
    named: tuple[Circuit, ...] = field(repr=False)
    bounds: tuple[int, ...] = ()
    ways: Mapping[tuple[int, int], int] = field(default_factory=dict, repr=False)
    first: Mapping[int, float] = field(default_factory=dict, repr=False)
    ready: Mapping[int, float] = field(default_factory=dict, repr=False)
    train: GearNet | None = field(default=None, repr=False)
    units: int = 1

    @property
    def is_plain(self) -> bool:
        """Whether all simple circuits have a name."""
        return not self.bounds and self.train is None

    @cached_property
    def ratio(self) -> CycleRatio:
        """The maximum cycle ratio with its proof."""
        return max_cycle_ratio(self.net, self.seconds)

    @cached_property
    def pace(self) -> float:
        """The cycle time in the long run [s]."""
        if self.is_plain:
            return max(c.pace for c in self.named)
        return self.ratio.seconds / self.units

    @cached_property
    def circuits(self) -> tuple[Circuit, ...]:
        """Those with a name, the tightest through each bound, and in a gear train the critical one,
        the slowest first."""
        tightest = circuits(self.ratio, self.bounds) if self.bounds else ()
        found = [self._bounded(slack) for slack in tightest]
        if self.train is not None:
            found += self._meeting(self.train, [*self.named, *found])
        return tuple(sorted((*self.named, *found), key=lambda c: -c.pace))

    @cached_property
    def critical(self) -> tuple[Circuit, ...]:
        """The circuits that set the pace."""
        return tuple(c for c in self.circuits if c.pace >= self.pace * (1 - SAME))

    def _bounded(self, slack: Slack) -> Circuit:
        tokens = sum(self.net.tokens[p] for p in slack.circuit)
        names = [self.net.net.places[p].name for p in slack.circuit if p in self.bounds]
        seconds = sum(self.seconds[p] for p in slack.circuit)
        name = " ".join(names).replace(":", " ")
        return Circuit(name, seconds, tokens, slack.circuit, self.units)

    def _meeting(self, gears: GearNet, known: Sequence[Circuit]) -> list[Circuit]:
        """The critical circuit of a gear train, where none of those `known` is as slow."""
        if max(circuit.pace for circuit in known) >= self.pace * (1 - SAME):
            return []
        places = self.ratio.circuit
        first, *others = busiest(gears, self.ways, places, self.seconds)
        names = ", ".join(gears.gears[robot].robot for robot in others)
        return [
            Circuit(
                f"{gears.gears[first].robot} with {names}",
                sum(self.seconds[p] for p in places),
                sum(self.net.tokens[p] for p in places),
                places,
                self.units,
            )
        ]

    def slack(self, circuit: Circuit) -> float:
        """How much longer a circuit may take before it sets the pace [s]; for a robot's gear, how
        long it waits in a cycle."""
        found = self.pace * circuit.products - circuit.seconds
        return found if found > SAME * self.pace else 0.0

    def firings(self, units: int) -> Firings:
        """The firings of each transition for at least `units` products from the initial marking, as
        soon as possible."""
        period = lcm(*(c.tokens for c in self.critical))
        period, cycle = min(period, LONGEST_PERIOD), self.pace * self.units
        rounds = -(-units // self.units)
        return settled_firings(
            self.net, self.seconds, cycle, period, rounds, self.first, self.ready
        )


def timed_net(timing: Timing, change: Change = AS_IT_IS, wip: int | None = None) -> TimedNet:
    """The timed net of a factory with a change of its robots and a bound on copies of each part.

    Raises InputError (BadValue) where `wip` is below 1.
    """
    factory = timing.factory
    subject = marked(factory.net) if wip is None else with_wip(factory, wip)
    bounds = tuple(range(len(factory.net.threaded.places), len(subject.tokens)))
    tokens = list(subject.tokens)
    for robot, copies in change.copies.items():
        tokens[factory.net.initial[robot]] += copies - 1
    went, delays = timing.ways(change), timing.changed(change)
    if timing.outfeed and factory.folded:
        went = longer(went, turn_ways(timing.layout, delays, timing.settings))
    ways = dict(zip(went, range(len(tokens), len(tokens) + len(went)), strict=True))
    seconds = [*delays]
    seconds += [*[0.0] * (len(tokens) - len(seconds)), *went.values()]
    waits = timing.waits(change)
    for (robot, number), gone in waits.items():
        gear = factory.net.gears[robot].places
        seconds[gear[gear.index(number) - 1]] = gone
    moving = with_ways(replace(subject, tokens=tuple(tokens)), factory.net, ways)
    tokens, places = list(moving.tokens), list(moving.net.places)
    back: list[tuple[str, tuple[int, ...], float]] = [
        (f"station {factory.operations[n].label}", (n,), 0.0) for n in _alone(timing, change)
    ]
    held = longer(went, {key: gone + delays[key[1]] for key, gone in waits.items()})
    for time in serving(timing.layout, delays, timing.settings, held) if timing.outfeed else ():
        fed = factory.by_label.get(time.bottleneck.partition(" ")[2])
        served = (fed.index,) if fed else tuple(o.index for o in factory.dropoffs)
        spent = time.seconds * factory.period - sum(seconds[number] for number in served)
        back.append((time.bottleneck, served, spent / len(served)))
    named = _gears(timing, seconds, tokens, ways)
    for name, served, delay in back:
        first, circuit = len(places), list[int]()
        for step, number in enumerate(served):
            onward = factory.operations[served[(step + 1) % len(served)]]
            operation = factory.operations[number]
            circuit += [operation.place, first + step]
            places.append(Place(name, (operation.end,), (onward.start,), "wait", operation.label))
            tokens.append(int(step == len(served) - 1))
            seconds.append(delay)
        spent = sum(seconds[p] for p in circuit)
        named.append(Circuit(name, spent, 1, tuple(circuit), factory.period))
    net = replace(
        subject,
        net=PetriNet(subject.net.transitions, tuple(places)),
        tokens=tuple(tokens),
        slots=(),
    )
    ready = {ways[key]: taken for key, taken in timing.first_ways.items()}
    train = None if factory.net.is_tree else factory.net
    return TimedNet(
        net,
        tuple(seconds),
        tuple(named),
        bounds,
        ways,
        timing.first,
        ready,
        train,
        factory.period,
    )


def _gears(
    timing: Timing,
    seconds: Sequence[float],
    tokens: Sequence[int],
    ways: Mapping[tuple[int, int], int],
) -> list[Circuit]:
    """The slowest circuit in each gear."""
    found = []
    for robot, gear in zip(timing.factory.robots, timing.factory.net.gears, strict=True):
        slowest = list(gear.places)
        for step, number in enumerate(robot.operations):
            way = ways.get((robot.index, number), number)
            if way != number and seconds[way] > seconds[gear.places[2 * step]] + seconds[number]:
                slowest[2 * step], slowest[2 * step + 1] = way, NONE
        places = tuple(p for p in slowest if p != NONE)
        found.append(
            Circuit(
                gear.robot,
                sum(seconds[p] for p in places),
                sum(tokens[p] for p in places),
                places,
                timing.factory.period,
            )
        )
    return found


def _alone(timing: Timing, change: Change) -> list[int]:
    """The operations, other than dropoff in the engine, that robots with copies do alone."""
    factory = timing.factory
    numbers = dict.fromkeys(n for robot in change.copies for n in factory.robots[robot].operations)
    outfed = timing.outfeed > 0
    return [
        n
        for n in numbers
        if all(r in change.copies for r in factory.operations[n].robots)
        and not (outfed and factory.drops(n))
    ]
