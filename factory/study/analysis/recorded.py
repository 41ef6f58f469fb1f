"""Runs to compare with: their conditions and records."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from factory.control.profile import World
from factory.plant.factory import Factory
from factory.record.log import Log
from factory.record.project_table import settings_of
from factory.simulation.run import Event, Run
from factory.study.analysis.measured import RunRecord, dropoff_times
from factory.support.errors import Diagnostic, InputError
from factory.support.settings import Settings

HINT = "`factory run FILE.pag --log OUT` writes one that fits"


@dataclass(frozen=True, slots=True)
class Conditions:
    """The conditions of a run, which its prediction assumes."""

    settings: Settings
    world: World
    seed: int
    jitter: float
    wip: int | None


def record_of(run: Run) -> RunRecord:
    """The record of a run that was just made. Raises InputError (BadLog) where it finished no
    product."""
    return _checked(RunRecord("a run on the spot", run.lasting, run.dropoffs))


def logged_record(source: str, log: Log, factory: Factory) -> RunRecord:
    """The record of the run in a log. Raises InputError (BadLog) where it is not one of this
    factory, does not start from its initial marking, or finished no product."""
    net = factory.net.threaded
    if log.header["transitions"] != [transition.name for transition in net.transitions]:
        message = f"'{source}' is the log of another factory: other operations, or other robots"
        raise InputError(Diagnostic("BadLog", message, None, HINT))
    if log.header["start"] != sorted(factory.net.initial_marking):
        message = f"the run in '{source}' began in the middle (--from)"
        hint = "take one that began at the beginning"
        raise InputError(Diagnostic("BadLog", message, None, hint))
    made = tuple(Event(t, name) for t, name in log.lasting)
    return _checked(RunRecord(source, made, dropoff_times(log.time, log.delivered)))


def _checked(record: RunRecord) -> RunRecord:
    if not record.dropoffs:
        message = f"'{record.source}' has no finished product"
        raise InputError(Diagnostic("BadLog", message, None, "take a longer run"))
    return record


def conditions(header: Mapping[str, Any]) -> Conditions:
    """The conditions of the run in a log."""
    settings, jitter = settings_of(header), float(header["jitter"])
    return Conditions(settings, header["world"], header["seed"], jitter, header["wip"])
