"""A monitor of a running engine."""

from __future__ import annotations

from time import perf_counter

from factory.api import MonitorSubject, Observation, Report, State
from factory.apps.monitor.agreement import Recorded
from factory.apps.monitor.anatomy import Anatomy
from factory.apps.monitor.monitor import KEPT, Monitor
from factory.support.collector import collector_paused

LOOK = 0.5
"""Interval of full observations of a monitor that does not observe every tick [s]; in between it
observes motion and grips where parts change hands."""


class EngineMonitor(Monitor):
    """A monitor of a running engine, an observer of the run from before its start, called also
    when operations end. Observations are judged KEPT at a time, which takes half as long as judging
    each between steps of the engine."""

    def __init__(self, subject: MonitorSubject, anatomy: Anatomy, first: Observation) -> None:
        super().__init__(subject, anatomy, first.kept())
        self._looked, self._welds = first.time, first.welds
        self._kept: list[tuple[Observation, bool]] = []

    def observe(self, state: State) -> None:
        """Observe the engine after a tick, or where operations have ended and parts have changed
        hands. Nothing else of the state is read."""
        begin = perf_counter()
        self._keep(state.observation)
        self.time_s += perf_counter() - begin

    def glance(self, state: State) -> None:
        """Observe the engine only where a weld has been switched, or LOOK seconds have passed."""
        begin, seen = perf_counter(), state.observation
        due = seen.time - self._looked >= LOOK
        if due or seen.welds is not self._welds:
            self._keep(seen, thorough=due)
        self.time_s += perf_counter() - begin

    def report(self, recorded: Recorded | None = None) -> Report:
        begin = perf_counter()
        self._judge_all()
        self.time_s += perf_counter() - begin
        return super().report(recorded)

    def _keep(self, seen: Observation, thorough: bool = True) -> None:
        self._welds = seen.welds
        if thorough and not seen.at_end:
            self._looked = seen.time
        self._kept.append((seen.kept(), thorough))
        if len(self._kept) >= KEPT:
            self._judge_all()

    @collector_paused()
    def _judge_all(self) -> None:
        for seen, thorough in self._kept:
            self.see(seen, thorough)
        self._kept.clear()
