"""The pace of a run as measured: cycle time, durations of operations, utilisation of robots."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from factory.show.report.recording import Recording
from factory.study.analysis.measured import (
    dropoff_times,
    mean_interval,
    operation_times,
    robot_times,
)


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
    spent = operation_times(factory, zip(log.fired.tolist(), log.fired_t.tolist(), strict=True))
    counted = [times[1:] or times for times in spent]
    durations = [sum(times) / len(times) if times else None for times in counted]
    dropoffs = dropoff_times(log.time, log.delivered)
    gears = [sum(durations[o] or 0.0 for o in robot.operations) for robot in factory.robots]
    total = recording.end or 1.0
    return MeasuredPace(
        dropoffs,
        mean_interval(dropoffs),
        tuple(durations),
        tuple(busy / total for busy in robot_times(factory, spent)),
        tuple(gears),
    )
