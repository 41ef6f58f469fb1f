"""Bundles: tours on one line, with the bundles of the lines that deliver to it.

A bundle is made for each tour, those that deliver to it first. Its *load* is how long its tours
last, waits included: a robot that holds a pile while others bring the rest is not free for anything
else. Two bundles become one where one robot can do the tours of both, within a limit of load, and
the lines below them are laid over each other.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from math import inf

from factory.compiler.folding import Line, begun_by, delivery, kind_of, sides_of
from factory.plant.factory import Factory
from factory.problem.pag import NOPART


@dataclass(frozen=True, slots=True)
class Bundle:
    """`tours` on one line, by their robots; their `load` [s]; their `kind`, and the `sides` from
    which all of them can come; the bundles `below` that are inserted, and those `first` that bring
    what each tour begins with, two or none."""

    tours: tuple[int, ...]
    load: float
    kind: tuple[object, ...]
    sides: frozenset[int]
    below: tuple[Bundle, ...] = ()
    first: tuple[Bundle, ...] = ()

    def merged(self, other: Bundle, limit: float) -> Bundle | None:
        """Both as one bundle, none of whose lines has more load than a limit [s]; None where that
        cannot be."""
        sides, load = self.sides & other.sides, self.load + other.load
        if self.kind != other.kind or not sides or load > limit:
            return None
        first = self._first(other, limit) if self.first else ()
        if first is None:
            return None
        below = list(self.below)
        for bundle in sorted(other.below, key=lambda b: -b.load):
            _lay_over(below, bundle, limit)
        return Bundle(self.tours + other.tours, load, self.kind, sides, tuple(below), first)

    def _first(self, other: Bundle, limit: float) -> tuple[Bundle, ...] | None:
        """The two that bring what tours begin with, each of one with one of the other."""
        for pair in (other.first, other.first[::-1]):
            both = [mine.merged(its, limit) for mine, its in zip(self.first, pair, strict=True)]
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


def _lay_over(below: list[Bundle], bundle: Bundle, limit: float) -> None:
    """A bundle becomes one with the first of some that it can, else it is one more."""
    for number, one in enumerate(below):
        merged = one.merged(bundle, limit)
        if merged is not None:
            below[number] = merged
            return
    below.append(bundle)


@dataclass(frozen=True, slots=True)
class Filling:
    """What lines are filled for: a `limit` of each line's load [s]; by what share of its own work a
    tour may be longer since it waits for those that share a line (`slack`)."""

    limit: float
    slack: float = inf


@dataclass(slots=True)
class _Local:
    """A line that delivers in one tour: its bundle, and when it last did [s]."""

    bundle: Bundle
    at: float


def bundled(factory: Factory, delays: Sequence[float], filling: Filling) -> Bundle:
    """The bundle of the output robot of a factory with a robot for each label, whose operations
    take some time [s]."""
    made: dict[int, Bundle] = {}
    for robot in reversed(range(len(factory.robots))):
        if robot == 0 or kind_of(factory, robot)[0] != "tool":
            made[robot] = _Tour(factory, delays, filling, made).bundle(robot)
    return made[0]


@dataclass(frozen=True, slots=True)
class _Tour:
    """Makes bundles of single tours; `made`: those of the tours that deliver to them."""

    factory: Factory
    delays: Sequence[float]
    filling: Filling
    made: dict[int, Bundle]

    def bundle(self, robot: int) -> Bundle:
        """That of one tour. Those that deliver to it are dealt to the line that it waits for the
        least, to one more where it would wait too long."""
        factory, delays = self.factory, self.delays
        numbers = factory.robots[robot].operations
        work = sum(delays[number] for number in numbers)
        spare = min(self.filling.slack * work, max(self.filling.limit - work, 0.0))
        now, waited, locals_ = 0.0, 0.0, list[_Local]()
        for number in numbers:
            for kid in self._inserted(robot, number):
                wait, line = self._least(locals_, self.made[kid], delays[number], now)
                if line is None or waited + wait > spare + 1e-9:
                    locals_.append(_Local(self.made[kid], now + delays[number]))
                    continue
                waited, now = waited + wait, now + wait
                merged = line.bundle.merged(self.made[kid], self.filling.limit)
                assert merged is not None
                line.bundle, line.at = merged, now + delays[number]
            now += delays[number]
        first = tuple(self.made[kid] for kid in self._begins(robot))
        kind = kind_of(factory, robot) if robot else ("output",)
        sides = frozenset(sides_of(factory, robot)) if robot else frozenset({1})
        below = _overlaid((line.bundle for line in locals_), 0.0)
        return Bundle((robot,), now, kind, sides, below, first)

    def _least(
        self, lines: Sequence[_Local], kid: Bundle, delay: float, now: float
    ) -> tuple[float, _Local | None]:
        """How long a tour has to wait for a kid at the least [s], and on which line; None where it
        can be on none of them."""
        best, chosen = inf, None
        for line in lines:
            wait = max(0.0, line.at + kid.load - delay - now)
            if wait < best and line.bundle.merged(kid, self.filling.limit) is not None:
                best, chosen = wait, line
        return best, chosen

    def _inserted(self, robot: int, number: int) -> list[int]:
        """The robots that bring something to what a robot holds already."""
        operation = self.factory.operations[number]
        if operation.carrier != robot or operation.before[operation.template.carrier - 1] == NOPART:
            return []
        pairs = zip(operation.robots, operation.before, strict=True)
        return [guest for guest, label in pairs if guest != robot and label != NOPART]

    def _begins(self, robot: int) -> list[int]:
        return [guest for guest in begun_by(self.factory, robot) if guest in self.made]


def _overlaid(bundles: Iterable[Bundle], limit: float) -> tuple[Bundle, ...]:
    """Bundles, laid over each other as far as a limit of load allows [s]."""
    found: list[Bundle] = []
    for bundle in bundles:
        _lay_over(found, bundle, limit)
    return tuple(found)


__all__ = ["Bundle", "Filling", "bundled", "delivery"]
