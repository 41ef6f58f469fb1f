"""A monitor that is independent of the supervisor: from observations of the engine alone it
reconstructs the operation of each robot and the holder of each part, and compares them with the
net.

It observes positions, speeds, setpoints and active constraints, and never reads the supervisor, its
events or its marking. It works beside a run, or on a log (`factory.apps.monitor.record`)."""

from factory.api import MonitorSubject, Recordable, Report
from factory.apps.monitor.anatomy import Anatomy
from factory.apps.monitor.engine import EngineMonitor


def beside(simulation: Recordable) -> EngineMonitor:
    """A monitor of the engine of a simulation: `observe` is an observer of its run, and `glance`
    one that need not be called after every tick. It uses only the engine, the layout, the start of
    the simulation, and the times at which operations end."""
    subject = MonitorSubject.of_run(simulation)
    anatomy = Anatomy.of(simulation.engine, subject)
    first = simulation.state().observation
    monitor = EngineMonitor(subject, anatomy, first)
    simulation.at_ends.append(monitor.observe)
    return monitor


__all__ = ["MonitorSubject", "Report", "beside"]
