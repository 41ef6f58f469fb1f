"""Bundles: tours on one line, with the bundles of the lines that deliver to it.

A bundle is made for each tour, those that deliver to it first. Its *load* is the duration of its
tours, waits included: a robot that holds a pile while others bring the rest can do nothing else.
Two bundles are merged where one robot can do the tours of both within a limit of load; the lines
below them are merged too. All robots of a bundle then go as far as the one with the longest way.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import inf

from factory.api import NOPART, Factory, Operation, Pace
from factory.apps.few_robots.folding import Line
from factory.support.boxes import Box

BETWEEN = 0.08
"""Distance between two sub-assemblies at the ends of a guidepath [m]."""

LANE = 0.08
"""Length of a path that a robot which delivers to it takes [m]."""

TOOL_WAY = 0.12
"""Way of a tool [m]."""

ABREAST = 2
"""Number of lines that can come to one station, one from either side."""


@dataclass(frozen=True, slots=True)
class Filling:
    """Parameters by which lines are filled: the `limit` of each line's load [s]; the time that a
    tour may wait for those that share a line, over its own work (`slack`); whether robots only go
    `onward` from station to station on a tour, or back as well."""

    limit: float
    slack: float = inf
    onward: bool = False


@dataclass(frozen=True)
class SizeTiming:
    """Durations of a factory's operations, estimated from the `sizes` of its sub-assemblies [m] and
    the `pace` of its robots."""

    factory: Factory
    sizes: Mapping[str, float]
    pace: Pace

    @classmethod
    def of(cls, factory: Factory, boxes: Mapping[str, Box], pace: Pace) -> SizeTiming:
        """The durations for a factory, with the `boxes` of its sub-assemblies."""
        return cls(factory, {n: max(b[1] - b[0], b[3] - b[2]) for n, b in boxes.items()}, pace)

    def past(self, robot: int, tour: Sequence[int]) -> float:
        """Way of a robot past the sub-assembly that it delivers to, on a tour [m]."""
        last = self.factory.operations[tour[-1]]
        label = last.before[last.robots.index(robot)]
        if label == NOPART:
            return TOOL_WAY
        return (self.sizes[label] + self.sizes.get(last.label, self.sizes[label])) / 2 + BETWEEN

    @property
    def outputs(self) -> list[int]:
        """The output robot of each product."""
        return [dropoff.carrier for dropoff in self.factory.dropoffs]

    @cached_property
    def tours(self) -> tuple[_Tour, ...]:
        """The tour of each robot of a factory with a robot for each label, tools apart."""
        robots = range(len(self.factory.robots))
        kinds = [
            ("output",) if robot in self.outputs else self.factory.tour_kind(robot)
            for robot in robots
        ]
        chosen = (robot for robot in robots if kinds[robot][0] != "tool")
        return tuple(_Tour.of(self, robot, kinds[robot]) for robot in chosen)

    def takes(self, number: int, way: float) -> float:
        """Duration of an operation in which the longest way is `way` [s]."""
        operation, pace = self.factory.operations[number], self.pace
        stroke = operation.approach.stroke if operation.approach and operation.lowered >= 0 else 0.0
        return pace.rest(way) + pace.rest(stroke) + operation.dwell + pace.lost


@dataclass(frozen=True, slots=True)
class TourBundle:
    """`tours` on one line, by their robots; how long they last without the way out and back, `busy`
    [s]; their `kind`, and the `sides` from which all of them can come; the bundles `below` that are
    inserted, in the order of their stations, and those `first` that bring what each tour begins
    with, two or none; how far the robot has to go past others, `past` [m]. Derived: how far it goes
    `out`, how far what delivers to it reaches to either side, `beside` [m]; its `load` [s]."""

    tours: tuple[int, ...]
    busy: float
    kind: tuple[object, ...]
    sides: frozenset[int]
    below: tuple[TourBundle, ...]
    first: tuple[TourBundle, ...]
    past: float
    pace: Pace
    out: float = 0.0
    beside: float = 0.0
    load: float = 0.0

    def __post_init__(self) -> None:
        lines = (*self.first, *self.below)
        taken = sum(max(LANE, 2 * line.beside) for line in lines) / 2
        out = max(self.past, BETWEEN + taken)
        object.__setattr__(self, "out", out)
        beside = max((line.out + BETWEEN for line in lines), default=0.0)
        object.__setattr__(self, "beside", beside)
        trips = 2 * len(self.tours) * (self.pace.rest(out) + self.pace.lost)
        object.__setattr__(self, "load", self.busy + trips)

    def merged(self, other: TourBundle, filling: Filling) -> TourBundle | None:
        """Both as one bundle with all loads within the limit; None where that is impossible."""
        sides = self.sides & other.sides
        if self.kind != other.kind or not sides or self.load + other.load > filling.limit:
            return None
        first = self._first(other, filling) if self.first else ()
        if first is None:
            return None
        below = _laid_over(self.below, other.below, filling)
        tours, busy = self.tours + other.tours, self.busy + other.busy
        past = max(self.past, other.past)
        merged = TourBundle(tours, busy, self.kind, sides, below, first, past, self.pace)
        return merged if merged.load <= filling.limit else None

    def _first(self, other: TourBundle, filling: Filling) -> tuple[TourBundle, ...] | None:
        """The two bundles that bring what the tours begin with, merged pair by pair."""
        for pair in (other.first, other.first[::-1]):
            both = [mine.merged(its, filling) for mine, its in zip(self.first, pair, strict=True)]
            if None not in both:
                return tuple(bundle for bundle in both if bundle)
        return None

    def lines(self) -> Iterator[Line]:
        """The lines with more than one tour, from this one down."""
        stack = [self]
        while stack:
            bundle = stack.pop()
            if len(bundle.tours) > 1:
                yield tuple(sorted(bundle.tours))
            stack += [*bundle.below, *bundle.first]


def _laid_over(
    ones: tuple[TourBundle, ...], others: tuple[TourBundle, ...], filling: Filling
) -> tuple[TourBundle, ...]:
    """Bundles in the order of their stations, merged with others: each of these with the first that
    it can be merged with (with `onward` the first after the last merged one), else inserted."""
    below, at = list(ones), 0
    for bundle in others:
        for number in range(at, len(below)):
            merged = below[number].merged(bundle, filling)
            if merged is not None:
                below[number] = merged
                at = number + 1 if filling.onward else 0
                break
        else:
            below.insert(at if filling.onward else len(below), bundle)
            at += filling.onward
    return tuple(below)


@dataclass(slots=True)
class _Local:
    """A line that delivers in one tour: its bundle, and the time of its last delivery [s]."""

    bundle: TourBundle
    at: float


@dataclass(frozen=True, slots=True)
class _Tour:
    """The tour of a `robot`, whatever lines there are: its `kind`, the `sides` from which it may
    come and how far it goes `past` others, as `TourBundle` has them; the robots `first` that bring
    what it begins with; for each further operation its number, and the robots that bring something
    to what the robot already holds (`stops`), and for each of these the operation that it delivers
    to (`kids`)."""

    robot: int
    kind: tuple[object, ...]
    sides: frozenset[int]
    past: float
    first: tuple[int, ...]
    stops: tuple[tuple[int, tuple[int, ...]], ...]
    kids: tuple[tuple[int, int], ...]

    @classmethod
    def of(cls, timing: SizeTiming, robot: int, kind: tuple[object, ...]) -> _Tour:
        """That of a robot of a factory with a robot for each label."""
        factory = timing.factory
        numbers, is_output = factory.robots[robot].operations, kind == ("output",)
        inserted = {n: _inserted(factory, robot, factory.operations[n]) for n in numbers}
        kids = [kid for robots in inserted.values() for kid in robots]
        return cls(
            robot,
            kind,
            frozenset({1}) if is_output else frozenset(factory.sides(robot)),
            timing.past(robot, numbers),
            tuple(kid for kid in factory.begun_by(robot) if factory.tour_kind(kid)[0] != "tool"),
            tuple((n, inserted[n]) for n in (numbers[1:] if is_output else numbers[1:-1])),
            tuple((kid, factory.last(kid).index) for kid in kids),
        )

    def bundle(
        self, timing: SizeTiming, filling: Filling, made: Mapping[int, TourBundle]
    ) -> TourBundle:
        """Its bundle; `made`: those of the robots that deliver to it. Each of these joins the line
        with the shortest wait, or a new line where the wait is too long; with `onward` only the
        last two lines are considered, since two can come to one station."""
        work = sum(timing.takes(number, made[kid].out) for kid, number in self.kids)
        spare = min(filling.slack * work, max(filling.limit - work, 0.0))
        now, waited, locals_ = 0.0, 0.0, list[_Local]()
        for number, kids in self.stops:
            for kid in kids:
                lines = locals_[-ABREAST:] if filling.onward else locals_
                wait, merged, line = _least(lines, made[kid], now, filling)
                if line is None or merged is None or waited + wait > spare + 1e-9:
                    now += timing.takes(number, made[kid].out)
                    locals_.append(_Local(made[kid], now))
                    continue
                waited, now = waited + wait, now + wait + timing.takes(number, merged.out)
                line.bundle, line.at = merged, now
            if not kids:
                now += timing.takes(number, TOOL_WAY)
        below = tuple(line.bundle for line in locals_)
        first = tuple(made[kid] for kid in self.first)
        tours, pace = (self.robot,), timing.pace
        return TourBundle(tours, now, self.kind, self.sides, below, first, self.past, pace)


def bundled(timing: SizeTiming, filling: Filling) -> list[TourBundle]:
    """The bundle of the output robot of each product of a factory with a robot for each label."""
    made = dict[int, TourBundle]()
    for tour in reversed(timing.tours):
        made[tour.robot] = tour.bundle(timing, filling, made)
    return [made[robot] for robot in timing.outputs]


def _least(
    lines: Sequence[_Local], kid: TourBundle, now: float, filling: Filling
) -> tuple[float, TourBundle | None, _Local | None]:
    """The shortest wait of a tour for a kid [s], with the merged bundle and the line; None where it
    can join none of them."""
    best: tuple[float, TourBundle | None, _Local | None] = inf, None, None
    for line in lines:
        wait = max(0.0, line.at + kid.load - kid.pace.rest(kid.out) - now)
        if wait < best[0] and (merged := line.bundle.merged(kid, filling)) is not None:
            best = wait, merged, line
    return best


def _inserted(factory: Factory, robot: int, operation: Operation) -> tuple[int, ...]:
    """The robots that bring something in an operation to what a robot already holds."""
    if operation.carrier != robot or operation.pile == NOPART:
        return ()
    pairs = zip(operation.robots, operation.before, strict=True)
    return tuple(guest for guest, label in pairs if guest != robot and label != NOPART)
