"""The timed net of a factory in which operations fail: when its products come then.

A transition fires as soon as every place before it has a token that is ready; the events are
taken in the order of time. Where an operation fails at its end, transitions are undone as
`factory.nets.undo` says, the robots go back, and all goes on from there. Robots that could touch
what was lost stand until it is cleared away. Where nothing fails the dates are those of
`earliest_firings`.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from heapq import heappop, heappush
from random import Random
from types import MappingProxyType

from factory.nets.marked import MarkedNet
from factory.nets.undo import times_undone, undo
from factory.nets.undone import Joins
from factory.plant.factory import Factory, Operation
from factory.plant.material import joins_of
from factory.problem.template import Kind

SCRAPS = 20
"""So many scraps of one operation on end stop the run: something else is wrong."""


@dataclass(frozen=True, slots=True)
class Rates:
    """How likely each attempt at each operation is not good (`redo`), and how likely one of the
    things that it brings, or the part that it takes, is lost (`lose`). Raises ValueError where they
    are no shares, or leave nothing that succeeds."""

    redo: float = 0.0
    lose: float = 0.0

    def __post_init__(self) -> None:
        if not (self.redo >= 0 and self.lose >= 0 and self.redo + self.lose < 1):
            raise ValueError("rates are shares, not negative, of less than 1 together")


@dataclass(frozen=True, slots=True)
class Mishap:
    """A failed attempt: the labels that are `lost`; () where it is only not good."""

    lost: tuple[str, ...] = ()


Chance = Callable[[Operation, int], Mishap | None]
"""What happens at the end of an operation that has ended so many times."""


def drawn(rates: Rates, seed: int) -> Chance:
    """Mishaps drawn at random, each for itself; of several inputs each is as likely to be lost."""
    random = Random(seed)

    def chance(operation: Operation, _: int) -> Mishap | None:
        draw = random.random()
        if draw < rates.redo:
            return Mishap()
        if draw < rates.redo + rates.lose:
            return Mishap((random.choice(operation.inputs or (operation.label,)),))
        return None

    return chance


Near = Callable[[Operation, str, float], frozenset[int]]
"""The robots (index) that could touch a label that is lost in an operation, after a share of its
time, from 0 to 1."""


@dataclass(frozen=True, slots=True)
class Clearing:
    """What is lost lies for so many `seconds`, and the robots that are `near` stand so long; in
    what share of its operation it was lost is drawn by the `seed`."""

    near: Near = field(repr=False)
    seconds: float
    seed: int = 0


@dataclass(frozen=True)
class FailingNet:
    """A live timed marked graph whose first places and transitions are those of a factory, with the
    `seconds` of each place, and `first` and `ready` as `earliest_firings` has them. `back`: how
    long the robots of each operation take to where they came from [s]; `ways`: the places of their
    ways ahead, by robot and operation; `clearing` of what is lost."""

    factory: Factory
    net: MarkedNet
    seconds: Sequence[float] = field(repr=False)
    back: Sequence[float] = field(repr=False)
    first: Mapping[int, float] = field(default_factory=lambda: MappingProxyType({}), repr=False)
    ready: Mapping[int, float] = field(default_factory=lambda: MappingProxyType({}), repr=False)
    ways: Mapping[tuple[int, int], int] = field(
        default_factory=lambda: MappingProxyType({}), repr=False
    )
    clearing: Clearing | None = None

    @cached_property
    def places(self) -> Mapping[int, frozenset[int]]:
        """The robots (index) whose tokens each place holds, of those that hold any."""
        own = {p: frozenset(robots) for p, robots in enumerate(self.factory.net.slots)}
        return own | {place: frozenset({robot}) for (robot, _), place in self.ways.items()}

    @cached_property
    def joins(self) -> Joins:
        """What is undone with each end."""
        return joins_of(self.factory)


@dataclass(frozen=True)
class FailingRun:
    """`dates`: when each product was dropped off [s]; how often each operation was done again and
    ended in a scrap, by its number; `undone`: how often each transition was undone; `stopped`: the
    label of the operation at which the run stopped, "" where all units were made."""

    dates: tuple[float, ...] = field(repr=False)
    redone: Mapping[int, int]
    scrapped: Mapping[int, int]
    undone: Mapping[int, int]
    stopped: str = ""


def failing_run(subject: FailingNet, chance: Chance, units: int) -> FailingRun:
    """The firings until so many units are dropped off or the run stops.

    What is done about a mishap is what the operation's template says of `lost`, or of the test that
    it answers with `again`; without such a test an attempt that is not good is repeated, and the
    run stops when SCRAPS on end are not. Raises ValueError where an undo leads to no marking
    (`checked`).
    """
    return _Run(subject, chance).until(units)


def asked_by(factory: Factory, operation: Operation, lost: Sequence[str]) -> dict[int, int]:
    """The transitions to be undone, once each, before an operation's end fires: its start where
    nothing is lost, or the part that it takes; else the ends that made what is lost."""
    made = {factory.by_label[label].end: 1 for label in lost if label in operation.inputs}
    return made or {operation.start: 1}


def checked(net: MarkedNet, before: Sequence[int], after: Sequence[int], rules: Joins) -> None:
    """Raises ValueError where counts that some transitions are undone to lead to no marking, or
    take something apart."""
    for event, times in times_undone(before, after).items():
        for place in (*net.net.preset[event], *net.net.postset[event]):
            held = net.tokens[place] + after[net.left[place]] - after[net.right[place]]
            if held < 0:
                name = net.net.places[place].name
                raise ValueError(f"the undo leaves {held} tokens on {name}")
        for made in rules.get(event, ()):
            if before[made] - after[made] < times:
                name = net.net.transitions[made].name
                raise ValueError(f"the undo keeps {name}, of which the product is gone")


class _Standing:
    """Until when robots (index) stand."""

    def __init__(self, clearing: Clearing | None) -> None:
        self._clearing, self._until = clearing, dict[int, float]()
        self._random = Random(clearing.seed if clearing else 0)

    def drawn(
        self, operation: Operation, lost: Iterable[str]
    ) -> Iterator[tuple[frozenset[int], float]]:
        """The robots that stand for each thing that is lost in an operation, and how long [s]."""
        if clearing := self._clearing:
            for label in lost:
                share = self._random.random()
                yield clearing.near(operation, label, share), clearing.seconds

    def lengthen(self, robots: Iterable[int], until: float) -> None:
        """Robots stand until then [s], if not longer."""
        for robot in robots:
            self._until[robot] = max(until, self._until.get(robot, 0.0))

    def over(self, robots: Iterable[int], now: float) -> float:
        """Until when some of these robots stand; `now` where none does [s]."""
        return max([now, *(self._until.get(robot, now) for robot in robots)])


class _Run:
    """A run under way: how often each transition has fired, and when each token is ready."""

    def __init__(self, subject: FailingNet, chance: Chance) -> None:
        net = subject.net
        self.subject, self.chance = subject, chance
        self.fired = [0] * len(net.net.transitions)
        self.tokens = [
            deque([float(subject.ready.get(p, 0.0))] * count) for p, count in enumerate(net.tokens)
        ]
        self.stamps = [0] * len(self.fired)
        self.queue: list[tuple[float, int, int]] = []
        self.failed: dict[int, int] = {}
        self.lost: dict[int, int] = {}
        self.redone: dict[int, int] = {}
        self.scrapped: dict[int, int] = {}
        self.undone: dict[int, int] = {}
        self.standing = _Standing(subject.clearing)

    def until(self, units: int) -> FailingRun:
        """Fire until so many products are dropped off."""
        operations, dates = self.subject.factory.operations, list[float]()
        drops = {o.end for o in self.subject.factory.dropoffs}
        stopped = ""
        for event in range(len(self.fired)):
            self.schedule(event)
        while len(dates) < units and not stopped:
            now, event, stamp = heappop(self.queue)
            if stamp != self.stamps[event]:
                continue
            operation = operations[event // 2] if event % 2 else None
            mishap = operation and self.chance(operation, self.fired[event])
            if operation and mishap:
                if self.fails(operation, mishap, now) == "stop":
                    stopped = operation.label
                continue
            self.fire(event, now)
            if operation:
                self.failed.pop(operation.index, None)
                self.lost.pop(operation.index, None)
            if event in drops:
                dates.append(now)
        return FailingRun(tuple(dates), self.redone, self.scrapped, self.undone, stopped)

    def schedule(self, event: int) -> None:
        """Let a transition fire when all that it needs is ready, if it is there."""
        self.stamps[event] += 1
        before = [self.tokens[p] for p in self.subject.net.net.preset[event]]
        if all(before):
            when = max(tokens[0] for tokens in before)
            heappush(self.queue, (when, event, self.stamps[event]))

    def fire(self, event: int, now: float) -> None:
        subject, fired = self.subject, self.fired
        for place in subject.net.net.preset[event]:
            self.tokens[place].popleft()
        first = subject.first if not fired[event] else {}
        fired[event] += 1
        for place in subject.net.net.postset[event]:
            taken = float(first.get(place, subject.seconds[place]))
            self.tokens[place].append(now + taken)
            if len(self.tokens[place]) == 1 and subject.net.right[place] != event:
                self.schedule(subject.net.right[place])
        self.schedule(event)

    def fails(self, operation: Operation, mishap: Mishap, now: float) -> Kind:
        """Do what the template says about a mishap; what that was."""
        number, lost = operation.index, mishap.lost
        self.failed[number] = self.failed.get(number, 0) + (not lost)
        kind = _response(operation, mishap, self.failed[number])
        if kind == "scrap":
            self.failed[number] = 0
            self.lost[number] = self.lost.get(number, 0) + 1
            if self.lost[number] >= SCRAPS:
                kind = "stop"
        if kind == "stop":
            return kind
        counts = self.redone if kind == "again" else self.scrapped
        counts[number] = counts.get(number, 0) + 1
        inputs = lost or operation.inputs if kind == "scrap" else ()
        self.go_back(asked_by(self.subject.factory, operation, inputs), now)
        for near, seconds in self.standing.drawn(operation, lost):
            self.stand(near, now, now + seconds)
        return kind

    def stand(self, robots: frozenset[int], now: float, until: float) -> None:
        """Robots stand from now on: what they are doing, or would do, takes so much longer."""
        later = set[int]()
        for place, own in self.subject.places.items():
            if self.tokens[place] and not robots.isdisjoint(own):
                begin = self.standing.over(own, now)
                shift = max(until - begin, 0.0)
                ready = (max(token, begin) + shift for token in self.tokens[place])
                self.tokens[place] = deque(ready)
                later.add(self.subject.net.right[place])
        self.standing.lengthen(robots, until)
        for event in sorted(later):
            self.schedule(event)

    def go_back(self, asked: Mapping[int, int], now: float) -> None:
        """Undo transitions: their tokens are back when the robots are."""
        subject, net = self.subject, self.subject.net
        left = undo(net, self.fired, asked, subject.joins)
        checked(net, self.fired, left, subject.joins)
        gone = times_undone(self.fired, left)
        for event, times in gone.items():
            self.undone[event] = self.undone.get(event, 0) + times
        longest = {r: 0.0 for event in gone for r in self._robots(event)}
        for event in gone:
            for robot in self._robots(event):
                longest[robot] = max(longest[robot], subject.back[event // 2])
        slots = subject.factory.net.slots
        near = {p for e in gone for p in (*net.net.preset[e], *net.net.postset[e])}
        for place in sorted(near):
            own = slots[place] if place < len(slots) else tuple(longest)
            wait = max((longest.get(robot, 0.0) for robot in own), default=0.0)
            self._set(place, gone, self.standing.over(subject.places.get(place, ()), now) + wait)
        self.fired = list(left)
        for event in sorted({net.right[p] for p in near}):
            self.schedule(event)

    def _robots(self, event: int) -> tuple[int, ...]:
        return self.subject.factory.operations[event // 2].robots

    def _set(self, place: int, gone: Mapping[int, int], ready: float) -> None:
        """Take from a place what its undone producer had put there, the last first, and give back
        what its undone consumer had taken."""
        net, tokens = self.subject.net, self.tokens[place]
        made, taken = gone.get(net.left[place], 0), gone.get(net.right[place], 0)
        for _ in range(made - taken):
            tokens.pop()
        for _ in range(taken - made):
            tokens.appendleft(ready)


def _response(operation: Operation, mishap: Mishap, times: int) -> Kind:
    """What is done where an operation has failed so many times on end, or something is lost."""
    template = operation.template
    if mishap.lost:
        failure = template.failure("lost")
        return failure.last if failure else "stop"
    answer = next((failure for failure in template.failures if failure.retries), None)
    if answer is None:
        return "again" if times < SCRAPS else "stop"
    return "again" if times <= answer.retries else answer.last
