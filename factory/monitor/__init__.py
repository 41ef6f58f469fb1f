"""A monitor that does not trust the supervisor: from what can be observed in the engine alone it
finds out what each robot does and who carries each part, and judges the run against the net.

It sees positions, speeds, setpoints and active constraints; it never reads the supervisor, its
events or its marking. It works beside a run, or on a log (`factory.monitor.record`)."""

from factory.monitor.anatomy import Anatomy
from factory.monitor.monitor import Monitor
from factory.monitor.report import Firing, Report, Violation
from factory.monitor.sight import Sight
from factory.monitor.subject import Subject, subject_of

__all__ = [
    "Anatomy",
    "Firing",
    "Monitor",
    "Report",
    "Sight",
    "Subject",
    "Violation",
    "subject_of",
]
