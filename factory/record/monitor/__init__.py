"""A monitor that does not trust the supervisor: from what can be observed in the engine alone it
finds out what each robot does and who carries each part, and judges the run against the net.

It sees positions, speeds, setpoints and active constraints; it never reads the supervisor, its
events or its marking. It works beside a run, or on a log (`factory.record.monitor.record`)."""

from typing import Any

from factory.record.monitor.anatomy import Anatomy
from factory.record.monitor.monitor import Monitor
from factory.record.monitor.observation import Sight
from factory.record.monitor.report import Firing, Report, Violation
from factory.record.monitor.subject import Subject, subject_of, subject_of_run


def beside(simulation: Any) -> Monitor:
    """A monitor that watches the engine of a simulation; it is an observer of its run. Of the
    simulation it takes the engine, the layout and where it starts, and nothing that goes on."""
    subject = subject_of_run(simulation)
    m, d = simulation.world.m, simulation.world.d
    monitor = Monitor(subject, Anatomy.of(m, simulation.layout.factory))
    monitor.watch(m, d)
    return monitor


__all__ = [
    "Anatomy",
    "Firing",
    "Monitor",
    "Report",
    "Sight",
    "Subject",
    "Violation",
    "beside",
    "subject_of",
    "subject_of_run",
]
