"""A run, made now or read from a log, compared with its prediction: durations, cycle time,
utilisation."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from factory.api import Diagnostic, Event, Factory, InputError, Run, Settings, Timing, WorldName
from factory.apps.analyze.timed import Flow, TimedNet
from factory.apps.log import Log
from factory.apps.log.project_table import settings_of
from factory.support.arrays import Array

HINT = "`factory run FILE.pag --log OUT` writes one that fits"


@dataclass(frozen=True, slots=True)
class ComparedFigure:
    """A quantity as predicted and as measured; None if the run is too short."""

    predicted: float
    measured: float | None

    @property
    def error(self) -> float | None:
        """Relative error of the prediction."""
        return self.predicted / self.measured - 1 if self.measured else None


@dataclass(frozen=True, slots=True)
class Duration:
    """Duration of an operation from its start to its end [s], with the `least` and `greatest`
    measured. Its first occurrence is left out if there are others: robots start it from other
    positions."""

    label: str
    time: ComparedFigure
    least: float
    greatest: float
    count: int


@dataclass(frozen=True)
class Comparison:
    """A run of `units` products compared with its prediction."""

    source: str
    units: int
    cycle: ComparedFigure
    first: ComparedFigure
    last: ComparedFigure
    durations: tuple[Duration, ...] = field(repr=False)
    busy: tuple[ComparedFigure, ...] = field(repr=False)


@dataclass(frozen=True, slots=True)
class RunRecord:
    """A run to compare with: its events, and the date of each dropoff [s]."""

    source: str
    events: tuple[Event, ...]
    dropoffs: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Conditions:
    """The conditions of a run, which its prediction assumes."""

    settings: Settings
    world: WorldName
    seed: int
    jitter: float
    wip: int | None


def conditions(header: Mapping[str, Any]) -> Conditions:
    """The conditions of the run in a log."""
    settings, jitter = settings_of(header), float(header["jitter"])
    return Conditions(settings, header["world"], header["seed"], jitter, header["wip"])


def record_of(run: Run) -> RunRecord:
    """The record of a run just made. Raises InputError (BadLog) if it finished no product."""
    return _checked(RunRecord("a run on the spot", run.lasting, run.dropoffs))


def logged_record(source: str, log: Log, factory: Factory) -> RunRecord:
    """The record of the run in a log. Raises InputError (BadLog) if it is of another factory, does
    not start from the initial marking, or finished no product."""
    net = factory.net.threaded
    if log.header["transitions"] != [transition.name for transition in net.transitions]:
        message = f"'{source}' is the log of another factory: other operations, or other robots"
        raise InputError(Diagnostic("BadLog", message, None, HINT))
    if log.header["start"] != sorted(factory.net.initial_marking):
        message = f"the run in '{source}' did not start from the initial marking (--from)"
        hint = "use the log of a run without --from"
        raise InputError(Diagnostic("BadLog", message, None, hint))
    made = tuple(Event(t, name) for t, name in log.lasting)
    return _checked(RunRecord(source, made, dropoff_times(log.time, log.delivered)))


def _checked(record: RunRecord) -> RunRecord:
    if not record.dropoffs:
        message = f"'{record.source}' has no finished product"
        raise InputError(Diagnostic("BadLog", message, None, "use the log of a longer run"))
    return record


def compare(timing: Timing, net: TimedNet, flow: Flow, record: RunRecord) -> Comparison:
    """The record of a run from the initial marking, compared with the flow of as many units."""
    factory = timing.factory
    number = factory.net.threaded.net.transition_index
    spent = operation_times(factory, ((number[e.transition], e.t) for e in record.events))
    busy = robot_times(factory, spent)
    first, usual = flow.durations[0], flow.lasting
    compared = [
        _duration(o.label, float((usual if len(times) > 1 else first)[o.index]), times)
        for o, times in zip(factory.operations, spent, strict=True)
    ]
    left = record.dropoffs
    last = left[-1] if left else None
    return Comparison(
        record.source,
        len(left),
        ComparedFigure(net.pace, Run.mean_interval(left, factory.period)),
        ComparedFigure(flow.first, left[0] if left else None),
        ComparedFigure(flow.last, last),
        tuple(compared),
        tuple(
            ComparedFigure(p, b / last if last else None)
            for p, b in zip(flow.busy, busy, strict=True)
        ),
    )


def operation_times(factory: Factory, firings: Iterable[tuple[int, float]]) -> list[list[float]]:
    """Time from start to end of each operation each time [s], by the times at which transitions (by
    number) fired. An end whose start was before the run is left out."""
    times: dict[int, list[float]] = {}
    for number, t in firings:
        times.setdefault(number, []).append(t)
    spent = []
    for operation in factory.operations:
        begun, ended = times.get(operation.start, []), times.get(operation.end, [])
        late = max(0, len(ended) - len(begun))
        spent.append([end - start for start, end in zip(begun, ended[late:], strict=False)])
    return spent


def robot_times(factory: Factory, spent: Sequence[Sequence[float]]) -> list[float]:
    """Time of each robot in operations [s], by the durations of these each time."""
    busy = [0.0] * len(factory.robots)
    for operation, times in zip(factory.operations, spent, strict=True):
        for robot in operation.robots:
            busy[robot] += sum(times)
    return busy


def dropoff_times(time: Array, delivered: NDArray[np.int32]) -> tuple[float, ...]:
    """Dates of the dropoffs [s], to a tick, by the ticks of a log."""
    return tuple(time[np.flatnonzero(np.diff(delivered)) + 1].tolist())


def _duration(label: str, predicted: float, spent: Sequence[float]) -> Duration:
    counted = np.array(spent[1:] if len(spent) > 1 else spent)
    if not len(counted):
        return Duration(label, ComparedFigure(predicted, None), 0.0, 0.0, 0)
    mean = float(counted.mean())
    return Duration(
        label,
        ComparedFigure(predicted, mean),
        float(counted.min()),
        float(counted.max()),
        len(counted),
    )
