"""The monitor on a log: judging a run that is over."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from factory.record.log.header import settings_of
from factory.record.log.model import model_of
from factory.record.log.reader import Log
from factory.record.log.recompiled import AGAIN, factory_of, of_its_factory
from factory.record.monitor.anatomy import Anatomy
from factory.record.monitor.monitor import Monitor
from factory.record.monitor.observation import Observation
from factory.record.monitor.report import Report
from factory.record.monitor.subject import MonitorSubject, subject_from
from factory.support.errors import Diagnostic, InputError


def watch_log(log: Log) -> tuple[Report, MonitorSubject]:
    """The verdict on a recorded run, and its factory, compiled again from the log's header.

    The log's events and markings are not read. Raises InputError (BadLog) for a log of the ideal
    world, of an older version, or of another factory than its header says.
    """
    m = model_of(log)
    if log.ctrl is None or "monitor" not in log.header:
        message = "the log was kept by an older version, without setpoints"
        raise InputError(Diagnostic("BadLog", message, None, AGAIN))
    with of_its_factory():
        subject = recorded_subject(log.header)
        seen = observations(log)
        monitor = Monitor(subject, Anatomy.of(m, subject.factory), next(seen))
        for observation in seen:
            monitor.see(observation)
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


@of_its_factory()
def recorded_subject(header: Mapping[str, Any]) -> MonitorSubject:
    """The factory that a log is of. Raises InputError (BadLog) where the header is of none."""
    factory = factory_of(header)
    kept, start, wip = header["monitor"], header["start"], header["wip"]
    return subject_from(factory, kept, settings_of(header), start, wip)
