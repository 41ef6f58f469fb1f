"""The monitor on a log with failures: it judges the spells between them.

States do not show undos, so each *spell* of a run is judged by itself, from the marking in which it
begins. A spell excludes the time from the beginning of a failed operation until every robot that
was sent back has fired again, no part lies about, and no robot stands still. That an undo is the
least possible is checked separately, from the record (`factory.engine.record.replay`).
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import replace
from itertools import islice
from typing import Any

import numpy as np

from factory.api import Factory, Marking, MonitorSubject, Observation, Report, names
from factory.apps.log.reader import Log
from factory.apps.monitor.agreement import ROUNDING
from factory.apps.monitor.anatomy import Anatomy
from factory.apps.monitor.monitor import MOST, Monitor
from factory.engine.record.findings import Firing

SHORT = 0.2
"""Shorter spells are not judged [s]."""

FELT = 1.0
"""Assumed delay of the detection of a failure [s]; it began with its operation if that is
earlier."""

Span = tuple[float, float]


Seen = Callable[[int, int], Iterator[Observation]]
"""The observations from one row of a log up to another."""


def judge_calm(log: Log, subject: MonitorSubject, m: Any, seen: Seen) -> Report:
    """The combined verdict of monitors on the spells of a run, from its observations."""
    rows, times, units = [], log.time, _Units(log, subject)
    for begin, end in spells(log, subject.factory, m):
        first, last = (int(np.searchsorted(times, t - ROUNDING)) for t in (begin, end))
        if last - first > 1 and times[last - 1] - times[first] >= SHORT:
            rows.append((first, last))
    reports = [_judged(log, subject, m, seen, units, span) for span in rows]
    return Report(
        tuple(firing for report in reports for firing in report.seen),
        tuple(firing for report in reports for firing in report.inferred),
        tuple(violation for report in reports for violation in report.violations)[:MOST],
        sum(report.time_s for report in reports),
        sum(float(times[last - 1] - times[first]) for first, last in rows),
    )


def _judged(
    log: Log,
    subject: MonitorSubject,
    m: Any,
    seen: Seen,
    units: _Units,
    span: tuple[int, int],
) -> Report:
    begin, end = (float(log.time[row]) for row in (span[0], span[1] - 1))
    inside = seen(*span)
    start: Marking = frozenset(log.marking[span[0]].tolist())
    here = replace(subject, start=start, wip=None)
    offset = units.more(here, begin)
    if subject.word is not None:
        here = replace(here, word=subject.word.later(offset))
    monitor = Monitor(here, Anatomy.of(m, subject), next(inside))
    monitor.motion.came[:] = -np.inf  # whoever is there may have come long ago
    for observation in inside:
        monitor.see(observation)
    first, last = np.searchsorted(log.fired_t, [begin - ROUNDING, end - ROUNDING]).tolist()
    report = monitor.report(log.events[first:last])

    def counted(firings: Sequence[Firing]) -> tuple[Firing, ...]:
        return tuple(replace(firing, unit=firing.unit + offset) for firing in firings)

    return replace(report, seen=counted(report.seen), inferred=counted(report.inferred))


class _Units:
    """Number of units begun over time, from the record of a run: the first transition fires once
    for each."""

    def __init__(self, log: Log, subject: MonitorSubject) -> None:
        first = subject.factory.net.threaded.transitions[0].name
        self._times, self._begun = list[float](), [subject.counts.get(0, 0)]
        for t, entry in log.timed_entries:
            more = (entry == first) if isinstance(entry, str) else -entry.transitions.count(first)
            if more:
                self._times.append(t)
                self._begun.append(self._begun[-1] + more)

    def more(self, subject: MonitorSubject, begin: float) -> int:
        """Number of units begun before a spell [s], less that counted from its first marking."""
        at = bisect_left(self._times, begin - ROUNDING)
        return self._begun[at] - subject.counts.get(0, 0)


def spells(log: Log, factory: Factory, m: Any) -> Iterator[Span]:
    """The intervals without failure or recovery [s], in order."""
    troubles, now = sorted(_troubles(log, factory, m)), 0.0
    for begin, end in troubles:
        if begin > now:
            yield now, begin
        now = max(now, end)
    if now < float(log.time[-1]):
        yield now, float(log.time[-1]) + ROUNDING


def _troubles(log: Log, factory: Factory, m: Any) -> Iterator[Span]:
    """The intervals of failures and recoveries [s]."""
    end = float(log.time[-1])
    by_robot = {robot.name: robot.index for robot in factory.robots}
    number = factory.net.threaded.net.transition_index
    for _, undone in log.undone:
        back = {factory.operation_of(number[name]) for name in undone.transitions}
        robots = {robot for operation in back for robot in operation.robots}
        yield _since(log, undone.t, undone.operation), _gone_on(log, factory, robots, undone.t, end)
    failures = log.failures
    for failing in failures.found if failures else ():
        t = failing.t
        robots = {*factory.by_label[failing.operation].robots}
        robots |= {by_robot[failing.robot]} if failing.robot else set()
        until = _gone_on(log, factory, robots, t, end)
        yield _since(log, t, failing.operation), max(until, min(failing.until or 0.0, end))
    stood = failures.stood if failures else ()
    for place, (t, names_) in enumerate(stood):
        if names_:
            until = stood[place + 1][0] if place + 1 < len(stood) else end
            yield t - FELT, _gone_on(log, factory, {by_robot[r] for r in names_}, until, end)
    yield from _lying(log, m)


def _since(log: Log, t: float, label: str) -> float:
    """Beginning of a failure detected at t [s]: the last firing of its operation before, so that
    the part in a feeder is excluded from its presentation on."""
    transitions = (f"{label}_s", f"{label}_e")
    before = reversed(log.events[: int(np.searchsorted(log.fired_t, t))])
    return (
        min(t - FELT, next((when for when, name in before if name in transitions), 0.0)) - ROUNDING
    )


def _gone_on(log: Log, factory: Factory, robots: Collection[int], t: float, end: float) -> float:
    """Time at which each of the robots has fired again after t [s]."""
    number, left = factory.net.threaded.net.transition_index, set(robots)
    for when, name in islice(log.events, int(np.searchsorted(log.fired_t, t, "right")), None):
        left -= {*factory.operation_of(number[name]).robots}
        if not left:
            return when + FELT
    return end + FELT


def _lying(log: Log, m: Any) -> Iterator[Span]:
    """The intervals in which some part is not held [s]."""
    parts = {b for b in range(m.nbody) if names.kind(m.body(b).name) == "part" and m.body_dofnum[b]}
    for row in range(len(log)):
        if not parts <= {*log.active[row][:, 2].tolist()}:
            yield float(log.time[row]) - FELT, float(log.time[row]) + FELT
