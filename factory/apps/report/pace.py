"""The pace of a recorded run, as measured by its events and, where there is a layout, as the timed
net predicts it; and its fidelity: the figures of its bodies, and its tracking errors."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from factory.api import Event, Run, RunVerdict, Timing, Undone, names
from factory.apps.analyze.measured import conditions, dropoff_times, operation_times
from factory.apps.analyze.timed import flow, timed_net
from factory.apps.monitor.recount import worst
from factory.apps.report.recording import Recording


def fidelity(recording: Recording) -> dict[str, float | None]:
    """The figures of a recording, by the keys of their definitions: for each the greater of what
    the log holds and what its monitor recomputes."""
    monitor, figures = recording.monitor, recording.log.figures or {}
    if monitor is not None and monitor.figures is not None:
        figures = worst(figures, monitor.figures)
    return {
        "monitor_violations": None if monitor is None else float(len(monitor.violations)),
        **{key: figures.get(key) for key in RunVerdict.MEASURED},
        "tracking_error_max_mm": _tracking(recording),
    }


def excluded(recording: Recording) -> tuple[tuple[str, str], ...]:
    """The pairs of parts that are excluded from contact in the recorded model."""
    m = recording.motion.m
    pairs = (names.excluded(m.exclude(i).name) for i in range(m.nexclude))
    return tuple(dict.fromkeys(pairs))


def _tracking(recording: Recording) -> float | None:
    """Largest distance of an axis from its setpoint at the end of a tick [mm]."""
    log, m = recording.log, recording.motion.m
    if log.ctrl is None:
        return None
    joint, setpoint = m.jnt_qposadr[m.actuator_trnid[:, 0]], m.actuator_ctrladr
    rows = (log.qpos[row][joint] - log.ctrl[row][setpoint] for row in range(len(log)))
    return 1e3 * max(float(np.abs(error).max(initial=0.0)) for error in rows)


@dataclass(frozen=True)
class MeasuredPace:
    """Of a run, in seconds: when each product left (`dropoffs`), the mean interval between the last
    half of them (None below 4); for each operation its mean duration (None where it never ended),
    the first time left out where there are others; for each robot the share of the run it was in
    operations."""

    dropoffs: tuple[float, ...]
    cycle: float | None
    durations: tuple[float | None, ...] = field(repr=False)
    busy: tuple[float, ...] = field(repr=False)
    gears: tuple[float, ...] = field(repr=False)

    @property
    def critical(self) -> int:
        """The robot (index) whose operations together take longest: the critical gear."""
        return int(np.argmax(self.gears))


def measured(recording: Recording) -> MeasuredPace:
    """The pace by the events of a log."""
    log, factory = recording.log, recording.factory
    number = factory.net.threaded.net.transition_index
    spent = operation_times(factory, ((number[name], t) for t, name in log.lasting))
    counted = [times[1:] or times for times in spent]
    durations = [sum(times) / len(times) if times else None for times in counted]
    dropoffs = dropoff_times(log.time, log.delivered)
    gears = [sum(durations[o] or 0.0 for o in robot.operations) for robot in factory.robots]
    events = (e if isinstance(e, Undone) else Event(t, e) for t, e in log.timed_entries)
    busy, total = Run.busy_times(factory, events), recording.end
    return MeasuredPace(
        dropoffs,
        Run.mean_interval(dropoffs, factory.period),
        tuple(durations),
        tuple(spent / (total or 1.0) for spent in busy),
        tuple(gears),
    )


@dataclass(frozen=True)
class Predicted:
    """In seconds: the cycle time in the long run, the first product and the last of as many as the
    run made (None where it began in the middle); the duration of each operation; the share of the
    time until then that each robot is in operations. `critical`: what sets the pace, by name."""

    cycle: float
    first: float | None
    last: float | None
    critical: tuple[str, ...]
    durations: tuple[float, ...] = field(repr=False)
    busy: tuple[float, ...] = field(repr=False)
    gears: tuple[float, ...] = field(repr=False)


def predicted(recording: Recording) -> Predicted | None:
    """The prediction; None where there is no layout to predict from."""
    if recording.layout is None:
        return None
    made = conditions(recording.log.header)
    timing = Timing(recording.layout, made.settings, made.world, made.seed, made.jitter)
    net = timed_net(timing, wip=made.wip)
    units = max(1, int(recording.log.delivered[-1]))
    timeline = flow(timing, net, units)
    begun = recording.from_start
    of_circuit = {circuit.name: circuit.seconds for circuit in net.named}
    return Predicted(
        net.pace,
        timeline.first if begun else None,
        timeline.last if begun else None,
        tuple(circuit.name for circuit in net.critical),
        tuple((timeline.lasting + made.settings.tick).tolist()),
        timeline.busy,
        tuple(of_circuit[robot.name] for robot in recording.factory.robots),
    )
