"""Runs to compare with: their conditions and records."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from factory.control.profile import World
from factory.plant.factory import Factory
from factory.record.log.header import settings_of
from factory.simulation.run import Event, Run
from factory.study.analysis.measured import RunRecord, dropoff_times
from factory.support.errors import Diagnostic, InputError
from factory.support.settings import Settings


@dataclass(frozen=True, slots=True)
class Conditions:
    """The conditions of a run, which its prediction assumes."""

    settings: Settings
    world: World
    seed: int
    jitter: float
    wip: int | None


def record_of(run: Run) -> RunRecord:
    """The record of a run that was just made."""
    return RunRecord("a run on the spot", run.events, run.dropoffs)


def logged_record(
    source: str,
    events: Sequence[tuple[float, str]],
    time: NDArray[np.float64],
    delivered: NDArray[np.int32],
) -> RunRecord:
    """The record of the run in a log."""
    made = tuple(Event(t, name) for t, name in events)
    return RunRecord(source, made, dropoff_times(time, delivered))


def conditions(header: Mapping[str, Any]) -> Conditions:
    """The conditions of the run in a log."""
    settings, jitter = settings_of(header), float(header["jitter"])
    return Conditions(settings, header["world"], header["seed"], jitter, header.get("wip"))


HINT = "`factory run FILE.pag --log OUT` writes one that fits"


def check_log(source: str, header: Mapping[str, Any], factory: Factory) -> None:
    """Raises InputError (BadLog) where the run in a log is not one of this factory, or does not
    start from its initial marking."""
    net = factory.net.threaded
    names = [transition.name for transition in net.transitions]
    if header.get("transitions") != names:
        message = f"'{source}' is the log of another factory: other operations, or other robots"
        raise InputError(Diagnostic("BadLog", message, None, HINT))
    if header.get("start") != sorted(factory.net.initial_marking):
        message = f"the run in '{source}' began in the middle (--from)"
        raise InputError(
            Diagnostic("BadLog", message, None, "take one that began at the beginning")
        )


def check_products(record: RunRecord) -> None:
    """Raises InputError (BadLog) where a run finished no product."""
    if not record.dropoffs:
        message = f"'{record.source}' has no finished product"
        raise InputError(Diagnostic("BadLog", message, None, "take a longer run"))
