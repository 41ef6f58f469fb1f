"""The monitor on a log: judging a run that is over."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from factory.record.log.header import settings_of
from factory.record.log.model import model_of
from factory.record.log.reader import Log
from factory.record.log.recompiled import factory_of
from factory.record.monitor.anatomy import Anatomy
from factory.record.monitor.monitor import Monitor
from factory.record.monitor.observation import Observation
from factory.record.monitor.report import Report
from factory.record.monitor.subject import MonitorSubject, subject_from
from factory.support.errors import Diagnostic, InputError

AGAIN = "record it again: `factory run FILE.pag --log OUT`"


def watch_log(log: Log) -> tuple[Report, MonitorSubject]:
    """The verdict on a recorded run, and its factory, compiled again from the log's header.

    The log's events and markings are not read. Raises InputError (BadLog) for a log of the ideal
    world, of an older version, or of another factory than its header says.
    """
    if not log.xml:
        raise InputError(
            _bad("the log is of the ideal world, in which there is nothing to observe")
        )
    if log.ctrl is None or "monitor" not in log.header:
        raise InputError(_bad("the log was kept by an older version, without setpoints"))
    if not len(log):
        raise InputError(_bad("the log has no tick"))
    try:
        subject = recorded_subject(log.header)
        anatomy, seen = Anatomy.of(model_of(log, AGAIN), subject.factory), observations(log)
        monitor = Monitor(subject, anatomy, next(seen))
        for observation in seen:
            monitor.see(observation)
    except (ValueError, KeyError, TypeError, AttributeError, IndexError) as error:
        raise InputError(_bad(f"the log is not of the factory in its header: {error}")) from error
    return monitor.report(), subject


def observations(log: Log) -> Iterator[Observation]:
    """The observations in a log, row by row; `welds` is one array as long as none is switched."""
    assert log.ctrl is not None
    welds = np.empty((0, 3), np.intp)
    span = (-1, -1)
    for row in range(len(log)):
        now = int(log.active.starts[row]), int(log.active.ends[row])
        if now != span:
            found, span = log.active[row].astype(np.intp), now
            if not np.array_equal(found, welds):
                welds = found
        yield Observation(float(log.time[row]), log.qpos[row], log.qvel[row], log.ctrl[row], welds)


def recorded_subject(header: Mapping[str, Any]) -> MonitorSubject:
    """The factory that a log is of. Raises ValueError, KeyError, TypeError or AttributeError where
    the header is of none."""
    factory = factory_of(header)
    kept, start, wip = header["monitor"], header["start"], header["wip"]
    return subject_from(factory, kept, settings_of(header), start, wip)


def _bad(words: str) -> Diagnostic:
    return Diagnostic("BadLog", words, None, AGAIN)
