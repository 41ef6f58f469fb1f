"""Consistency of the observed firings with some legal firing sequence.

The compiled net is a live marked graph: the k-th firing of a transition e needs, for each place
[d; e] with n initial tokens, the (k - n)-th firing of d, and nothing else. So each firing has an
interval of times, observations bound some of them, and there is a legal firing sequence if and only
if no interval is empty. All bounds follow from one pass forwards and one backwards.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from math import inf

from factory.api import MonitorSubject
from factory.engine.record.findings import Firing, Violation


@dataclass(slots=True)
class _Seen:
    """An observed firing: in [earliest, latest], observed at `t` [s] on a robot."""

    earliest: float
    latest: float
    t: float
    robot: str


@dataclass(slots=True)
class SeenFirings:
    """The observed firings, by transition and number (from 0, since m_0). `slack` [s]: tolerance of
    times."""

    subject: MonitorSubject
    slack: float
    seen: dict[tuple[int, int], _Seen] = field(default_factory=dict, repr=False)

    def saw(
        self, event: int, unit: int, earliest: float, latest: float, t: float, robot: str
    ) -> None:
        """Record that a transition fired for the `unit`-th time in [earliest, latest], observed on
        a robot at `t`."""
        if unit < self.subject.counts.get(event, 0):
            return
        old = self.seen.get((event, unit))
        if old is None or latest < old.latest:
            earliest = max(earliest, old.earliest if old else -inf)
            self.seen[event, unit] = _Seen(earliest, latest, t, robot)

    def solve(self, begin: float, end: float) -> tuple[list[Firing], list[Firing], list[Violation]]:
        """The observed firings, the inferred ones, and the violations. Linear in the firings."""
        solver = _Solver(self, begin, end)
        violations = solver.forward()
        solver.backward()
        seen, inferred = solver.firings()
        return seen, inferred, violations


class _Solver:
    """The intervals of all firings, observed and inferred."""

    def __init__(self, observed: SeenFirings, begin: float, end: float) -> None:
        self.observed, self.begin, self.end = observed, begin, end
        subject = observed.subject
        factory, counts = subject.factory, subject.counts
        self.net = subject.net
        self.names = [t.name for t in factory.net.threaded.transitions]
        self.dwell = {
            int(o.place): max(0.0, o.dwell - observed.slack) for o in factory.operations if o.dwell
        }
        self.done = [counts.get(e, 0) for e in range(len(self.names))]
        self.count = self._counts()
        self.order = self._order()
        self.low: dict[tuple[int, int], float] = {}
        self.high: dict[tuple[int, int], float] = {}

    def _counts(self) -> list[int]:
        """Least number of firings of each transition, since m_0."""
        count = list(self.done)
        for event, unit in self.observed.seen:
            count[event] = max(count[event], unit + 1)
        waiting = deque(range(len(count)))
        queued = [True] * len(count)
        while waiting:
            event = waiting.popleft()
            queued[event] = False
            for before, tokens, _ in self._needs(event):
                if count[before] < count[event] - tokens:
                    count[before] = count[event] - tokens
                    if not queued[before]:
                        queued[before] = True
                        waiting.append(before)
        return count

    def _needs(self, event: int) -> list[tuple[int, int, int]]:
        """The places of a transition's preset: producer, initial tokens, place."""
        net = self.net
        return [(net.left[p], net.tokens[p], p) for p in net.net.preset[event]]

    def _weight(self, place: int, unit: int) -> float:
        """The least time between the two firings around a place in a unit [s]."""
        subject, dwell = self.observed.subject, self.dwell.get(place, 0.0)
        return dwell if dwell and subject.is_made(subject.factory.operations[place], unit) else 0.0

    def _order(self) -> list[tuple[int, int]]:
        """All firings, each after its preconditions."""
        order = self.net.token_free.order
        first, last = min(self.done), max(self.count)
        return [
            (event, unit)
            for unit in range(first, last)
            for event in order
            if self.done[event] <= unit < self.count[event]
        ]

    def forward(self) -> list[Violation]:
        """The earliest time of every firing; a firing observed before it is a violation, and counts
        as observed afterwards, so that one fault gives one violation."""
        violations, subject = [], self.observed.subject
        seen_when_over = {
            int(o.end): o for o in subject.factory.operations if subject.moves_parts[o.index]
        }
        for event, unit in self.order:
            early, cause = self.begin, -1
            for before, tokens, place in self._needs(event):
                ready = self.low.get((before, unit - tokens), -inf) + self._weight(place, unit)
                if ready > early:
                    early, cause = ready, before
            noted = self.observed.seen.get((event, unit))
            if noted is None:
                over = seen_when_over.get(event)
                late = over is not None and subject.is_made(over, unit)
                self.low[event, unit] = self.end if late else min(early, self.end)
                continue
            if early > noted.latest + self.observed.slack:
                violations.append(self._violation(event, unit, noted, cause, early))
                early = noted.earliest
            self.low[event, unit] = min(max(early, noted.earliest), noted.latest)
        return violations

    def _violation(
        self, event: int, unit: int, noted: _Seen, cause: int, early: float
    ) -> Violation:
        operation = self.observed.subject.factory.operation_of(event)
        name, other = self.names[event], self.names[cause]
        never = f"{other} must come first, and was not observed"
        why = f"could not fire before {early:.3f} s, since {other} must come first"
        words = f"{name} was observed at {noted.t:.3f} s in unit {unit}, but "
        words += never if early >= self.end else why
        at = operation.position
        return Violation(noted.t, noted.robot, operation.label, "Order", words, at)

    def backward(self) -> None:
        """The latest time of every firing."""
        for event, unit in self.order:
            noted = self.observed.seen.get((event, unit))
            self.high[event, unit] = noted.latest if noted else self.end
        for event, unit in reversed(self.order):
            latest = self.high[event, unit]
            for before, tokens, place in self._needs(event):
                key = before, unit - tokens
                if key in self.high:
                    bound = latest - self._weight(place, unit)
                    self.high[key] = max(min(self.high[key], bound), self.low[key])

    def firings(self) -> tuple[list[Firing], list[Firing]]:
        """All firings, in the order of time."""
        seen, inferred = [], []
        for event, unit in self.order:
            noted = self.observed.seen.get((event, unit))
            name, low, high = self.names[event], self.low[event, unit], self.high[event, unit]
            if noted is None:
                inferred.append(Firing(name, unit, low, high))
            else:
                seen.append(Firing(name, unit, low, high, noted.t))
        seen.sort(key=lambda f: (f.seen, f.latest))
        inferred.sort(key=lambda f: f.latest)
        return seen, inferred
