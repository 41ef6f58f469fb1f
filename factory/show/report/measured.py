"""What a run shows of its pace: cycle time, how long operations take, how busy robots are."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from factory.show.report.recording import Recording


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
    """What the log's events say."""
    log, factory = recording.log, recording.factory
    times: dict[int, list[float]] = {}
    for number, at in zip(log.fired.tolist(), log.fired_t.tolist(), strict=True):
        times.setdefault(number, []).append(at)
    grown = np.flatnonzero(np.diff(log.delivered)) + 1
    dropoffs = tuple(log.time[grown].tolist())
    durations: list[float | None] = []
    busy = np.zeros(len(factory.robots))
    for operation in factory.operations:
        begun, ended = times.get(operation.start, []), times.get(operation.end, [])
        late = len(ended) - len(begun) if len(ended) > len(begun) else 0
        spent = [end - start for start, end in zip(begun, ended[late:], strict=False)]
        counted = spent[1:] or spent
        durations.append(sum(counted) / len(counted) if counted else None)
        for robot in operation.robots:
            busy[robot] += sum(spent)
    gears = [sum(durations[o] or 0.0 for o in robot.operations) for robot in factory.robots]
    total = recording.end or 1.0
    return MeasuredPace(
        dropoffs,
        _interval(dropoffs),
        tuple(durations),
        tuple((busy / total).tolist()),
        tuple(gears),
    )


def _interval(left: tuple[float, ...]) -> float | None:
    if len(left) < 4:
        return None
    tail = left[len(left) // 2 - 1 :]
    return (tail[-1] - tail[0]) / (len(tail) - 1)
