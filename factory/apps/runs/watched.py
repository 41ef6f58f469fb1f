"""A run with a monitor, which judges whether the bodies do what the record says."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from factory.api import Observer, Run, Simulation
from factory.apps.monitor import beside


def watched(
    simulation: Simulation,
    observers: Sequence[Observer] = (),
    max_time: float | None = None,
    glances: Sequence[Observer] = (),
    since: float = 0.0,
    every_tick: bool = False,
) -> Run:
    """`simulation.run`, with a monitor where there are bodies. It looks where operations end, where
    a weld is switched, and at times; with `every_tick` after every tick, and so it does where
    robots run their own programs, which stop within ticks. A run that goes on where something fails
    has none: states alone do not tell what was undone, and its log is judged (`monitor.calm`).
    """
    if simulation.model is None or simulation.request.recovers:
        return simulation.run(observers, max_time, glances, since)
    monitor = beside(simulation)
    if every_tick:
        observers, since = [monitor.observe, *observers], 0.0
    else:
        look = monitor.observe if simulation.request.distributed else monitor.glance
        glances = [look, *glances]
    run = simulation.run(observers, max_time, glances, since)
    return replace(run, monitor=monitor.report(run.lasting))
