"""A monitor that is independent of the supervisor: from observations of the engine alone it
reconstructs the operation of each robot and the holder of each part, and compares them with the
net.

It observes positions, speeds, setpoints and active constraints, and never reads the supervisor, its
events or its marking. It works beside a run, or on a log (`factory.record.monitor.record`)."""

from factory.record.monitor.anatomy import Anatomy
from factory.record.monitor.monitor import EngineMonitor
from factory.record.monitor.report import Report
from factory.record.monitor.subject import MonitorSubject, subject_of, subject_of_run
from factory.record.observed import Observed


def beside(simulation: Observed) -> EngineMonitor:
    """A monitor of the engine of a simulation: `observe` is an observer of its run, and `glance`
    one that need not be called after every tick. It uses only the engine, the layout, the start of
    the simulation, and the times at which operations end."""
    m, d = simulation.world.m, simulation.world.d
    anatomy = Anatomy.of(m, simulation.layout.factory)
    monitor = EngineMonitor(subject_of_run(simulation), anatomy, m, d)
    simulation.world.hooks.ended.append(monitor.ended)
    return monitor


__all__ = ["MonitorSubject", "Report", "beside", "subject_of"]
