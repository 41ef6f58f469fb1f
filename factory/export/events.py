"""The events of a log as rows of a table: what fired when, of which operation, on which line."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

from factory.record.log import Log
from factory.record.log.recompiled import factory_of


@dataclass(frozen=True, slots=True)
class EventRow:
    """A transition that fired: at `time_s` [s]; `kind` is start or end; `operation` the label it
    makes; `unit` how often it has fired by then; `robots` those of the operation."""

    time_s: float
    transition: str
    kind: str
    operation: str
    template: str
    unit: int
    carrier: str
    robots: tuple[str, ...]
    file: str
    line: int
    column: int


COLUMNS = tuple(EventRow.__dataclass_fields__)
"""The names of the columns."""


def rows(log: Log) -> Iterator[EventRow]:
    """The events in the order in which they were recorded. Raises InputError (BadLog) where the log
    is not of the factory that its header describes."""
    factory, units = factory_of(log.header), Counter[int]()
    for time, number in zip(log.fired_t.tolist(), log.fired.tolist(), strict=True):
        units[number] += 1
        operation = factory.operations[number // 2]
        at = operation.position
        yield EventRow(
            round(time, 9),
            factory.net.threaded.transitions[number].name,
            "end" if number % 2 else "start",
            operation.label,
            operation.template.name,
            units[number],
            factory.robots[operation.carrier].name,
            tuple(factory.robots[r].name for r in operation.robots),
            at.file if at else "",
            at.line if at else 0,
            at.column if at else 0,
        )
