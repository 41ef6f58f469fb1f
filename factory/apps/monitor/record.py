"""The monitor on a log: judging a run that is over."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from factory.api import (
    Demand,
    Diagnostic,
    Factory,
    Failures,
    MonitorSubject,
    MonitorTable,
    Observation,
    Report,
    Run,
    RunVerdict,
    WeldFrames,
)
from factory.apps.log.model import model_of
from factory.apps.log.project_table import factory_of, of_its_factory, project_of, settings_of
from factory.apps.log.reader import Ends, Log
from factory.apps.monitor.agreement import contradictions
from factory.apps.monitor.anatomy import Anatomy
from factory.apps.monitor.calm import judge_calm
from factory.apps.monitor.monitor import Monitor
from factory.apps.monitor.recount import differences, recounted, worst
from factory.engine.record.findings import Violation
from factory.support.tables import value_of

JUMP = 3e-4
"""Tolerance of the displacement of a joint in a tick against its speeds [m]; correct logs stay
below a tenth of it."""

SPAN = 2_000
"""Number of ticks that are checked at once."""


def watch_log(log: Log) -> tuple[Report, MonitorSubject]:
    """The verdict on a recorded run, and its factory, compiled again from the log's header.

    The firings and markings of the log are checked, against the states and each other, only where
    the states have no violations. In a run with failures the states between these are checked
    (`calm`). Raises InputError (BadLog) for a log of the ideal world, or of another factory than
    that in its header.
    """
    m = model_of(log)
    with of_its_factory():
        subject = recorded_subject(log.header)
        if log.units is not None:
            subject = _on_demand(log, subject)
        if log.failures is not None and log.failures != Failures():
            report = judge_calm(log, subject, m, partial(observations, log))
        else:
            report = _seen(log, subject, m)
        if report.refines_net:
            violations = contradictions(subject, log.timed_entries, _markings(log))
            report = replace(report, violations=tuple(violations))
    return report, subject


def _seen(log: Log, subject: MonitorSubject, m: Any) -> Report:
    """The report of a monitor on the states of a log, and on its firings and figures."""
    seen, anatomy = observations(log), Anatomy.of(m, subject)
    monitor = Monitor(subject, anatomy, next(seen))
    for observation in seen:
        monitor.see(observation)
    report = monitor.report(log.events)
    counted = recounted(log, subject, anatomy, m, observations(log))
    wrong = [*jumps(log, m), *differences(log, counted, m)]
    return replace(report, violations=(*report.violations, *wrong), figures=counted)


def jumps(log: Log, m: Any) -> Iterator[Violation]:
    """The first tick in which the displacement of each slide joint is inconsistent with its speeds
    at both ends of the tick."""
    slides, reported = np.flatnonzero(m.jnt_type == WeldFrames.SLIDE), set[int]()
    at, moves = m.jnt_qposadr[slides], m.jnt_dofadr[slides]
    for first in range(0, len(log) - 1, SPAN):
        rows = range(first, min(first + SPAN + 1, len(log)))
        q = np.array([log.qpos[row][at] for row in rows])
        v = np.array([log.qvel[row][moves] for row in rows])
        spent = np.diff(log.time[rows.start : rows.stop])[:, None]
        gone = np.diff(q, axis=0) - spent * (v[1:] + v[:-1]) / 2
        off = np.abs(gone) - spent * np.abs(np.diff(v, axis=0)) / 2
        for joint in sorted({*np.flatnonzero((off > JUMP).any(axis=0)).tolist()} - reported):
            reported.add(joint)
            row = int((off[:, joint] > JUMP).argmax())
            name = m.joint(int(slides[joint])).name
            words = f"{name} jumps by {1e3 * abs(gone[row, joint]):.1f} mm within a tick"
            yield Violation(float(log.time[first + row + 1]), "", "", "Record", words)


def verdict_on(
    log: Log, factory: Factory, report: Report | None, faults: Sequence[Diagnostic] = ()
) -> RunVerdict:
    """The verdict on a recorded run of a factory, from its log, the report of a monitor on it where
    there is one, and the faults of its model."""
    cut, start = log.cut_off, frozenset(log.header["start"])
    refines = Run.is_refined(factory, log.entries, start)
    trouble = None if cut is None else cut.failure
    counted = report.figures if report else None
    figures = log.figures if counted is None else worst(log.figures, counted)
    verdict = RunVerdict.of(trouble, refines, figures, report, faults=faults)
    return verdict.caused_by(log.failures.unseen if log.failures else ())


def _markings(log: Log) -> Iterator[tuple[float, list[int]]]:
    """Each marking in a log that differs from the previous one, with its time [s]."""
    rows = log.marking.recorded().tolist()
    return ((float(log.time[row]), log.marking[row].tolist()) for row in rows)


def observations(log: Log, first: int = 0, last: int | None = None) -> Iterator[Observation]:
    """The observations in a log, in the order of time, from a row on, or in a log's rows from one
    up to another; `welds` is one array as long as none is switched."""
    welds = np.empty((0, 3), np.intp)
    for rows, row, at_end in _rows(log, first, last):
        assert rows.ctrl is not None
        active = rows.active[row]
        if not np.array_equal(active, welds):
            welds = active.astype(np.intp)
        state = rows.qpos[row], rows.qvel[row], rows.ctrl[row]
        yield Observation(float(rows.time[row]), *state, welds, at_end)


def _rows(log: Log, first: int, last: int | None) -> Iterator[tuple[Log | Ends, int, bool]]:
    """The rows of a log and of the ends of operations between them, and whether they are of those;
    without a last row, the ends after that too."""
    ends, ended = log.ends, 0
    if ends is not None and first:
        ended = int(np.searchsorted(ends.row, first, side="right"))
    for row in range(first, len(log) + 1 if last is None else last):
        while ends is not None and ended < len(ends.row) and ends.row[ended] == row:
            yield ends, ended, True
            ended += 1
        if row < len(log):
            yield log, row, False


def _on_demand(log: Log, subject: MonitorSubject) -> MonitorSubject:
    """The subject of a recorded run on demand, with its word. Raises ValueError where that is not
    what was ordered."""
    assert log.units is not None
    demand, header = value_of(Demand, log.header["demand"]), log.header
    *units, fixed = log.units
    sequence = subject.factory.sequence
    word = demand.word(sequence, header["units"], header["wip"], units, fixed)
    for number, product in enumerate(word.products(0, len(units))):
        if not demand.allows(number, product):
            raise ValueError(f"unit {number + 1} is a {product}, which was not the next order")
    return replace(subject, word=word, wip=None)


@of_its_factory()
def recorded_subject(header: Mapping[str, Any]) -> MonitorSubject:
    """The subject of a log. Raises InputError (BadLog) where its header has no factory."""
    factory, start = factory_of(header), frozenset(header["start"])
    table = value_of(MonitorTable, header["monitor"], "monitor")
    subject = table.subject(factory, settings_of(header), start, header["wip"])
    if "cell" in header:
        return replace(subject, chains=project_of(header, Path()).layout.chains)
    return subject
