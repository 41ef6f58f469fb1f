"""A monitor that does not trust the supervisor: from what can be observed in the engine alone it
finds out what each robot does and what holds each part, and judges the run against the net.

It sees positions, speeds, setpoints and active constraints; it never reads the supervisor, its
events or its marking. It works beside a run, or on a log (`factory.record.monitor.record`)."""

from factory.record.monitor.anatomy import Anatomy
from factory.record.monitor.monitor import EngineMonitor
from factory.record.monitor.report import Report
from factory.record.monitor.subject import MonitorSubject, subject_of, subject_of_run
from factory.record.observed import Observed


def beside(simulation: Observed) -> EngineMonitor:
    """A monitor that watches the engine of a simulation: `observe` is an observer of its run, and
    `glance` one that need not be called after every tick. Of the simulation it takes the engine,
    the layout, where it starts and when operations end, and nothing else that goes on."""
    m, d = simulation.world.m, simulation.world.d
    anatomy = Anatomy.of(m, simulation.layout.factory)
    monitor = EngineMonitor(subject_of_run(simulation), anatomy, m, d)
    simulation.world.hooks.ended.append(monitor.ended)
    return monitor


__all__ = ["MonitorSubject", "Report", "beside", "subject_of"]
